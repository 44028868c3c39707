// Claim: whoever comes second to a campaign's directory changes nothing there, and whoever is refused leaves all as it
// was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using testing::BallCampaign;
using testing::digests;
using ::testing::HasSubstr;
using testing::Process;
using testing::Result;
namespace fs = std::filesystem;

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
      return std::filesystem::exists(campaign.folder / "a.graze/campaign.copy.h5") &&
             std::filesystem::exists(campaign.folder / "a.graze/replaced");
    });
    process.send(SIGKILL);
    process.wait();
  }
  EXPECT_THAT(campaign.graze("status a.graze").out, HasSubstr("brings back what it replaced"));
  EXPECT_THAT(campaign.graze("score a.graze").err,
              HasSubstr("'graze resume a.graze' brings back what it was to replace"));
  const testing::Result resumed = campaign.graze("resume a.graze --quiet");
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("this one is back"));
  EXPECT_EQ(digests(campaign.folder / "a.graze"), before);
}

// Claim: wherever a kill hits --force, status and score say what resume will do, and it does.
TEST(Writers, StatusAndScoreSayWhatResumeWillDo) {
  namespace fs = std::filesystem;
  const BallCampaign campaign;
  const fs::path path = campaign.folder / "a.graze";
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const auto before = digests(path);
  const auto comes_back = [&] {
    for (const std::string verb : {"status", "score"}) {
      const testing::Result refused = campaign.graze(verb + " a.graze");
      EXPECT_EQ(refused.code, 2) << verb;
      EXPECT_THAT(refused.err, HasSubstr("'graze resume a.graze' brings back what it was to replace")) << verb;
    }
    EXPECT_EQ(campaign.graze("resume a.graze --quiet").code, 0);
    EXPECT_EQ(digests(path), before);
  };
  fs::create_directory(path / "replacing");
  fs::rename(path / "campaign.h5", path / "replacing/campaign.h5");
  comes_back();
  fs::create_directory(path / "replaced");
  for (const char* name : {"campaign.h5", "campaign.copy.h5", "manifest", "shards"}) {
    fs::rename(path / name, path / "replaced" / name);
  }
  comes_back();
  fs::create_directory(path / "replaced");
  EXPECT_THAT(campaign.graze("status a.graze").err, HasSubstr("'graze resume a.graze' removes that"));
  EXPECT_EQ(campaign.graze("resume a.graze --quiet").code, 0);
  EXPECT_FALSE(fs::exists(path / "replaced"));
}

// Claim: a campaign that ended before it was described cannot be resumed, and the message says what does it.
TEST(Writers, WhatWasNotDescribedIsRunAnew) {
  const BallCampaign campaign;
  std::filesystem::create_directories(campaign.folder / "a.graze/shards");
  testing::write_file(campaign.folder / "a.graze/lock", "process 1 on elsewhere");
  testing::write_file(campaign.folder / "a.graze/campaign.h5.0123456789abcdef.tmp", "half");
  const testing::Result refused = campaign.graze("resume a.graze");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("'graze run SCENARIO -o a.graze' runs it from its start"));
  EXPECT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  EXPECT_FALSE(std::filesystem::exists(campaign.folder / "a.graze/campaign.h5.0123456789abcdef.tmp"));
}

// Claim: the description's copy has its very bytes, at the end as at the beginning (which it is compressed only once
// for).
TEST(Writers, TheCopyHasTheBytesOfTheDescription) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const auto bytes = [&](const char* name) { return testing::read_file(campaign.folder / "a.graze" / name); };
  const std::string complete = bytes("campaign.h5");
  EXPECT_GT(complete.size(), 1000u);
  EXPECT_TRUE(bytes("campaign.copy.h5") == complete);
  std::filesystem::remove(campaign.folder / "a.graze/shards/000001.h5");
  ASSERT_EQ(campaign.graze("resume a.graze -n 40 --quiet").code, 0);
  EXPECT_TRUE(bytes("campaign.h5") != complete);
  EXPECT_TRUE(bytes("campaign.copy.h5") == bytes("campaign.h5"));
}

// Claim: shards outlive the description and its copy: with the description of a like campaign they count as before.
TEST(Writers, ShardsOutliveTheirDescription) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 40 --seed 7 --quiet -o a.graze").code, 0);
  const auto before = digests(campaign.folder / "a.graze");
  for (const char* name : {"campaign.h5", "campaign.copy.h5"}) {
    std::filesystem::remove(campaign.folder / "a.graze" / name);
  }
  const testing::Result refused = campaign.graze("resume a.graze");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("can be kept (seed 7, "));
  ASSERT_EQ(campaign.graze("run ball.yaml -n 1 --seed 7 --quiet -o b.graze").code, 0);
  std::filesystem::copy_file(campaign.folder / "b.graze/campaign.h5", campaign.folder / "a.graze/campaign.h5");
  const testing::Result resumed = campaign.graze("resume a.graze -n 40");
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("40 of 40 traces are there"));
  EXPECT_EQ(digests(campaign.folder / "a.graze"), before);
}

// Claim: whoever moves a directory away from under its writer is told by it where it is now.
TEST(Writers, ADirectoryThatIsMovedIsMissed) {
  namespace fs = std::filesystem;
  const BallCampaign campaign;
  const fs::path path = campaign.folder / "a.graze";
  Process process(campaign.folder.path(),
                  "run ball.yaml -n 16 --quiet --threads 1 -o a.graze --watchdog 0 --set time.end=150");
  process.wait_until([&] { return fs::exists(path / "campaign.copy.h5"); });
  fs::rename(path, campaign.folder / "b.graze");
  fs::create_directories(path / "shards");
  const testing::Result ended = process.wait();
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("a.graze: is no longer the directory that this program writes into"));
  EXPECT_THAT(ended.err, HasSubstr((campaign.folder / "b.graze").string() + " now"));
  EXPECT_TRUE(fs::is_empty(path / "shards"));
}

// Claim: who removes the lock of a running campaign lets a second writer in; the first writes nothing more, and the
// second completes the campaign as if it had been alone.
TEST(Writers, AStolenLockEndsTheFirstWriter) {
  const BallCampaign campaign;
  const fs::path path = campaign.folder / "a.graze";
  const std::string arguments = "-n 400 --quiet --threads 1 --set time.end=4 -o ";
  ASSERT_EQ(campaign.graze("run ball.yaml " + arguments + "whole.graze").code, 0);
  Process process(campaign.folder.path(), "run ball.yaml " + arguments + "a.graze");
  process.wait_until([&] { return fs::exists(path / "campaign.copy.h5"); });
  process.send(SIGSTOP);
  fs::remove(path / "lock");
  const Result second = campaign.graze("resume a.graze --quiet");
  EXPECT_EQ(second.code, 0) << second.err;
  process.send(SIGCONT);
  const Result ended = process.wait();
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, AllOf(HasSubstr("a.graze/lock: was removed while this program held it"),
                               HasSubstr("'graze resume a.graze' does the rest")));
  EXPECT_EQ(digests(path), digests(campaign.folder / "whole.graze"));
  EXPECT_TRUE(Archive(path).complete());
}

// Claim: what was set aside never takes the place of anything, and a complete campaign that has lost its shards is no
// failed successor of what it has replaced.
TEST(Writers, WhatWasSetAsideReplacesNothing) {
  const testing::BallCampaign campaign;
  const auto at = [&](const char* name) { return campaign.folder / name; };
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 10 --seed 9 --quiet -o b.graze").code, 0);
  fs::copy(at("b.graze"), at("a.graze/replaced"), fs::copy_options::recursive);
  testing::write_file(at("a.graze/replaced/thesis.txt"), "mine");
  const Result refused = campaign.graze("run ball.yaml -n 20 --quiet -o a.graze");
  EXPECT_EQ(refused.code, 2) << refused.err;
  EXPECT_TRUE(fs::exists(at("a.graze/replaced/thesis.txt"))) << "who is refused changes nothing";
  EXPECT_EQ(campaign.graze("resume a.graze --quiet").code, 2) << "it would remove what is no campaign's";
  fs::remove(at("a.graze/replaced/thesis.txt"));
  for (const auto& entry : fs::directory_iterator(at("a.graze/shards"))) fs::remove(entry.path());
  EXPECT_EQ(campaign.graze("resume a.graze --quiet").code, 0) << "lost shards are simulated again";
  EXPECT_EQ(Archive(at("a.graze")).info().seed, 1u);

  fs::create_directory(at("a.graze/replacing"));
  fs::copy(at("b.graze/campaign.h5"), at("a.graze/replacing/campaign.h5"));
  const std::string before = testing::read_file(at("a.graze/campaign.h5"));
  const Result both = campaign.graze("resume a.graze --quiet");
  EXPECT_EQ(both.code, 2);
  EXPECT_THAT(both.err, AllOf(HasSubstr("campaign.h5: is there, and in replacing/, too"), HasSubstr("move one")));
  EXPECT_EQ(testing::read_file(at("a.graze/campaign.h5")), before);
}

// Claim: numbers in names of shards that are beyond counting are nobody's.
TEST(Writers, ShardNumbersDoNotOverflow) {
  const testing::BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  fs::rename(campaign.folder / "a.graze/shards/000001.h5", campaign.folder / "a.graze/shards/2147483647.h5");
  fs::remove_all(campaign.folder / "a.graze/manifest");
  EXPECT_EQ(campaign.graze("resume a.graze -n 40 --quiet").code, 0);
  EXPECT_EQ(campaign.graze("resume a.graze -n 60 --quiet").code, 0);
  EXPECT_TRUE(Archive(campaign.folder / "a.graze").complete());
}

// Claim: what is removed is removed up to a mount point, whatever is mounted there.
TEST(Writers, WhatIsMountedInACampaignOutlivesIt) {
  const testing::BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  fs::create_directories(campaign.folder / "a.graze/replaced/damaged/x.h5");
  fs::create_directory(campaign.folder / "home");
  testing::write_file(campaign.folder / "home/thesis.txt", "mine");
  const std::string point = (campaign.folder / "a.graze/replaced/damaged/x.h5").string();
  if (mount((campaign.folder / "home").c_str(), point.c_str(), nullptr, MS_BIND, nullptr) != 0) {
    GTEST_SKIP() << "mounting is not permitted";
  }
  const Result resumed = campaign.graze("resume a.graze --quiet");
  umount(point.c_str());
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(fs::exists(campaign.folder / "home/thesis.txt"));
}

}  // namespace
}  // namespace graze
