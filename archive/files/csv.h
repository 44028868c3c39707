#pragma once
// Cells of CSV files (RFC 4180).

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace graze {

/// A text as one cell: between quotes if it holds a comma, a quote or the end of a line.
inline std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + '"';
}

/// A number as one cell, with as many digits as give the same bits when they are read again; empty if it is not known.
inline std::string csv_number(double x) { return std::isnan(x) ? "" : fmt::format("{}", x); }

}  // namespace graze
