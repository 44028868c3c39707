// Claim: `graze status` tells what is done, what failed and what is left, while a campaign runs and afterwards, and a
// clock that jumps makes its rate unknown, never absurd.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "archive/directory/unfinished.h"
#include "jobs/campaign/shard_rate.h"
#include "simulation/results_epoch.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::Process;

std::vector<ShardTime> every(double gap, int count, double begin) {
  std::vector<ShardTime> shards;
  for (int i = 1; i <= count; ++i) shards.push_back({begin + gap * i, 100});
  return shards;
}

TEST(ShardRate, CountsWhatWasWrittenSinceTheWriterBegan) {
  EXPECT_DOUBLE_EQ(*rate_of(0, 20, every(2, 10, 0)), 50);
  EXPECT_DOUBLE_EQ(*rate_of(10, 20, every(2, 10, 0)), 60) << "the shard at 10 s counts, too";
  EXPECT_DOUBLE_EQ(*rate_of(0, 30, every(2, 10, 0)), 1000 / 30.0) << "the next shard is late";
}

TEST(ShardRate, AJumpMakesItUnknownAndNotAbsurd) {
  EXPECT_FALSE(rate_of(100, 20, every(2, 10, 0))) << "back, since the writer began";
  EXPECT_FALSE(rate_of(0, 10, every(2, 10, 0))) << "back, since the last shards";
  EXPECT_FALSE(rate_of(50, 60, every(2, 10, 0))) << "back, and no shard seems to be of this writer";
  EXPECT_FALSE(rate_of(0, 10, {}));
  EXPECT_FALSE(rate_of(0, 0, {{0, 100}})) << "no time has passed";
  auto shards = every(2, 10, 0);
  for (std::size_t i = 5; i < 10; ++i) shards[i].time += 86400;
  EXPECT_DOUBLE_EQ(*rate_of(0, 86420, shards), 50) << "forward, between two shards";
  EXPECT_DOUBLE_EQ(*rate_of(0, 1e9, every(2, 10, 0)), 50) << "forward, since the last shard";
}

class Status : public ::testing::Test, public testing::BallCampaign {
 protected:
  nlohmann::json json(const std::string& archive) const {
    const testing::Result result = graze("status --json " + archive);
    EXPECT_EQ(result.code, 0) << result.err;
    return nlohmann::json::parse(result.out);
  }
};

TEST_F(Status, TellsFailuresByTheirRequirement) {
  // Every ball that begins below 0.17 m violates `high` at once; of the others some never get below 0.2 m.
  ASSERT_EQ(graze("run ball.yaml -n 200 --quiet -o a.graze --set task.requirements.high.height.above=0.17").code, 0);
  const nlohmann::json status = json("a.graze");
  EXPECT_EQ(status["state"], "complete");
  const nlohmann::json& row = status["policies"]["still"];
  const int known = row["known_failure"], unknown = row["unknown_failure"], good = row["success"];
  EXPECT_GT(known, 0);
  EXPECT_GT(unknown, 0);
  EXPECT_EQ(known + unknown + good, 200);
  EXPECT_EQ(status["violated_first"]["high"], known);
  EXPECT_EQ(status["results_version"], results_version());
  EXPECT_EQ(status["build"]["eigen_version"], build_facts().eigen);
  EXPECT_THAT(graze("status a.graze").out,
              AllOf(HasSubstr("complete"), HasSubstr("200 of 200 traces (100.0 %) in 1 shard"),
                    HasSubstr("failures: high " + std::to_string(known) + ", unknown " + std::to_string(unknown))));
  ASSERT_EQ(graze("pack a.graze").code, 0);
  EXPECT_EQ(json("a.h5")["violated_first"]["high"], known);
}

TEST_F(Status, TellsWhatIsUnfinishedUntilResumeTriesItAgain) {
  ASSERT_EQ(graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  add_unfinished(folder / "a.graze", {"still", 20, "took longer than the watchdog allows"});
  std::ofstream(folder / "a.graze" / kUnfinishedFile, std::ios::app) << "{\"policy\": \"sti";  // a crash cut it short
  const nlohmann::json status = json("a.graze");
  ASSERT_EQ(status["unfinished"].size(), 1u);
  EXPECT_EQ(status["unfinished"][0]["particle"], 20);
  EXPECT_THAT(graze("status a.graze").out,
              HasSubstr("policy still, particle 20: took longer than the watchdog allows; graze replay a.graze"));
  EXPECT_EQ(graze("resume a.graze -n 21 --quiet").code, 0);
  EXPECT_TRUE(json("a.graze")["unfinished"].empty());
  EXPECT_EQ(graze("run ball.yaml -n 20 --quiet --force -o a.graze").code, 0) << "it belongs to a campaign";
}

TEST_F(Status, TellsTheRateWhileACampaignRunsUnlessItsFilesComeFromTheFuture) {
  Process process(folder.path(), "run ball.yaml -n 100000000 --threads 1 --quiet --ignore-space -o a.graze");
  process.wait_until([&] { return std::filesystem::exists(folder / "a.graze/shards/000002.h5"); });
  process.send(SIGSTOP);
  const nlohmann::json status = json("a.graze");
  EXPECT_EQ(status["state"], "running");
  EXPECT_GT(status["traces_per_second"], 0);
  EXPECT_GT(status["seconds_left"], 0);
  const std::string text = graze("status a.graze").out;
  EXPECT_THAT(text,
              AllOf(HasSubstr("running (process "), HasSubstr("per second, about"), HasSubstr("failures so far:")));
  for (const char* file : {"lock", "shards/000001.h5"}) {
    SCOPED_TRACE(file);
    const auto path = folder / "a.graze" / file;
    const auto time = std::filesystem::last_write_time(path);
    std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now() + std::chrono::hours(24));
    EXPECT_TRUE(json("a.graze")["traces_per_second"].is_null());
    EXPECT_THAT(graze("status a.graze").out, HasSubstr("rate and time left are not known"));
    std::filesystem::last_write_time(path, time);
  }
  process.send(SIGCONT);
  process.send(SIGTERM);
  EXPECT_EQ(process.wait().code, 3);
  EXPECT_EQ(json("a.graze")["state"], "stopped");
}

// Claim: a campaign whose description says that it is complete, and that has lost traces since, is not, whoever looks.
TEST_F(Status, ACampaignThatLostTracesIsNotComplete) {
  ASSERT_EQ(graze("run ball.yaml -n 16 --quiet -o a.graze").code, 0);
  testing::fs::remove_all(folder / "a.graze/shards");
  testing::fs::remove_all(folder / "a.graze/manifest");
  EXPECT_EQ(json("a.graze")["state"], "stopped");
  EXPECT_THAT(graze("status a.graze").out, AllOf(HasSubstr("0 of 16 traces"), HasSubstr("does the rest")));
  const testing::Result score = graze("score a.graze");
  EXPECT_EQ(score.code, 3);
  EXPECT_THAT(score.out, HasSubstr("INCOMPLETE"));
  EXPECT_THAT(graze("pack a.graze").err, HasSubstr("holds 0 of 16 traces: the campaign is not complete"));
  EXPECT_EQ(graze("verify a.graze").code, 3);
  EXPECT_EQ(graze("resume a.graze --quiet").code, 0);
  EXPECT_EQ(graze("score a.graze").code, 0);
}

// Claim: what lies where the list of unfinished traces should makes no verb fail that does not need it, and all tell.
TEST_F(Status, VerbsAgreeOnAListThatIsNone) {
  ASSERT_EQ(graze("run ball.yaml -n 8 --quiet -o a.graze").code, 0);
  const std::string list = (folder / "a.graze/unfinished.jsonl").string();
  for (const std::string& make : {"mkfifo " + list, "mkdir " + list, "ln -s /dev/null " + list}) {
    ASSERT_EQ(testing::shell(folder.path(), "rm -rf " + list + "; " + make).code, 0);
    for (const std::string verb : {"status a.graze", "score a.graze", "pack a.graze --force"}) {
      const testing::Result result = graze(verb);
      EXPECT_EQ(result.code, 0) << verb << ": " << result.err;
      EXPECT_THAT(result.err, HasSubstr("unfinished.jsonl: is a")) << verb << " after " << make;
    }
  }
}

}  // namespace
}  // namespace graze
