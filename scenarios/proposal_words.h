#pragma once
// Names that may be anybody's, in the text of a proposed scenario.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdlib>
#include <string>

#include "engine/settings/settings.h"

namespace graze {

/// Two digits, as a person would write a gain.
inline double rounded(double x) { return std::strtod(fmt::format("{:.1e}", x).c_str(), nullptr); }

/// The first line of a message, without the place if that is in `file`, which is not there yet.
inline std::string without_place(const std::string& file, const std::string& message) {
  std::string out = message.substr(0, message.find('\n'));
  if (!out.starts_with(file + ":")) return out;
  const std::size_t end = out.find(": ", file.size());
  return end == std::string::npos ? out : out.substr(end + 2);
}

/// "1 link", "2 links"
inline std::string counted(std::size_t n, const std::string& noun) {
  return std::to_string(n) + " " + noun + (n == 1 ? "" : "s");
}

/// A text as YAML has it in quotes; what is no printable character, and would end or change it there, in double ones.
inline std::string quoted(const std::string& text) {
  const auto control = [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; };
  if (std::any_of(text.begin(), text.end(), control)) {
    std::string out = "\"";
    for (const char c : text) {
      if (control(c)) {
        constexpr const char* kDigits = "0123456789abcdef";
        const auto byte = static_cast<unsigned char>(c);
        out += std::string("\\x") + kDigits[byte >> 4] + kDigits[byte & 15];
      } else {
        out += (c == '"' || c == '\\' ? "\\" : "") + std::string(1, c);
      }
    }
    return out + "\"";
  }
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

/// A name that may be anybody's, within a comment: a line of its own would be a key of the scenario.
inline std::string in_comment(std::string name) {
  for (char& c : name) {
    if (std::iscntrl(static_cast<unsigned char>(c))) c = '?';
  }
  return clipped(name, 80);
}

}  // namespace graze
