#pragma once

#include <string>

#include "engine/settings/settings.h"

namespace graze {

/// A settings tree as JSON. A scalar that reads as a number, true, false or null is one; all else is text.
std::string settings_json(const Settings& settings);

/// A text as JSON, in quotes.
std::string json_text(const std::string& text);

}  // namespace graze
