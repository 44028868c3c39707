// Claim: a disk that fails ends a campaign with exit code 3 and one message: which path, why, how much is kept, how to
// go on. Once it is mended, `resume` ends with the bits of a campaign that nothing happened to.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include "archive/archive.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::digests;
using ::testing::HasSubstr;
using testing::Result;
namespace fs = std::filesystem;

class Disk : public ::testing::Test, public testing::BallCampaign {
 protected:
  Disk() : BallCampaign("record: {telemetry: all}\n") {
    fs::create_directory(disk);
    mounted = mount("none", disk.c_str(), "tmpfs", 0, "size=2m") == 0;
  }
  ~Disk() override {
    if (mounted) umount(disk.c_str());
  }
  bool remount(unsigned long flags, const char* options) const {
    return mount("none", disk.c_str(), "tmpfs", MS_REMOUNT | flags, options) == 0;
  }

  const fs::path disk = folder / "disk";
  bool mounted = false;
};

TEST_F(Disk, FullThenMendedThenResumed) {
  if (!mounted) GTEST_SKIP() << "mounting is not permitted";
  ASSERT_EQ(graze("run ball.yaml -n 8000 --quiet -o whole.graze").code, 0);
  ASSERT_EQ(graze("run ball.yaml -n 400 --quiet -o disk/a.graze").code, 0);
  const Result refused = graze("resume disk/a.graze -n 8000 --quiet");
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("will not fit"), HasSubstr("--ignore-space")));
  EXPECT_TRUE(Archive(disk / "a.graze").complete()) << "a refused growth changes nothing";
  const Result full = graze("resume disk/a.graze -n 8000 --quiet --ignore-space");
  EXPECT_EQ(full.code, 3);
  EXPECT_THAT(full.err, AllOf(HasSubstr("disk/a.graze/shards/"), HasSubstr("No space left on device"),
                              HasSubstr(" of 8000 traces are kept"), HasSubstr("'graze resume disk/a.graze'")));
  EXPECT_FALSE(Archive(disk / "a.graze").complete());
  const auto kept = digests(disk / "a.graze").at("still");
  EXPECT_GE(kept.size(), 400u);
  EXPECT_THAT(full.err, HasSubstr(std::to_string(kept.size()) + " of 8000"));
  EXPECT_EQ(graze("status disk/a.graze").code, 0);
  ASSERT_TRUE(remount(0, "size=200m"));
  const Result mended = graze("resume disk/a.graze --quiet");
  EXPECT_EQ(mended.code, 0) << mended.err;
  EXPECT_EQ(digests(disk / "a.graze"), digests(folder / "whole.graze"));
}

TEST_F(Disk, FullBeforeAnythingWasWritten) {
  if (!mounted) GTEST_SKIP() << "mounting is not permitted";
  ASSERT_TRUE(remount(0, "size=192k"));  // the description fits, the first shard does not however early it comes
  const Result full = graze("run ball.yaml -n 8000 --quiet --ignore-space -o disk/a.graze");
  EXPECT_EQ(full.code, 3);
  EXPECT_THAT(full.err, AllOf(HasSubstr("No space left on device"), HasSubstr("no trace had been written yet")));
  EXPECT_THAT(full.err, ::testing::Not(HasSubstr("graze resume disk/a.graze"))) << "there is nothing to resume";
  EXPECT_FALSE(fs::exists(disk / "a.graze"));
}

TEST_F(Disk, AFileThatMayNotGrow) {
  // ulimit -f: the system sends SIGXFSZ, which would end the program.
  const std::string limited = "ulimit -f 200; '" + std::string(GRAZE_PROGRAM) + "' run ball.yaml -n 8000 --quiet";
  const Result result = testing::shell(folder.path(), limited + " -o a.graze");
  EXPECT_EQ(result.code, 3) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("a.graze/shards/000001.h5: cannot be written: File too large")));
}

// Whatever writes it.
TEST_F(Disk, AFileThatMayNotGrowOfAnyVerb) {
  ASSERT_EQ(graze("run ball.yaml -n 400 --quiet --telemetry all --every 1 -o a.graze").code, 0);
  for (const std::string verb : {"pack a.graze -o b.h5", "replay a.graze --particle 0 --policy still -o c.csv",
                                 "sample ball.yaml -n 5000 -o s.csv"}) {
    SCOPED_TRACE(verb);
    const Result result = testing::shell(folder.path(), "ulimit -f 4; '" + std::string(GRAZE_PROGRAM) + "' " + verb);
    EXPECT_EQ(result.code, 3) << result.err;
    EXPECT_THAT(result.err, HasSubstr("File too large"));
  }
}

TEST_F(Disk, ReadOnly) {
  if (!mounted) GTEST_SKIP() << "mounting is not permitted";
  ASSERT_EQ(graze("run ball.yaml -n 40 --quiet -o disk/a.graze").code, 0);
  ASSERT_TRUE(remount(MS_RDONLY, "size=2m"));
  for (const char* verb : {"run ball.yaml -n 40 --quiet -o disk/b.graze", "resume disk/a.graze -n 80 --quiet",
                           "pack disk/a.graze", "run ball.yaml -n 40 --quiet --force -o disk/a.graze"}) {
    SCOPED_TRACE(verb);
    const Result refused = graze(verb);
    EXPECT_EQ(refused.code, 3);
    EXPECT_THAT(refused.err, AllOf(HasSubstr("disk/"), HasSubstr("Read-only file system")));
  }
  EXPECT_EQ(graze("score disk/a.graze").code, 0);
  EXPECT_THAT(graze("status disk/a.graze").out, HasSubstr("complete"));
  EXPECT_EQ(digests(disk / "a.graze").at("still").size(), 40u);
}

TEST_F(Disk, ShardsThatWereCutShortAreDoneAgain) {
  ASSERT_EQ(graze("run ball.yaml -n 40 --quiet -o whole.graze").code, 0);
  const std::string shard = "shards/000001.h5";
  const std::string whole = testing::read_file(folder / "whole.graze" / shard);
  for (const std::size_t size : {std::size_t{0}, std::size_t{10}, whole.size() / 2, whole.size() - 1}) {
    SCOPED_TRACE(size);
    fs::remove_all(folder / "a.graze");
    fs::copy(folder / "whole.graze", folder / "a.graze", fs::copy_options::recursive);
    testing::write_file(folder / "a.graze" / shard, whole.substr(0, size));
    EXPECT_EQ(graze("score a.graze").code, 2);
    const Result mended = graze("resume a.graze --quiet");
    EXPECT_EQ(mended.code, 0) << mended.err;
    EXPECT_THAT(mended.err, AllOf(HasSubstr(shard), HasSubstr("damaged/"), HasSubstr("simulated again")));
    EXPECT_EQ(digests(folder / "a.graze"), digests(folder / "whole.graze"));
  }
}

TEST_F(Disk, AClockThatJumpsChangesNothing) {
  ASSERT_EQ(graze("run ball.yaml -n 40 --quiet -o a.graze").code, 0);
  ASSERT_EQ(graze("run ball.yaml -n 80 --quiet -o whole.graze").code, 0);
  using namespace std::chrono_literals;
  for (const auto jump : {-24h * 365 * 40, 24h * 365 * 20}) {
    for (const auto& entry : fs::recursive_directory_iterator(folder / "a.graze")) {
      fs::last_write_time(entry, fs::file_time_type::clock::now() + jump);
    }
    EXPECT_EQ(graze("status a.graze").code, 0);
    EXPECT_EQ(graze("resume a.graze -n 80 --quiet").code, 0);
    EXPECT_EQ(digests(folder / "a.graze"), digests(folder / "whole.graze"));
  }
}

}  // namespace
}  // namespace graze
