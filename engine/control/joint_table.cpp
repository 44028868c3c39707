#include "engine/control/joint_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "engine/settings/byte_order_mark.h"
#include "engine/settings/csv_cells.h"
#include "engine/settings/inputs.h"
#include "engine/settings/paths.h"
#include "engine/settings/similar.h"

namespace graze {

namespace {

[[noreturn]] void fail(const std::string& name, int line, std::size_t column, const std::string& message) {
  throw InputError(fmt::format("{}:{}:{}: {}", name, line, column, message));
}

double number(const std::string& name, int line, const CsvCell& cell) {
  double value = 0;
  const char* const end = cell.text.data() + cell.text.size();
  const auto [stop, error] = std::from_chars(cell.text.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) {
    fail(name, line, cell.column, "'" + cell.shown() + "' is not a finite number");
  }
  return value;
}

std::vector<int> read_header(const std::string& name, const std::vector<CsvCell>& header,
                             const std::vector<std::string>& joints) {
  if (header.size() < 2 || header.front().text != "time") {
    fail(name, 1, 1, "the header must be 'time' and at least one joint, separated by commas");
  }
  std::vector<int> columns;
  for (std::size_t c = 1; c < header.size(); ++c) {
    const CsvCell& cell = header[c];
    const auto found = std::find(joints.begin(), joints.end(), cell.text);
    if (found == joints.end()) {
      fail(name, 1, cell.column,
           "'" + cell.shown() + "' is no actuated joint" + similar_names(cell.text, joints, false));
    }
    const int joint = static_cast<int>(found - joints.begin());
    if (std::count(columns.begin(), columns.end(), joint) != 0) {
      fail(name, 1, cell.column, "'" + cell.shown() + "' stands twice");
    }
    columns.push_back(joint);
  }
  return columns;
}

}  // namespace

Key interpolation_key() {
  return {"interpolation",
          {Form::word({"linear", "cubic"})},
          Default::value("linear"),
          "between the rows of the table",
          "table"};
}

Interpolation read_interpolation(const Described& settings) {
  return settings.word("interpolation") == "cubic" ? Interpolation::cubic : Interpolation::linear;
}

JointTable JointTable::load(const Settings& file, const std::vector<std::string>& joints, Interpolation interpolation) {
  const std::string path = file.resolve_file(file.text());
  if (!input_exists(path)) {
    const std::string near = path_suggestion(path);
    file.fail("'" + path + "' is not there" + (near.empty() ? "; a CSV file 'time,JOINT,…' must be" : near));
  }
  return parse(read_input(path), file.place() + ": " + file.path() + ": " + path, joints, interpolation);
}

JointTable JointTable::parse(const std::string& text, const std::string& name, const std::vector<std::string>& joints,
                             Interpolation interpolation) {
  JointTable table;
  table.interpolation_ = interpolation;
  std::stringstream stream(without_mark(text));
  std::string line;
  for (int number_of_line = 1; std::getline(stream, line); ++number_of_line) {
    std::vector<CsvCell> cells = csv_cells(line);
    if (cells.size() > 1 && cells.back().text.empty()) cells.pop_back();  // a comma at the end
    if (number_of_line == 1) {
      table.columns_ = read_header(name, cells, joints);
      table.values_.resize(table.columns_.size());
      continue;
    }
    if (cells.size() == 1 && cells.front().text.empty()) continue;
    if (cells.size() != table.columns_.size() + 1) {
      const std::size_t wanted = table.columns_.size() + 1;
      fail(name, number_of_line, cells.size() > wanted ? cells[wanted].column : line.size() + 1,
           fmt::format("{} values; the header has {} columns", cells.size(), wanted));
    }
    const double time = number(name, number_of_line, cells[0]);
    if (!table.time_.empty() && time <= table.time_.back()) {
      fail(name, number_of_line, cells[0].column,
           "time " + cells[0].shown() + " does not lie after the row before; times must grow");
    }
    table.time_.push_back(time);
    for (std::size_t c = 0; c + 1 < cells.size(); ++c) {
      table.values_[c].push_back(number(name, number_of_line, cells[c + 1]));
    }
  }
  if (table.time_.empty()) fail(name, 1, 1, "the table has no rows");
  return table;
}

double JointTable::slope(std::size_t column, std::size_t knot) const {
  const std::vector<double>& x = values_[column];
  const auto chord = [&](std::size_t i) { return (x[i + 1] - x[i]) / (time_[i + 1] - time_[i]); };
  if (knot == 0) return chord(0);
  if (knot + 1 == time_.size()) return chord(knot - 1);
  const double before = time_[knot] - time_[knot - 1], after = time_[knot + 1] - time_[knot];
  return (chord(knot - 1) * after + chord(knot) * before) / (before + after);
}

JointTable::Sample JointTable::at(std::size_t column, double t) const {
  const std::vector<double>& x = values_[column];
  if (t < time_.front() || time_.size() == 1) return {x.front(), 0};
  if (t >= time_.back()) return {x.back(), 0};
  const auto after = std::upper_bound(time_.begin(), time_.end(), t);
  const auto i = static_cast<std::size_t>(after - time_.begin()) - 1;
  const double h = time_[i + 1] - time_[i];
  const double s = (t - time_[i]) / h;
  const double rise = x[i + 1] - x[i];
  if (interpolation_ == Interpolation::linear) return {x[i] + s * rise, rise / h};
  // Cubic Hermite between the knots: x0 + s m0 + s^2 (3 d - 2 m0 - m1) + s^3 (m0 + m1 - 2 d).
  const double m0 = h * slope(column, i), m1 = h * slope(column, i + 1);
  const double c2 = 3 * rise - 2 * m0 - m1, c3 = m0 + m1 - 2 * rise;
  return {x[i] + s * (m0 + s * (c2 + s * c3)), (m0 + s * (2 * c2 + s * 3 * c3)) / h};
}

}  // namespace graze
