#pragma once
// Lines of tables whose columns have names, for those that read them row by row (command_file.h, joint_table.h).

#include <cstddef>
#include <string>
#include <vector>

namespace graze {

/// A value between two commas, without the blanks around it, and where it begins; 1: the line's first byte.
struct CsvCell {
  std::string text;
  std::size_t column;

  /// Its text as messages quote it: not too long.
  std::string shown() const;
};

/// At least one.
std::vector<CsvCell> csv_cells(const std::string& line);

}  // namespace graze
