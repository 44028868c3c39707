#pragma once

#include <string>

#include "engine/settings/settings.h"

namespace graze {

/// What a stranger says, fit for one line of a message or an archive.
inline std::string one_line(const std::string& text) {
  std::string out = clipped(text, 400);
  for (char& c : out) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 0x20 || code == 0x7f) c = ' ';
  }
  return out;  // archives and terminals see to what is no UTF-8
}

}  // namespace graze
