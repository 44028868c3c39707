#include "scenarios/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/settings/inputs.h"
#include "engine/settings/units.h"
#include "scenarios/limits.h"

namespace graze {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kAround = " \t\r\"";
  const auto first = text.find_first_not_of(kAround);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kAround) - first + 1);
}

/// Calls take(cell) for each cell of a line.
template <typename Take>
void split(std::string_view line, bool at_spaces, const Take& take) {
  const bool marked = line.find_first_of(",;") != std::string_view::npos;
  const std::string_view separators = marked ? ",;" : at_spaces ? " \t" : "";
  for (std::size_t from = 0;;) {
    const std::size_t end = std::min(line.find_first_of(separators, from), line.size());
    const std::string_view cell = trimmed(line.substr(from, end - from));
    if (marked || !cell.empty()) take(cell);
    if (end == line.size()) return;
    from = end + 1;
  }
}

/// A file's lines that hold something, one at a time: the file may be large.
class Lines {
 public:
  Lines(const Settings& where, const std::string& file)
      : text_(read_input(file, fmt::format("{}: {}: ", where.place(), where.path()), kMaxCsvBytes)) {
    const std::size_t zero = text_.find('\0');
    if (zero == std::string::npos) return;
    const std::size_t line = zero == 0 ? std::string::npos : text_.rfind('\n', zero - 1);  // the end of the one before
    throw InputError(fmt::format(
        "{}:{}:{}: a NUL byte: tables are text (UTF-8), and this is a binary file, UTF-16, or one that was cut off "
        "when "
        "it was written",
        file, std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(zero), '\n') + 1, zero - line));
  }

  /// False at the end.
  bool next() {
    while (at_ < text_.size()) {
      const std::size_t end = std::min(text_.find('\n', at_), text_.size());
      line_ = std::string_view(text_).substr(at_, end - at_);
      at_ = end + 1;
      ++number_;
      if (!trimmed(line_).empty() && line_[0] != '#') return true;
    }
    return false;
  }
  std::string_view line() const { return line_; }
  int number() const { return number_; }  // from 1

 private:
  std::string text_;
  std::size_t at_ = 0;
  std::string_view line_;
  int number_ = 0;
};

/// `column`: its name, if it has one.
double parse(std::string_view cell, const std::string& file, int line, const std::string& column = "") {
  const auto number = split_number(cell);
  if (!number || !number->unit.empty() || !std::isfinite(number->value)) {
    throw InputError(fmt::format("{}:{}: {}'{}': must be a number", file, line,
                                 column.empty() ? "" : fmt::format("column {}: ", column), clipped(cell, 40)));
  }
  return number->value;
}

/// The cells of a line of a file whose columns have names.
std::vector<std::string_view> columns(const Lines& lines, const std::string& file) {
  std::vector<std::string_view> out;
  split(lines.line(), false, [&](std::string_view cell) {
    if (out.size() == kMaxColumns) {
      throw InputError(fmt::format("{}:{}: more than {} columns", file, lines.number(), kMaxColumns));
    }
    out.push_back(cell);
  });
  return out;
}

}  // namespace

std::vector<std::vector<double>> read_grid(const Settings& where, std::size_t most) {
  const std::string file = where.resolve_file(where.text());
  std::vector<std::vector<double>> out;
  std::size_t numbers = 0;
  for (Lines lines(where, file); lines.next();) {
    std::vector<double>& row = out.emplace_back();
    if (lines.line().find(',') != std::string_view::npos && lines.line().find(';') != std::string_view::npos) {
      throw InputError(
          fmt::format("{}:{}: has ',' and ';', of which one separates numbers; decimals are written with '.'", file,
                      lines.number()));
    }
    split(lines.line(), true, [&](std::string_view cell) {
      if (++numbers > most) {
        throw InputError(fmt::format("{}:{}: more than {} numbers; use a coarser grid", file, lines.number(), most));
      }
      row.push_back(parse(cell, file, lines.number()));
    });
    if (row.size() != out.front().size()) {
      throw InputError(fmt::format("{}:{}: {} numbers, the first row has {}; all must have as many", file,
                                   lines.number(), row.size(), out.front().size()));
    }
  }
  if (out.empty()) where.fail(file + ": holds no lines");
  return out;
}

std::vector<double> read_column(const Settings& settings, Quantity quantity) {
  const Settings name = settings.at("file"), column = settings.at("column");
  const std::string file = name.resolve_file(name.text()), unit = settings.text_or("unit", "");
  if (!to_si(quantity, 1, unit))
    settings.at("unit").fail(fmt::format("{}: does not fit; one of: {}", unit, units_of(quantity)));
  Lines lines(name, file);
  if (!lines.next()) name.fail(file + ": holds no lines");
  const std::vector<std::string_view> cells = columns(lines, file);
  const std::vector<std::string> header(cells.begin(), cells.end());
  const auto found = std::find(header.begin(), header.end(), column.text());
  if (found == header.end()) {
    const std::string near = nearest(column.text(), header);
    column.fail(fmt::format("{}: {} has no such column{}", column.text(), file,
                            near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
  }
  const auto index = static_cast<std::size_t>(found - header.begin());
  std::vector<double> out;
  while (lines.next()) {
    const std::vector<std::string_view> row = columns(lines, file);
    if (index >= row.size())
      throw InputError(
          fmt::format("{}:{}: too few columns; {} is number {}", file, lines.number(), column.text(), index + 1));
    out.push_back(*to_si(quantity, parse(row[index], file, lines.number(), column.text()), unit));
  }
  return out;
}

}  // namespace graze
