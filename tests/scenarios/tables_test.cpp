// Claim: a table is read as it was written, whatever stands between its numbers; and what is no table is refused with
// its file, line and column.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "engine/settings/inputs.h"
#include "scenarios/csv.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

std::vector<std::vector<double>> grid_of(const std::string& text, std::size_t most = 1000) {
  const InputReplay files({{"/t/grid.csv", text}}, "/t");
  return read_grid(Settings::parse("csv: grid.csv", "/t/a.yaml").at("csv"), most);
}

std::vector<double> column_of(const std::string& text, const std::string& keys,
                              Quantity quantity = Quantity::dimensionless) {
  const InputReplay files({{"/t/data.csv", text}}, "/t");
  return read_column(Settings::parse("{file: data.csv, " + keys + "}", "/t/a.yaml"), quantity);
}

std::string refused_grid(const std::string& text, std::size_t most = 1000) {
  return testing::message_of([&] { grid_of(text, most); });
}

std::string refused_column(const std::string& text, const std::string& keys) {
  return testing::message_of([&] { column_of(text, keys); });
}

/// A table whose separators, spaces, comments and line ends are random, with every number in full.
std::string written(const std::vector<std::vector<double>>& rows, const std::string& header, bool named,
                    std::mt19937& random) {
  const std::string separators[] = {",", ";", named ? "," : " ", named ? ";" : "\t"};
  std::string out;
  const auto end_line = [&] {
    out += random() % 2 ? "\r\n" : "\n";
    if (random() % 4 == 0) out += "# a comment, with 1, 2\n";
    if (random() % 4 == 0) out += " \t \n";
  };
  if (random() % 2) out += "# first\n";
  if (named) out += header, end_line();
  for (const std::vector<double>& row : rows) {
    const std::string& separator = separators[random() % 4];
    const bool marked = separator == "," || separator == ";";
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string space(marked ? random() % 3 : 0, ' ');
      out += (i ? separator : "") + space +
             (marked && random() % 4 == 0 ? fmt::format("\"{:.17g}\"", row[i]) : fmt::format("{:.17g}", row[i]));
    }
    end_line();
  }
  if (random() % 2) out.erase(out.find_last_not_of("\r\n \t") + 1);  // the last line may have no end
  return out;
}

TEST(Tables, GridsReadBack) {
  std::mt19937 random(21);
  for (int i = 0; i < 200; ++i) {
    std::vector<std::vector<double>> rows(1 + random() % 5);
    const std::size_t columns = 1 + random() % 6;
    for (auto& row : rows) {
      for (std::size_t n = columns; n > 0; --n) {
        row.push_back(std::ldexp(static_cast<double>(random()) - 2e9, static_cast<int>(random() % 60) - 50));
      }
    }
    const std::string text = written(rows, "", false, random);
    EXPECT_EQ(grid_of(text), rows) << text;
  }
}

TEST(Tables, ColumnsReadBackInTheirUnit) {
  std::mt19937 random(22);
  for (int i = 0; i < 100; ++i) {
    std::vector<std::vector<double>> rows(2 + random() % 5, std::vector<double>(3));
    for (auto& row : rows) {
      for (double& x : row) x = static_cast<double>(random()) / 1e6;
    }
    const std::string text = written(rows, "time, \"mu\" ,gap", true, random);
    for (const auto& [name, index] : {std::pair{"time", 0u}, {"mu", 1u}, {"gap", 2u}}) {
      const std::vector<double> read = column_of(text, fmt::format("column: {}", name));
      ASSERT_EQ(read.size(), rows.size()) << text;
      for (std::size_t k = 0; k < rows.size(); ++k) EXPECT_EQ(read[k], rows[k][index]) << text;
    }
  }
  EXPECT_THAT(column_of("gap\n2.5\n-4\n", "column: gap, unit: mm", Quantity::length), ElementsAre(0.0025, -0.004));
  EXPECT_THAT(column_of("a;gap\n1;180\n", "column: gap, unit: deg", Quantity::angle),
              ElementsAre(::testing::DoubleEq(std::acos(-1.0))));
}

// White space separates the numbers of a grid where nothing else does; beside a comma it is none, and an empty cell is
// a mistake.
TEST(Tables, SpacesSeparateWhereNothingElseDoes) {
  EXPECT_EQ(grid_of("1  2\t3\n"), (std::vector<std::vector<double>>{{1, 2, 3}}));
  EXPECT_EQ(grid_of("1;2\n"), (std::vector<std::vector<double>>{{1, 2}}));
  EXPECT_THAT(refused_grid("1,,2\n"), EndsWith("/t/grid.csv:1: '': must be a number"));
  EXPECT_THAT(refused_grid("1, 2 3\n"), EndsWith("/t/grid.csv:1: '2 3': must be a number"));
  EXPECT_EQ(column_of("a b\n1\n", "column: a b"), std::vector<double>{1}) << "a name may have a space in it";
}

TEST(Tables, AreRefusedAtTheirLines) {
  EXPECT_THAT(refused_grid("# one\n\n0 0\n0 x\n"), EndsWith("/t/grid.csv:4: 'x': must be a number"));
  EXPECT_THAT(refused_grid("0 1e999\n"), EndsWith("/t/grid.csv:1: '1e999': must be a number"));
  EXPECT_THAT(refused_grid("0 nan\n"), EndsWith("/t/grid.csv:1: 'nan': must be a number"));
  EXPECT_THAT(refused_grid("0, 2 mm\n"), EndsWith("'2 mm': must be a number")) << "units do not stand in tables";
  EXPECT_EQ(refused_grid("# nothing\n \n"), "/t/a.yaml:1:6: csv: /t/grid.csv: holds no lines");
  EXPECT_EQ(refused_grid("1 2\n\n3\n"), "/t/grid.csv:3: 1 numbers, the first row has 2; all must have as many");
  EXPECT_THAT(refused_grid("1,5;2,5\n1,5;2,5\n"), HasSubstr("/t/grid.csv:1: has ',' and ';'"));
  EXPECT_EQ(refused_grid("1 2\n3 4\n", 4), "(accepted)");
  EXPECT_EQ(refused_grid("1 2\n3 4\n", 3), "/t/grid.csv:2: more than 3 numbers; use a coarser grid");
  EXPECT_EQ(refused_column("a,b\n1,2\n3\n", "column: b"), "/t/data.csv:3: too few columns; b is number 2");
  EXPECT_EQ(refused_column("a,b\n1,2\n3\n", "column: a"), "(accepted)") << "what is missing is not asked for";
  EXPECT_EQ(refused_column("a,b\n1,x\n", "column: b"), "/t/data.csv:2: column b: 'x': must be a number");
  EXPECT_EQ(refused_column("", "column: b"), "/t/a.yaml:1:8: file: /t/data.csv: holds no lines");
  EXPECT_EQ(refused_column("speed,gap\n1,2\n", "column: spede"),
            "/t/a.yaml:1:26: column: spede: /t/data.csv has no such column; did you mean 'speed'?");
  EXPECT_THAT(refused_column("speed,gap\n1,2\n", "column: wind"), EndsWith("/t/data.csv has no such column"));
  EXPECT_THAT(refused_column("a\n1\n", "column: a, unit: mm"), HasSubstr("unit: mm: does not fit; one of: %"));
  EXPECT_THAT(refused_grid(std::string("1 2\n3 \0", 7)), HasSubstr("/t/grid.csv:2:3: a NUL byte"));
  EXPECT_THAT(refused_grid("1 " + std::string(100, 'y') + "\n"), HasSubstr(std::string(37, 'y') + "…': must be"));
}

}  // namespace
}  // namespace graze
