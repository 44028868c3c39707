#include "analysis/text_table.h"

#include <algorithm>

#include "archive/files/utf8.h"

namespace graze {
std::string text_table(const std::vector<std::vector<std::string>>& cells, std::size_t left) {
  std::vector<std::vector<std::string>> rows = cells;
  for (auto& row : rows) {
    for (std::string& cell : row) cell = printable(cell);
  }
  std::vector<std::size_t> width(rows.front().size());
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], width_of(row[i]));
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string blanks(width[i] - width_of(row[i]), ' ');
      line.append(i < left ? row[i] : blanks).append(i < left ? blanks : row[i]).append("  ");
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out.append(line).append("\n");
  }
  return out;
}

}  // namespace graze
