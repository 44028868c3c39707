// Claim: a campaign survives being killed at any instant. What was finished stays, `resume` does the rest, and the
// result has the bits of a campaign that nobody disturbed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "archive/archive.h"
#include "archive/files/lock.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::BallCampaign;
using testing::digests;
using ::testing::HasSubstr;

/// 2000 short traces.
struct Campaign : BallCampaign {
  std::string run = "run ball.yaml -n 2000 --threads 2 --quiet -o ";

  /// Starts a verb and kills it after so many seconds.
  void kill_after(double seconds, const std::string& arguments) const {
    testing::shell(folder.path(),
                   std::string("timeout -s KILL ") + std::to_string(seconds) + " '" + GRAZE_PROGRAM + "' " + arguments);
  }
};

/// Kills `rounds` campaigns, each several times, and compares what comes out with an undisturbed one.
void kill_campaigns(int rounds) {
  const Campaign campaign;
  ASSERT_EQ(campaign.graze(campaign.run + "whole.graze").code, 0);
  const auto wanted = digests(campaign.folder / "whole.graze");
  ASSERT_EQ(campaign.graze("pack whole.graze -o whole.h5").code, 0);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> instant(0.01, 0.4);
  for (int round = 0; round < rounds; ++round) {
    const std::string name = "killed" + std::to_string(round) + ".graze";
    campaign.kill_after(instant(random), campaign.run + name);
    for (int again = 0; again < 2; ++again) {
      if (!std::filesystem::exists(campaign.folder / name / "campaign.h5")) break;  // killed before it had begun
      const auto before = digests(campaign.folder / name);
      campaign.kill_after(instant(random), "resume --quiet " + name);
      for (const auto& [policy, traces] : digests(campaign.folder / name)) {
        for (const auto& [particle, digest] : before.count(policy) ? before.at(policy) : decltype(traces){}) {
          ASSERT_TRUE(traces.count(particle)) << "a finished trace was lost";
        }
      }
    }
    if (!std::filesystem::exists(campaign.folder / name / "campaign.h5")) continue;
    const testing::Result end = campaign.graze("resume --quiet " + name);
    ASSERT_EQ(end.code, 0) << end.err;
    EXPECT_EQ(digests(campaign.folder / name), wanted) << "round " << round;
    EXPECT_TRUE(Archive(campaign.folder / name).complete());
  }
}

TEST(Resume, SurvivesKillsAtRandomInstants) { kill_campaigns(5); }
TEST(Resume, SurvivesManyKillsAtRandomInstants) {
  if (!std::getenv("GRAZE_LONG")) GTEST_SKIP() << "tests/run --long runs it";
  kill_campaigns(50);
}

TEST(Resume, StoppedBySignalSaysHowToGoOn) {
  const Campaign campaign;
  testing::Process process(campaign.folder.path(),
                           "run ball.yaml -n 100000000 --threads 1 --quiet --ignore-space -o a.graze");
  process.wait_until([&] { return std::filesystem::exists(campaign.folder / "a.graze/shards/000001.h5"); });
  process.send(SIGTERM);
  const testing::Result stopped = process.wait();
  EXPECT_EQ(stopped.out, "") << "a table would take as long as reading all shards";
  EXPECT_THAT(stopped.err, HasSubstr("graze resume a.graze"));
  EXPECT_THAT(campaign.graze("status a.graze").out, AllOf(HasSubstr("stopped"), HasSubstr("graze resume a.graze")));
}

TEST(Resume, MakesACampaignLarger) {
  const Campaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 50 --quiet -o small.graze").code, 0);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 75 --quiet -o large.graze").code, 0);
  ASSERT_EQ(campaign.graze("resume small.graze -n 75 --quiet").code, 0);
  EXPECT_EQ(digests(campaign.folder / "small.graze"), digests(campaign.folder / "large.graze"));
  const testing::Result fewer = campaign.graze("resume small.graze -n 10");
  EXPECT_EQ(fewer.code, 2);
  EXPECT_THAT(fewer.err, HasSubstr("-n 10: the campaign has 75 particles; it can only grow"));
}

TEST(Resume, NeedsNoFilesOfTheScenario) {
  const Campaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  std::filesystem::remove(campaign.folder / "ball.yaml");
  std::filesystem::remove(campaign.folder / "ball.urdf");
  EXPECT_EQ(campaign.graze("resume a.graze -n 30 --quiet").code, 0);
  EXPECT_EQ(digests(campaign.folder / "a.graze").at("still").size(), 30u);
}

TEST(Resume, RefusesALargerLatinHypercube) {
  const Campaign campaign;
  testing::write_ball(campaign.folder, "sampling: {design: latin_hypercube}\n");
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const testing::Result refused = campaign.graze("resume a.graze -n 30");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("Latin hypercube"));
}

TEST(Resume, PutsDamagedShardsAside) {
  const Campaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 40 --quiet -o a.graze").code, 0);
  const auto wanted = digests(campaign.folder / "a.graze");
  const auto shard = campaign.folder / "a.graze" / "shards" / "000001.h5";
  std::fstream(shard, std::ios::in | std::ios::out | std::ios::binary).seekp(4000) << 'x';
  EXPECT_EQ(campaign.graze("score a.graze").code, 2);
  const testing::Result mended = campaign.graze("resume a.graze");
  EXPECT_EQ(mended.code, 0) << mended.err;
  EXPECT_THAT(mended.err, AllOf(HasSubstr("is damaged"), HasSubstr("damaged/"), HasSubstr("0 of 40 traces")));
  EXPECT_EQ(digests(campaign.folder / "a.graze"), wanted);
}

TEST(Resume, DoesLostShardsAgain) {
  const Campaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 40 --quiet -o a.graze").code, 0);
  const auto wanted = digests(campaign.folder / "a.graze");
  ASSERT_EQ(campaign.graze("resume a.graze -n 60 --quiet").code, 0);
  std::filesystem::remove(campaign.folder / "a.graze" / "shards" / "000001.h5");
  for (const std::string verb : {"score", "status", "pack"}) {
    const testing::Result refused = campaign.graze(verb + " a.graze");
    EXPECT_EQ(refused.code, 2) << verb;
    EXPECT_THAT(refused.err, AllOf(HasSubstr("shards/000001.h5 is gone"), HasSubstr("40 traces of 'still'"),
                                   HasSubstr("graze resume a.graze")));
  }
  const testing::Result mended = campaign.graze("resume a.graze");
  EXPECT_EQ(mended.code, 0) << mended.err;
  EXPECT_THAT(mended.err, AllOf(HasSubstr("shards/000001.h5 is gone"), HasSubstr("20 of 60 traces")));
  const auto now = digests(campaign.folder / "a.graze").at("still");
  EXPECT_EQ(now.size(), 60u);
  for (const auto& [particle, digest] : wanted.at("still")) EXPECT_EQ(now.at(particle), digest);
}

TEST(Resume, OneWriterAtATime) {
  const Campaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const DirectoryLock lock(campaign.folder / "a.graze");
  const testing::Result refused = campaign.graze("resume a.graze -n 30");
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("is writing here"), HasSubstr("process")));
  EXPECT_EQ(campaign.graze("run ball.yaml -n 20 --force -o a.graze").code, 3);
  EXPECT_THAT(campaign.graze("status a.graze").out, HasSubstr("complete"));
}

TEST(Resume, ALeftOverLockKeepsNobodyOut) {
  const Campaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  testing::write_file(campaign.folder / "a.graze" / "lock", "process 1 on elsewhere since 2020-01-01T00:00:00Z");
  EXPECT_EQ(campaign.graze("resume a.graze -n 30 --quiet").code, 0);
}

}  // namespace
}  // namespace graze
