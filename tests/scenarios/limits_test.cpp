// Claim: a scenario that asks for too much of anything is refused at its place, with the number and the bound, before
// memory or time is spent on it.
#include "scenarios/limits.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "engine/model/fabrication.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

/// "item0: VALUE, item1: VALUE, …"
std::string entries(std::size_t count, const std::string& value) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += fmt::format("{}item{}: {}", i ? ", " : "", i, value);
  return out;
}

std::string items(std::size_t count, const std::string& value, const std::string& between = ", ") {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += (i ? between : "") + value;
  return out;
}

/// The message about hopper's scenario with `value` in place of its `key`, without the file's name.
std::string refused(const std::string& key, const std::string& value) {
  const Settings base = Settings::parse(testing::hopper(""), "base.yaml");
  const Settings scenario =
      base.with(key, Settings::parse("value: " + value, testing::kFolder + "test.yaml").at("value"));
  return testing::message_of([&] { testing::read(scenario.resolved_text()); });
}

TEST(Limits, CountsOfEverything) {
  EXPECT_THAT(refused("environment", "{" + entries(2'001, "{sphere: 1}") + "}"),
              EndsWith("environment: 2001 objects; at most 2000"));
  EXPECT_THAT(refused("environment", "{" + entries(2'000, "{sphere: 1}") + "}"),
              EndsWith("robot: 2003 collision shapes of the robot and the environment; at most 2000"));
  EXPECT_THAT(refused("robot", "{urdf: robots/hopper.urdf, package_path: [" + items(101, "a") + "]}"),
              EndsWith("robot.package_path: 101 folders; at most 100"));
  EXPECT_THAT(refused("robot", "{urdf: robots/hopper.urdf, initial: {joints: {" + entries(2'001, "1") + "}}}"),
              EndsWith("robot.initial.joints: 2001 entries; at most 2000"));
  EXPECT_THAT(refused("contact", "{ignore: [" + items(1'001, "[a, b]") + "]}"),
              EndsWith("contact.ignore: 1001 pairs; at most 1000"));
  EXPECT_THAT(refused("contact", "{pairs: [" + items(1'001, "{between: [a, b]}") + "]}"),
              EndsWith("contact.pairs: 1001 pairs; at most 1000"));
  EXPECT_THAT(refused("task", "{requirements: {" + entries(1'001, "{tilt: {link: base, below: 1}}") + "}}"),
              EndsWith("task.requirements: 1001 requirements; at most 1000"));
  EXPECT_THAT(refused("task", "{objective: {all: [" + items(1'001, "{tilt: {link: base, below: 1}}") + "]}}"),
              EndsWith("task.objective: 1001 predicates; at most 1000"));
}

TEST(Limits, Policies) {
  const std::string policy = "hold: {}, control: {joint_pd: {kp: 1}}";
  const auto over = [&](const std::string& more) {
    return refused("policies", "{p: {" + policy + ", over: {" + more + "}}}");
  };
  EXPECT_THAT(over("a: [" + items(30, "1") + "], b: [" + items(40, "1") + "]"),
              EndsWith("policies.p.over.b: more than 1000 policies"));
  EXPECT_THAT(over(entries(21, "[1]")), EndsWith("policies.p.over: 21 paths; at most 20"));
  EXPECT_THAT(over("control.joint_pd.kp: [" + std::string(1'000, '1') + "]"),
              EndsWith("a policy's name of 1002 bytes; at most 200"));
  EXPECT_THAT(refused("policies", "{" + std::string(201, 'p') + ": {" + policy + "}}"),
              EndsWith("a policy's name of 201 bytes; at most 200"));
}

TEST(Limits, Measures) {
  EXPECT_THAT(refused("task", "{measures: {" + entries(65, "{tilt: {link: base, below: 1}}") + "}}"),
              EndsWith("task.measures: 65 measures; at most 64"));
}

TEST(Limits, Globs) {
  const std::string braces = "\"*{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}\"";
  const std::string rule = "a glob whose braces stand for more than 1000 patterns; use several, or *";
  EXPECT_THAT(refused("contact", "{ignore: [[" + braces + ", ground]]}"), EndsWith(rule));
  EXPECT_THAT(refused("uncertain", "{" + braces + ": 1}"), EndsWith(rule));
  EXPECT_THAT(refused("task", "{requirements: {a: {no_contact: [" + braces + ", ground]}}}"), EndsWith(rule));
  EXPECT_THAT(refused("task", "{requirements: {a: {tilt: {link: " + braces + ", below: 1}}}}"), EndsWith(rule));
  const std::size_t parameters = ParameterTable(*testing::read(testing::hopper("")).world).all().size();
  std::string many;
  for (std::size_t i = 0; i < kMaxComparisons / 700 / parameters + 2; ++i) {
    many += fmt::format("{}\"{{contact.friction{}}}\": 1", i ? ", " : "", std::string(700 + i % 270, ','));
    if (i % 270 == 269) break;
  }
  EXPECT_THAT(refused("uncertain", "{" + many + "}"),
              HasSubstr("the globs so far take more than 10000000 comparisons"));
}

TEST(Limits, NumbersOfDistributions) {
  const std::size_t matched = ParameterTable(*testing::read(testing::hopper("")).world).match("sensor.*").size();
  const std::size_t each = kMaxKeptNumbers / matched + 1;
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("graze_limits_" + std::to_string(::getpid()) + ".csv");
  std::ofstream(file) << "x\n" << items(each, "1", "\n");
  EXPECT_THAT(refused("uncertain", "{sensor.*: {empirical: {file: " + file.string() + ", column: x}}}"),
              EndsWith(fmt::format("{} numbers for each of {} parameters: with them, distributions keep {} numbers; at "
                                   "most 10000000",
                                   each, matched, each * matched)));
  std::filesystem::remove(file);
  EXPECT_THAT(refused("uncertain", "{sensor.gps.*: {normal: {std: 1}}, correlated: [{parameters: [" +
                                       items(501, "sensor.gps.x") + "], correlation: 0}]}"),
              EndsWith("more than 500 parameters in one group; at most 500"));
}

// Frames are held in memory while a trace runs: too many of them name the coarser grid that would fit.
TEST(Limits, FramesOfATrace) {
  const std::string start = testing::hopper("record: {telemetry: all, every: ");
  const std::string long_run = start.substr(0, start.find("time:")) + "time: {end: 100000 s, step: 1 ms}\n" +
                               start.substr(start.find("policies:"));
  const std::string message = testing::message_of([&] { testing::read(long_run + "2}\n"); });
  EXPECT_THAT(message, HasSubstr("record.every: 5e+07 frames of "));
  const std::size_t at = message.find("'every: ");
  ASSERT_NE(at, std::string::npos) << message;
  const int every = std::stoi(message.substr(at + 8));
  EXPECT_EQ(testing::message_of([&] { testing::read(long_run + fmt::format("{}}}\n", every)); }), "(accepted)");
  EXPECT_NE(testing::message_of([&] { testing::read(long_run + fmt::format("{}}}\n", every - 1)); }), "(accepted)");
}

TEST(Limits, CsvFiles) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("graze_limits_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string file = (folder / "t.csv").string();
  const auto write = [&](const std::string& text) { std::ofstream(file) << text; };
  const std::string field = "{f: {heightfield: {size: [1, 1], csv: " + file + "}}}";
  std::string row;
  for (int i = 0; i < 2'000; ++i) row += "0 ";
  std::string grid = "# heights\n";
  for (int i = 0; i < 2'001; ++i) grid += row + "\n";
  write(grid);
  EXPECT_THAT(refused("environment", field), EndsWith(file + ":2002: more than 4000000 numbers; use a coarser grid"));
  write("a" + std::string(10'000, ',') + "\n");
  EXPECT_THAT(refused("uncertain", "{contact.friction: {empirical: {file: " + file + ", column: a}}}"),
              EndsWith(file + ":1: more than 10000 columns"));
  write(std::string(1 << 20, 'x') + " 1\n1 1\n");
  EXPECT_LT(refused("environment", field).size(), 500u) << "a megabyte is not repeated";
  write("0 0\n0 0\n0 -1e9\n");
  EXPECT_THAT(refused("environment", field),
              EndsWith("csv: height [2][1]: -1e+09 m: at most 1e+06 m; beyond it rounding makes gaps wrong"));
  std::filesystem::resize_file(file, kMaxCsvBytes + 1);
  EXPECT_THAT(refused("environment", field), EndsWith(file + ": 67108865 bytes; at most 64 MiB are read"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace graze
