// Claim: what a verb writes is never lost silently, and never takes the place of what it reads or of what was there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::BallCampaign;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Outputs, AFullStandardOutputIsAMachineFailure) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  for (const std::string verb :
       {"score a.graze", "score a.graze --json", "score a.graze --failures", "status a.graze", "check ball.yaml",
        "replay a.graze --particle 1", "sample ball.yaml -n 3", "pack a.graze --force", "resume a.graze --quiet"}) {
    for (const char* to : {" >/dev/full", " >&-"}) {
      const testing::Result result = campaign.graze(verb + to);
      EXPECT_EQ(result.code, 3) << verb << to;
      EXPECT_THAT(result.err, AllOf(HasSubstr("standard output"), HasSubstr("cannot be written"))) << verb << to;
    }
  }
}

TEST(Outputs, NothingIsWrittenOverItsSource) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  ASSERT_EQ(campaign.graze("pack a.graze").code, 0);
  const std::string scenario = testing::read_file(campaign.folder / "ball.yaml");
  for (const std::string verb :
       {"replay a.h5 --particle 1 -o a.h5 --force", "replay a.graze --particle 1 -o a.graze/campaign.h5 --force",
        "pack a.graze -o a.graze/campaign.h5 --force", "sample ball.yaml -n 3 -o ball.yaml --force"}) {
    const testing::Result result = campaign.graze(verb);
    EXPECT_EQ(result.code, 2) << verb;
    EXPECT_THAT(result.err, HasSubstr("which is only read")) << verb;
  }
  EXPECT_EQ(testing::read_file(campaign.folder / "ball.yaml"), scenario);
  EXPECT_EQ(campaign.graze("score a.h5").code, 0);
  EXPECT_EQ(campaign.graze("score a.graze").code, 0);
}

TEST(Outputs, AFolderIsNoFileToPackInto) {
  const BallCampaign campaign;
  std::filesystem::create_directory(campaign.folder / "d.h5");
  const testing::Result refused = campaign.graze("run ball.yaml -n 20 --force -o d.h5");
  EXPECT_EQ(refused.code, 2) << "before anything is simulated";
  EXPECT_THAT(refused.err, HasSubstr("d.h5: is a directory"));
  EXPECT_FALSE(std::filesystem::exists(campaign.folder / "d.graze"));
}

TEST(Outputs, SamplesAreReplacedOnlyByForce) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("sample ball.yaml -n 3 -o s.csv").code, 0);
  const testing::Result again = campaign.graze("sample ball.yaml -n 4 -o s.csv");
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, AllOf(HasSubstr("s.csv"), HasSubstr("--force")));
  EXPECT_EQ(campaign.graze("sample ball.yaml -n 4 -o s.csv --force").code, 0);
}

// Claim: one part alone is no whole campaign, whoever looks at it, and packing what is not whole is told.
TEST(Outputs, APartIsNotTheWhole) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --part 1/2 --quiet -o one.graze").code, 0);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --part 2/2 --quiet -o two.graze").code, 0);
  EXPECT_THAT(campaign.graze("score one.graze").out, HasSubstr("ONE PART: particles 0 to 9 of 20"));
  EXPECT_THAT(campaign.graze("status two.graze").out, HasSubstr("one part: particles 10 to 19 of 20"));
  const testing::Result alone = campaign.graze("pack one.graze -o p.h5");
  EXPECT_EQ(alone.code, 0);
  EXPECT_THAT(alone.err, HasSubstr("holds 10 of 20 traces"));
  EXPECT_THAT(campaign.graze("score p.h5").out, HasSubstr("INCOMPLETE"));
  EXPECT_THAT(campaign.graze("status p.h5").out, AllOf(HasSubstr("this file cannot"), Not(HasSubstr("graze resume"))));
  EXPECT_THAT(campaign.graze("resume p.h5").err, HasSubstr("packed files cannot go on"));
  const testing::Result both = campaign.graze("pack one.graze two.graze -o p.h5 --force");
  EXPECT_EQ(both.err, "");
  EXPECT_THAT(campaign.graze("status p.h5").out, HasSubstr("complete\n"));
}

}  // namespace
}  // namespace graze
