#pragma once
// What merging by `include` may have put together that was meant to stand alone.

#include <string>

#include "engine/settings/settings.h"

namespace graze {

/// An entry of a map, as Settings::entries() has it.
using SettingsEntry = std::pair<std::string, Settings>;

/// "; 'uniform' stands at base.yaml:3:9, …: !replace {normal: …} takes its place", for two entries of one map of which
/// only one may be there, if they come from two files. Empty: they stand in one file, or one of them on the command
/// line.
std::string replace_hint(const SettingsEntry& first, const SettingsEntry& second);

}  // namespace graze
