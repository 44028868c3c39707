// Claim: odd words on the command line and in a scenario are answered with what is wrong with them, not with what they
// happen to look like to a parser.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

class OddWords : public ::testing::Test, public testing::BallCampaign {
 protected:
  std::string refused(const std::string& arguments) const {
    const testing::Result run = graze(arguments);
    EXPECT_EQ(run.code, 2) << arguments;
    EXPECT_EQ(run.out, "") << arguments;
    return run.err;
  }
  /// Of the scenario with a text in it replaced.
  std::string refused_with(const std::string& what, const std::string& by) const {
    std::string scenario = testing::ball_scenario();
    EXPECT_NE(scenario.find(what), std::string::npos);
    scenario.replace(scenario.find(what), what.size(), by);
    testing::write_file(folder / "odd.yaml", scenario);
    return refused("check odd.yaml");
  }
};

TEST_F(OddWords, PathsOfSettingsHaveNoEmptyParts) {
  for (const char* word : {"environment.='{plane: z}'", ".=1", "time.=1", ".time=1", "time..end=1", "x.=1"}) {
    EXPECT_THAT(refused(std::string("check ball.yaml --set ") + word), HasSubstr("a part of the path is empty"))
        << word;
  }
  EXPECT_THAT(refused("check ball.yaml --set name.x=1"), HasSubstr("'x' leads into a value that is not a map"));
}

TEST_F(OddWords, KeysEnd) {
  const std::string key(1025, 'k');
  EXPECT_THAT(refused_with("time:", key + ": 1\ntime:"),
              HasSubstr("a key has at most 1024 characters, and this one 1025"));
  EXPECT_THAT(refused_with("time:", key.substr(1) + ": 1\ntime:"), Not(HasSubstr("1024 characters")));
  EXPECT_THAT(refused_with("time:", "x: a: b\ntime:"), HasSubstr("needs quotes"));
}

TEST_F(OddWords, PhasesAreFlagsOrMaps) {
  for (const char* value : {"~", "[1, 2]"}) {
    EXPECT_THAT(refused_with("time:", std::string("record: {phases: ") + value + "}\ntime:"),
                HasSubstr("must be true, false, or a map of gap, dwell, impulse"));
  }
}

TEST_F(OddWords, OutputsThatNobodyGaveAreNotBlamed) {
  EXPECT_THAT(refused("report /"), AllOf(HasSubstr("graze: /: has no name"), Not(HasSubstr(".html"))));
  EXPECT_THAT(refused("report / --json"), HasSubstr("/: is no campaign directory"));
  fs::create_directory(folder / "why");
  fs::create_symlink("nowhere", folder / "why/causes.csv");
  EXPECT_THAT(refused("explain a.graze --csv why"),
              AllOf(HasSubstr("--csv why: why/causes.csv is there already"), Not(HasSubstr("--output"))));
  fs::remove(folder / "why/causes.csv");
  fs::create_directory(folder / "why/causes.csv");
  EXPECT_THAT(refused("explain a.graze --csv why --force"),
              AllOf(HasSubstr("why/causes.csv is a directory"), Not(HasSubstr("--output"))));
}

TEST_F(OddWords, AreNotTakenForSomethingNearNorEchoedWhole) {
  for (const char* word : {"/", "=", "_", "'?'", "%"}) {
    EXPECT_THAT(refused(std::string("help ") + word),
                AllOf(HasSubstr("no topic of help"), Not(HasSubstr("did you mean"))))
        << word;
  }
  EXPECT_THAT(refused("help cylindr"), HasSubstr("did you mean 'cylinder'?"));
  const std::string longest(100'000, 'w');
  for (const std::string& words :
       {"help " + longest, longest, "score --" + longest, "--" + longest, "score a.graze b.graze " + longest}) {
    EXPECT_LT(refused(words).size(), 1000u) << words.substr(0, 10);
  }
}

}  // namespace
}  // namespace graze
