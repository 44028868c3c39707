#pragma once
// Tables for people to read on a terminal.

#include <string>
#include <vector>

namespace graze {

/// Columns set apart by two blanks; the first `left` flush left, the others flush right. First row: the head. Cells are
/// UTF-8; each row has as many cells as the head.
std::string text_table(const std::vector<std::vector<std::string>>& rows, std::size_t left);

}  // namespace graze
