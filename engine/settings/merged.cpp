#include "engine/settings/merged.h"

#include <fmt/format.h>

namespace graze {
namespace {

/// Places of the command line have no lines.
bool has_lines(const Settings& value) { return value.key_place() != value.file(); }

}  // namespace

std::string replace_hint(const SettingsEntry& first, const SettingsEntry& second) {
  if (first.second.file() == second.second.file() || !has_lines(first.second) || !has_lines(second.second)) return "";
  return fmt::format(
      "; '{}' stands at {}, and the maps of included files are merged: '!replace {{{}: …}}' takes its "
      "place",
      first.first, first.second.key_place(), second.first);
}

}  // namespace graze
