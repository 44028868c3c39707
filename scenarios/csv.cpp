#include "scenarios/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>

#include "engine/settings/tree.h"
#include "engine/settings/units.h"

namespace graze {
namespace {

struct Line {
  int number;  // from 1
  std::vector<std::string> cells;
};

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\"");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1);
}

std::vector<std::string> split(const std::string& line, bool at_spaces) {
  const bool marked = line.find_first_of(",;") != std::string::npos;
  const std::string separators = marked ? ",;" : at_spaces ? " \t" : "";
  std::vector<std::string> out;
  std::size_t from = 0;
  while (true) {
    const std::size_t end = std::min(line.find_first_of(separators, from), line.size());
    std::string cell = trimmed(line.substr(from, end - from));
    if (marked || !cell.empty()) out.push_back(std::move(cell));
    if (end == line.size()) return out;
    from = end + 1;
  }
}

std::vector<Line> read_lines(const Settings& where, const std::string& file, bool at_spaces) {
  std::istringstream stream(read_text(file, fmt::format("{}: {}: ", where.place(), where.path())));
  std::vector<Line> out;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    if (trimmed(text).empty() || text[0] == '#') continue;
    out.push_back({number, split(text, at_spaces)});
  }
  if (out.empty()) where.fail(file + ": holds no lines");
  return out;
}

double parse(const std::string& cell, const std::string& file, int line) {
  const auto number = split_number(cell);
  if (!number || !number->unit.empty() || !std::isfinite(number->value)) {
    throw InputError(fmt::format("{}:{}: '{}': must be a number", file, line, cell));
  }
  return number->value;
}

}  // namespace

std::vector<std::vector<double>> read_grid(const Settings& where) {
  const std::string file = where.resolve_file(where.text());
  std::vector<std::vector<double>> out;
  for (const Line& line : read_lines(where, file, true)) {
    std::vector<double> row;
    for (const std::string& cell : line.cells) row.push_back(parse(cell, file, line.number));
    out.push_back(std::move(row));
  }
  return out;
}

std::vector<double> read_column(const Settings& settings, Quantity quantity) {
  const Settings name = settings.at("file"), column = settings.at("column");
  const std::string file = name.resolve_file(name.text()), unit = settings.text_or("unit", "");
  if (!to_si(quantity, 1, unit))
    settings.at("unit").fail(fmt::format("{}: does not fit; one of: {}", unit, units_of(quantity)));
  const std::vector<Line> lines = read_lines(name, file, false);
  const std::vector<std::string>& header = lines.front().cells;
  const auto found = std::find(header.begin(), header.end(), column.text());
  if (found == header.end()) {
    const std::string near = nearest(column.text(), header);
    column.fail(fmt::format("{}: {} has no such column{}", column.text(), file,
                            near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
  }
  const auto index = static_cast<std::size_t>(found - header.begin());
  std::vector<double> out;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    if (index >= lines[i].cells.size()) throw InputError(fmt::format("{}:{}: too few columns", file, lines[i].number));
    out.push_back(*to_si(quantity, parse(lines[i].cells[index], file, lines[i].number), unit));
  }
  return out;
}

}  // namespace graze
