// Claim: whoever comes second to a campaign's directory changes nothing there, and whoever is refused leaves all as it
// was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AnyOf;
using testing::BallCampaign;
using testing::digests;
using ::testing::HasSubstr;
using testing::Process;

nlohmann::json status(const BallCampaign& campaign, const std::string& name) {
  return nlohmann::json::parse(campaign.graze("status --json " + name).out);
}

// Claim: of two campaigns that start at once in one place one goes on undisturbed, and the other is told.
TEST(Writers, OneOfTwoThatStartAtOnce) {
  const BallCampaign campaign;
  for (int round = 0; round < 6; ++round) {
    const std::string name = "race" + std::to_string(round) + ".graze";
    const auto start = [&](int seed) {
      return "'" GRAZE_PROGRAM "' run ball.yaml -n 3000 --threads 1 --quiet --seed " + std::to_string(seed) + " -o " +
             name + " >/dev/null 2>err" + std::to_string(seed) + "; echo $? >code" + std::to_string(seed);
    };
    testing::shell(campaign.folder.path(), "( " + start(1) + " ) & ( " + start(2) + " ) & wait");
    const auto code = [&](int seed) {
      return std::atoi(testing::read_file(campaign.folder / ("code" + std::to_string(seed))).c_str());
    };
    const int winner = code(1) == 0 ? 1 : 2, loser = 3 - winner;
    EXPECT_EQ(code(winner), 0);
    EXPECT_NE(code(loser), 0);
    const std::string told = testing::read_file(campaign.folder / ("err" + std::to_string(loser)));
    EXPECT_THAT(told, AnyOf(HasSubstr("is writing here"), HasSubstr("exists and is not empty")));
    const Archive archive(campaign.folder / name);
    EXPECT_TRUE(archive.complete());
    EXPECT_EQ(archive.info().seed, static_cast<std::uint64_t>(winner));
  }
}

// Claim: of two that resume at once the second goes on from what the first has made of the campaign.
TEST(Writers, TwoResumesDoNotUndoEachOther) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 100 --quiet -o a.graze").code, 0);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 3000 --quiet -o whole.graze").code, 0);
  testing::shell(campaign.folder.path(), "'" GRAZE_PROGRAM
                                         "' resume a.graze -n 3000 --quiet & first=$!; "
                                         "while [ ! -e a.graze/lock ] && kill -0 $first; do :; done; "
                                         "'" GRAZE_PROGRAM "' resume a.graze --quiet; wait");
  EXPECT_EQ(digests(campaign.folder / "a.graze"), digests(campaign.folder / "whole.graze"));
  EXPECT_TRUE(Archive(campaign.folder / "a.graze").complete());
}

// Claim: a resume that is refused for its size changes nothing.
TEST(Writers, ARefusedResumeLeavesTheCampaign) {
  const BallCampaign campaign("sampling: {design: random}\n");
  std::string text = testing::read_file(campaign.folder / "ball.yaml");
  for (const char* more : {"a", "b", "c"}) {  // so many counters for each look
    text.insert(text.find("  still:"), std::string("  ") + more + ": {hold: {}, control: {torque: {}}}\n");
  }
  testing::write_file(campaign.folder / "ball.yaml", text);
  ASSERT_EQ(campaign.graze("run ball.yaml --until 'ci < 0.2' --quiet -o a.graze").code, 0);
  const auto before = status(campaign, "a.graze");
  const testing::Result refused = campaign.graze("resume a.graze -n 4294967295 --threads 1 --quiet");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("more than can be counted"));
  EXPECT_EQ(status(campaign, "a.graze"), before);
  EXPECT_EQ(campaign.graze("resume a.graze --quiet").code, 0);
}

// Claim: killed before its first shard, --force has lost nothing; status says what resume will do, and it does.
TEST(Writers, TheReplacedCampaignComesBack) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const auto before = digests(campaign.folder / "a.graze");
  {
    // Traces so long that no shard is written.
    Process process(campaign.folder.path(),
                    "run ball.yaml -n 16 --quiet --force -o a.graze --watchdog 0 --set time.end=900000");
    process.wait_until([&] {
      return std::filesystem::exists(campaign.folder / "a.graze/campaign.h5") &&
             std::filesystem::exists(campaign.folder / "a.graze/replaced");
    });
    process.send(SIGKILL);
    process.wait();
  }
  EXPECT_THAT(campaign.graze("status a.graze").out, HasSubstr("brings back what it replaced"));
  const testing::Result resumed = campaign.graze("resume a.graze --quiet");
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("this one is back"));
  EXPECT_EQ(digests(campaign.folder / "a.graze"), before);
}

}  // namespace
}  // namespace graze
