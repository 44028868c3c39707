#pragma once
// NUL characters, which YAML knows ("\0") and which end what the system is given: of names and of messages.

#include <string>

namespace graze {

inline bool has_nul(const std::string& text) { return text.find('\0') != std::string::npos; }

/// A message with \0 written for each NUL: what() would end at the first.
inline std::string with_nul_shown(const std::string& message) {
  std::string out;
  for (const char c : message) c == '\0' ? out += "\\0" : out += c;
  return out;
}

}  // namespace graze
