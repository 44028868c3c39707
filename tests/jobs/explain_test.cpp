// graze explain through the command line: what it prints, writes and refuses. What the numbers are worth:
// tests/analysis/causes_test.cpp and its neighbours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/jobs/replay_campaign.h"
#include "tests/jobs/striking_balls.h"

namespace graze {
namespace {

using PlainJson = nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Characters, not bytes.
std::size_t width(const std::string& line) {
  return static_cast<std::size_t>(std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

const PlainJson& cause(const PlainJson& policy, const std::string& target) {
  for (const PlainJson& one : policy["causes"]) {
    if (one["target"].get<std::string>().starts_with(target)) return one;
  }
  throw std::runtime_error("no target " + target);
}

// Claim: text, JSON and tables name the parameter that decides the way at the bifurcation and the unmet objective, and
// the one that decides the violation; the text fits 80 columns; the same archive gives the same bytes.
TEST(ExplainOfTheProgram, NamesTheCauses) {
  const testing::StrikingBalls balls;
  const testing::Result text = balls.graze("explain a.graze");
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_EQ(text.err, "");
  EXPECT_THAT(text.out, AllOf(HasSubstr("Striking balls\n60 particles, 3 scalars each"), HasSubstr("initial.base.x"),
                              HasSubstr("bifurcation at 0."), HasSubstr("The same particles under two policies"),
                              HasSubstr("All policies together")));
  std::istringstream lines(text.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(width(line), 80u) << line;
  EXPECT_EQ(balls.graze("explain a.graze").out, text.out);

  const PlainJson data = PlainJson::parse(balls.graze("explain a.graze --json --policy still").out);
  ASSERT_EQ(data["policies"].size(), 1u);
  const PlainJson& still = data["policies"][0];
  EXPECT_EQ(cause(still, "failure: objective unmet")["effects"][0]["parameter"], "initial.base.x");
  EXPECT_EQ(cause(still, "failure: centred")["effects"][0]["parameter"], "initial.base.y");
  EXPECT_EQ(cause(still, "bifurcation")["effects"][0]["parameter"], "initial.base.x");
  EXPECT_GE(still["bifurcation_causes"].get<int>(), 1);
  const PlainJson events = PlainJson::parse(balls.graze("events a.graze --json --policy still").out);
  PlainJson same = events["policies"][0]["bifurcations"][0]["causes"][0];
  same.erase("branch");
  EXPECT_EQ(same, cause(still, "bifurcation")) << "both verbs say the same";
}

// Claim: --csv writes a file for each table, with the numbers of --json, and replaces none without --force.
TEST(ExplainOfTheProgram, WritesTables) {
  const testing::StrikingBalls balls;
  const testing::Result run = balls.graze("explain a.graze --json --csv new/why");
  ASSERT_EQ(run.code, 0) << run.err;
  for (const char* name : {"causes", "rules", "spread", "modes", "survival", "margins", "rates"}) {
    EXPECT_TRUE(testing::fs::exists(balls.folder / ("new/why/" + std::string(name) + ".csv"))) << name;
  }
  const auto rates = testing::read_csv(balls.folder / "new/why/rates.csv");
  ASSERT_EQ(rates.size(), 4u);
  const PlainJson data = PlainJson::parse(run.out);
  const PlainJson& rate = data["policies"][0]["rate"];
  EXPECT_EQ(rates[1][0], "still");
  EXPECT_EQ(std::stod(rates[1][4]), rate["rate"].get<double>());
  EXPECT_EQ(std::stod(rates[1][5]), rate["interval"][0].get<double>());
  std::size_t effects = 0, rows = testing::read_csv(balls.folder / "new/why/causes.csv").size() - 1;
  for (const PlainJson& policy : data["policies"]) {
    for (const PlainJson& one : policy["causes"]) effects += one["effects"].size();
  }
  EXPECT_EQ(rows, effects);
  testing::write_file(balls.folder / "new/why/rates.csv", "mine");
  const testing::Result again = balls.graze("explain a.graze --csv new/why");
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, AllOf(HasSubstr("is there already"), HasSubstr("--force")));
  EXPECT_EQ(testing::read_file(balls.folder / "new/why/rates.csv"), "mine");
  EXPECT_THAT(
      balls.graze("explain a.graze --csv a.graze/why").err,
      ::testing::AllOf(::testing::HasSubstr("lies within a.graze"), ::testing::Not(::testing::HasSubstr("--output"))));
  EXPECT_EQ(balls.graze("explain a.graze --csv new/why --force").code, 0);
  EXPECT_NE(testing::read_file(balls.folder / "new/why/rates.csv"), "mine");
}

TEST(ExplainOfTheProgram, RefusesWhatCannotBeMeant) {
  const testing::StrikingBalls balls("-n 4");
  const auto refused = [&](const std::string& arguments, const std::string& part) {
    const testing::Result run = balls.graze("explain " + arguments);
    EXPECT_EQ(run.code, 2) << arguments;
    EXPECT_EQ(run.out, "") << arguments;
    EXPECT_THAT(run.err, HasSubstr(part)) << arguments;
  };
  refused("", "archive");
  refused("nowhere.graze", "nowhere.graze");
  refused("a.graze --policy stil", "nearest: still");
  refused("a.graze --force", "--force: is for --csv FOLDER");
  refused("a.graze --csv why.csv", "--csv why.csv: names a file; it takes a folder");
  refused("a.graze --jsn", "--jsn");
  EXPECT_FALSE(testing::fs::exists(balls.folder / "why.csv"));
}

// Claim: a campaign that is not complete is explained as far as it goes, says so, and ends with 3.
TEST(ExplainOfTheProgram, SaysWhatIsIncomplete) {
  const testing::TemporaryFolder folder;
  testing::write_striking_balls(folder);
  testing::write_part(folder / "a.graze", load_scenario((folder / "ball.yaml").string()), 24, 40);
  const testing::Result run = testing::graze(folder.path(), "explain a.graze");
  EXPECT_EQ(run.code, 3) << run.err;
  EXPECT_THAT(run.out, HasSubstr("Striking balls (INCOMPLETE"));
  EXPECT_EQ(PlainJson::parse(testing::graze(folder.path(), "explain a.graze --json").out)["complete"], false);
}

}  // namespace
}  // namespace graze
