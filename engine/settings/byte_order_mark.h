#pragma once
// The mark that some programs write before the text of a file (a spreadsheet's "CSV UTF-8").

#include <string>

namespace graze {

/// The text behind a byte order mark of UTF-8, if one stands there; the whole of it otherwise.
inline std::string without_mark(std::string text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  return text;
}

}  // namespace graze
