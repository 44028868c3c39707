// graze score: which policies it shows, and gates.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Forty balls under three policies that do the same; about three quarters end low.
class ScoreOptions : public ::testing::Test {
 protected:
  testing::BallCampaign campaign;

  void SetUp() override {
    const std::string policy = "{hold: {}, control: {torque: {}}}";
    const testing::Result run = campaign.graze("run ball.yaml -n 40 --quiet -o a.graze --set policies.step-1='" +
                                               policy + "' --set policies.step-2='" + policy + "'");
    ASSERT_EQ(run.code, 0) << run.err;
  }
  testing::Result score(const std::string& options) const { return campaign.graze("score a.graze " + options); }
  void refused(const std::string& options, const std::vector<std::string>& parts) const {
    const testing::Result run = score(options);
    EXPECT_EQ(run.code, 2) << options << run.err;
    EXPECT_EQ(run.out, "") << options;
    for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part)) << options;
  }
};

// Claim: --policy chooses what is shown everywhere: table, pairs, failures, JSON.
TEST_F(ScoreOptions, PolicyChoosesWhatIsShown) {
  const std::string text = score("--policy 'step*'").out;
  EXPECT_THAT(text, AllOf(HasSubstr("step-1"), HasSubstr("step-2"), Not(HasSubstr("still"))));
  EXPECT_THAT(text, HasSubstr("graze score a.graze --policy step-1 --policy step-2 --failures"));
  EXPECT_THAT(score("--policy still").out, AllOf(HasSubstr("still"), Not(HasSubstr("step-"))));
  EXPECT_THAT(score("--policy still --failures").out, AllOf(HasSubstr("still"), Not(HasSubstr("step-"))));
  const auto json = nlohmann::json::parse(score("--policy still --policy step-2 --json").out);
  ASSERT_EQ(json["policies"].size(), 2u);
  EXPECT_EQ(json["pairs"].size(), 1u);
  const auto all = nlohmann::json::parse(score("--policy step-1 --json --failures").out);
  ASSERT_GT(all["failures"].size(), 0u);
  EXPECT_EQ(all["failures"].size(), all["failed"]);
  for (const auto& failure : all["failures"]) EXPECT_EQ(failure["policy"], "step-1");
}

// Claim: a pattern that chooses nothing is refused by every verb that has one, before anything is printed, with the
// nearest name, or with all of them if none is near.
TEST_F(ScoreOptions, UnknownPoliciesAreRefused) {
  refused("--policy stil", {"--policy stil: no policy of that name in a.graze; nearest: still"});
  refused("--policy 'x*'", {"there are: still, step-1, step-2"});
  refused("--policy still --require 'step-1: p > 0.1'", {"--require", "'step-1'", "there are: still"});
  refused("--require 'stil: p > 0.1'", {"--require 'stil: p > 0.1'", "nearest: still"});
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o b.graze").code, 0);
  refused("b.graze --json --policy step-1", {"no policy of that name in b.graze"});
  refused("nowhere.graze --json", {"nowhere.graze: is not there"});
  EXPECT_EQ(nlohmann::json::parse(score("b.graze --json --policy still").out).size(), 2u);
  for (const std::string verb : {"run ball.yaml", "submit ball.yaml --time 9 --dry-run"}) {
    const testing::Result none = campaign.graze(verb + " --policy nope");
    EXPECT_EQ(none.code, 2);
    EXPECT_THAT(none.err, HasSubstr("--policy nope: no policy of that name in ball.yaml; there are: still")) << verb;
  }
}

// Claim: gates have the grammar of --until, and the exit code of their answer.
TEST_F(ScoreOptions, GatesAreQuestions) {
  const auto low = nlohmann::json::parse(score("--policy still --json").out)["policies"][0]["interval"][0];
  ASSERT_GT(low, 0.2);
  for (const char* met :
       {"p>=0.1", "p >= 10%", "p > 0.1", "p < 0.999", "p<=99.9 %", "still: p >= 0.1", "s*:p>0.1", "ci < 0.9"}) {
    const testing::Result run = score(std::string("--require '") + met + "'");
    EXPECT_EQ(run.code, 0) << met << run.err;
    EXPECT_THAT(run.out, HasSubstr(": met (95 % interval")) << met;
  }
  EXPECT_EQ(score("--require 'p < 0.1'").code, 1);
  EXPECT_EQ(score("--require 'p >= 0.999'").code, 1);
  EXPECT_EQ(score("--require 'ci < 0.001'").code, 4);
  EXPECT_EQ(score("--require 'p >= 0.1' --require 'step-1: p < 0.1'").code, 1);
  EXPECT_THAT(score("--policy still --require 'p < 0.1'").out,
              AllOf(HasSubstr("p < 0.1: still: MISSED"), Not(HasSubstr("step-1"))));
  refused("--require 'q > 1'", {"--require 'q > 1':1: ", "nearest right answer: 'p >= 0.95'"});
  refused("--require 'p => 0.9'", {"--require 'p => 0.9':3: ", "nearest right answer: 'p >= 0.9'"});
  refused("--require 'p >= 90'", {"nearest right answer: 'p >= 90%'"});
}

/// Names of the failed and broken test cases of a file.
std::vector<std::string> failed_cases(const std::filesystem::path& file) {
  tinyxml2::XMLDocument document;
  EXPECT_EQ(document.LoadFile(file.c_str()), tinyxml2::XML_SUCCESS) << testing::read_file(file);
  std::vector<std::string> out;
  if (document.RootElement() == nullptr) return out;
  for (auto* suite = document.RootElement()->FirstChildElement(); suite; suite = suite->NextSiblingElement()) {
    for (auto* one = suite->FirstChildElement(); one; one = one->NextSiblingElement()) {
      if (one->FirstChildElement("failure") || one->FirstChildElement("error")) {
        out.push_back(std::string(one->Attribute("classname")) + ": " + one->Attribute("name"));
      }
    }
  }
  return out;
}

// Claim: --junit has a failed case exactly where the exit code has a reason, names what the policy failed by, and tells
// intervals; it replaces its own kind of file and no other.
TEST_F(ScoreOptions, JUnitFailsAsTheExitCodeDoes) {
  const std::filesystem::path file = campaign.folder / "out/score.xml";
  EXPECT_EQ(score("--junit out/score.xml").code, 0);
  EXPECT_TRUE(failed_cases(file).empty());
  EXPECT_THAT(testing::read_file(file), AllOf(HasSubstr("classname=\"Ball.step-2\" name=\"requirement high\""),
                                              HasSubstr("95 % interval"), HasSubstr("name=\"success rate\"")));
  EXPECT_EQ(score("--junit out/score.xml --require 'step-1: p >= 0.999' --policy 'step*'").code, 1);
  const std::vector<std::string> failed = failed_cases(file);
  ASSERT_FALSE(failed.empty());
  EXPECT_EQ(failed.front(), "Ball.step-1: step-1: p >= 0.999");
  EXPECT_GT(failed.size(), 1u) << "by what it failed";
  EXPECT_THAT(failed, ::testing::Each(HasSubstr("Ball.step-1: ")));
  EXPECT_THAT(testing::read_file(file), HasSubstr("graze replay a.graze --particle"));
  EXPECT_EQ(score("--junit out/score.xml --require 'still: p < 0.01'").code, 1);
  EXPECT_EQ(failed_cases(file), std::vector<std::string>{"Ball.still: still: p < 0.01"})
      << "too good: nobody is to blame";
  EXPECT_EQ(score("--junit out/score.xml --require 'still: ci < 0.001'").code, 4);
  EXPECT_THAT(testing::read_file(file), HasSubstr("type=\"inconclusive\""));
  EXPECT_EQ(score("--json --junit out/score.xml").code, 0);
}

TEST_F(ScoreOptions, JUnitReplacesNoOtherFile) {
  testing::write_file(campaign.folder / "robot.xml", "<?xml version=\"1.0\"?><robot/>");
  refused("--junit robot.xml", {"robot.xml: exists already and is not of --junit; choose another name\n"});
  refused("--junit score.txt", {"score.txt", ".xml"});
  refused("--junit a.graze/x.xml", {"a.graze"});
  EXPECT_EQ(testing::read_file(campaign.folder / "robot.xml"), "<?xml version=\"1.0\"?><robot/>");
}

// Claim: of several archives each has a suite, whose cases have names of their own.
TEST_F(ScoreOptions, JUnitOfSeveralArchives) {
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o b.graze").code, 0);
  ASSERT_EQ(score("b.graze --junit two.xml --require 'still: p >= 0.999'").code, 1);
  const std::vector<std::string> failed = failed_cases(campaign.folder / "two.xml");
  EXPECT_THAT(failed, ::testing::Contains("Ball (a.graze).still: still: p >= 0.999"));
  EXPECT_THAT(failed, ::testing::Contains("Ball (b.graze).still: still: p >= 0.999"));
}

}  // namespace
}  // namespace graze
