#pragma once
// Tables for people to read on a terminal.

#include <string>
#include <vector>

namespace graze {

/// Columns set apart by two blanks; the first `left` flush left, the others flush right. First row: the head. Cells are
/// UTF-8; each row has as many cells as the head.
std::string text_table(const std::vector<std::vector<std::string>>& rows, std::size_t left);

/// The text with its decimals rounded to six significant digits: "normal(mean=2700.0000036)" -> "normal(mean=2700)".
std::string rounded_numbers(const std::string& text);

}  // namespace graze
