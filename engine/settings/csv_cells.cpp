#include "engine/settings/csv_cells.h"

#include <algorithm>
#include <string_view>

#include "engine/settings/settings.h"

namespace graze {

std::string CsvCell::shown() const {
  constexpr std::size_t kShown = 40;
  return clipped(text, kShown);
}

std::vector<CsvCell> csv_cells(const std::string& line) {
  constexpr std::string_view kBlanks = " \t\r";
  std::vector<CsvCell> out;
  for (std::size_t begin = 0;;) {
    const std::size_t comma = std::min(line.find(',', begin), line.size());
    std::size_t first = line.find_first_not_of(kBlanks, begin);
    if (first == std::string::npos || first > comma) first = comma;
    std::size_t end = comma;
    while (end > first && kBlanks.find(line[end - 1]) != std::string_view::npos) --end;
    out.push_back({line.substr(first, end - first), first + 1});
    if (comma == line.size()) return out;
    begin = comma + 1;
  }
}

}  // namespace graze
