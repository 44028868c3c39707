#include "engine/control/command_file.h"

#include <fmt/format.h>

#include <array>
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

constexpr std::array<const char*, 5> kCommandColumns = {"time", "forward", "strafe", "turn", "policy"};
constexpr std::size_t kCommandNumbers = 4;

/// Reads the lines of one file.
class CommandReader {
 public:
  explicit CommandReader(const std::string& name) : name_(name) {}

  void read_header(const std::string& text) {
    line_ = 1;
    const std::vector<CsvCell> cells = csv_cells(text);
    columns_ = cells.size();
    for (std::size_t i = 0; i < std::max(columns_, kCommandNumbers); ++i) {
      if (i < columns_ && i < kCommandColumns.size() && cells[i].text == kCommandColumns[i]) continue;
      const std::size_t at = i < columns_ ? cells[i].column : text.size() + 1;
      fail(at, fmt::format("'{}': the header must be time,forward,strafe,turn, and ,policy may follow",
                           i < columns_ ? cells[i].shown() : ""));
    }
  }

  void read_row(const std::string& text) {
    ++line_;
    const std::vector<CsvCell> cells = csv_cells(text);
    if (cells.size() == 1 && cells[0].text.empty()) return;
    if (cells.size() != columns_) {
      fail(cells.size() > columns_ ? cells[columns_].column : text.size() + 1,
           fmt::format("{} values; the header has {} columns", cells.size(), columns_));
    }
    CommandRow row{number(cells[0]), number(cells[1]), number(cells[2]), number(cells[3])};
    row.line = line_;
    if (row.time < 0) fail(cells[0].column, fmt::format("time {} is negative; it must be >= 0", cells[0].shown()));
    if (!rows_.empty() && row.time <= rows_.back().time) {
      fail(cells[0].column,
           fmt::format("time {} does not lie after the row before; times must grow", cells[0].shown()));
    }
    if (columns_ > kCommandNumbers) {
      row.policy = cells[kCommandNumbers].text;
      row.policy_column = cells[kCommandNumbers].column;
      if (row.policy.empty()) fail(cells[kCommandNumbers].column, "no policy stands here; its name must");
    }
    rows_.push_back(row);
  }

  std::vector<CommandRow> take() {
    if (rows_.empty()) fail(1, "has no rows; one at least must stand below the header, as 0,0.2,0,0");
    return std::move(rows_);
  }

 private:
  [[noreturn]] void fail(std::size_t column, const std::string& message) const {
    throw InputError(fmt::format("{}:{}:{}: {}", name_, line_, column, message));
  }

  double number(const CsvCell& cell) const {
    double value = 0;
    const char* const end = cell.text.data() + cell.text.size();
    const auto [stop, error] = std::from_chars(cell.text.data(), end, value);
    if (error == std::errc() && stop == end && std::isfinite(value)) return value;
    fail(cell.column, fmt::format("'{}' is no number; s, m/s, m/s and rad/s stand here, without units", cell.shown()));
  }

  std::string name_;
  int line_ = 1;
  std::size_t columns_ = 0;
  std::vector<CommandRow> rows_;
};

}  // namespace

std::vector<CommandRow> parse_commands(const std::string& text, const std::string& name) {
  std::stringstream stream(without_mark(text));
  std::string line;
  CommandReader reader(name);
  std::getline(stream, line);
  reader.read_header(line);
  while (std::getline(stream, line)) reader.read_row(line);
  return reader.take();
}

std::vector<CommandRow> load_commands(const Settings& file) {
  const std::string path = file.resolve_file(file.text());
  if (!input_exists(path)) {
    if (const std::string why = why_no_file(path); !why.empty()) file.fail(fmt::format("'{}': {}", path, why));
    const std::string near = path_suggestion(path);
    file.fail("'" + path + "' is not there" +
              (near.empty() ? "; a CSV file 'time,forward,strafe,turn' must be" : near));
  }
  std::vector<CommandRow> rows = parse_commands(read_input(path), path);
  for (const CommandRow& row : rows) {
    if (row.policy == rows.front().policy) continue;
    throw InputError(fmt::format(
        "{}:{}:1: goes on under {} after {}; the commands of a gait are for one policy; graze drive --replay takes all",
        path, row.line, row.policy, rows.front().policy));
  }
  return rows;
}

std::string commands_text(const std::vector<CommandRow>& rows) {
  const bool named = !rows.empty() && !rows.front().policy.empty();
  std::string out = named ? "time,forward,strafe,turn,policy\n" : "time,forward,strafe,turn\n";
  for (const CommandRow& row : rows) {
    out += fmt::format("{},{},{},{}", row.time, row.forward, row.strafe, row.turn);
    out += named ? "," + row.policy + "\n" : "\n";
  }
  return out;
}

}  // namespace graze
