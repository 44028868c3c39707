// Claims: ranks under mpirun give the datasets that one process gives, whatever their number and that of their threads;
// a rank that fails is named and costs nothing that was finished; a job that is killed can be resumed.
#include "jobs/campaign/ranks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <barrier>
#include <csignal>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "archive/archive.h"
#include "archive/directory/campaign_directory.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/mpirun.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::digests;
using ::testing::HasSubstr;
using testing::kHaveMpi;
using testing::mpirun;
using testing::TemporaryFolder;

/// Shards that are finished.
std::set<std::string> shards_of(const std::filesystem::path& directory) {
  std::set<std::string> out;
  for (const auto& file : shard_files(directory)) out.insert(file.filename().string());
  return out;
}

TEST(RanksAndThreads, GiveTheSameDatasets) {
  if (!kHaveMpi) GTEST_SKIP() << "built without MPI";
  const TemporaryFolder folder;
  testing::write_ball(folder);
  for (const int ranks : {1, 2, 4}) {
    for (const int threads : {1, 2}) {
      const std::string name = std::to_string(ranks) + "x" + std::to_string(threads);
      const testing::Result run =
          testing::shell(folder.path(), mpirun(ranks) + "run ball.yaml -n 3000 --quiet --threads " +
                                            std::to_string(threads) + " -o " + name + ".graze");
      ASSERT_EQ(run.code, 0) << run.err;
      ASSERT_EQ(testing::graze(folder.path(), "pack " + name + ".graze -o " + name + ".h5").code, 0);
      const testing::Result same = testing::shell(
          folder.path(), "/usr/bin/python3 " GRAZE_SOURCE_DIR "/tests/jobs/same_datasets.py 1x1.h5 " + name + ".h5");
      EXPECT_EQ(same.code, 0) << name << ": " << same.out << same.err;
    }
  }
}

// Claim: a question has the same answer after the same number of particles, by any number of ranks.
TEST(Ranks, AnswerQuestionsAfterTheSameNumberOfParticles) {
  if (!kHaveMpi) GTEST_SKIP() << "built without MPI";
  const TemporaryFolder folder;
  testing::write_ball(folder);
  const std::string question = "run ball.yaml -n 20000 --quiet --threads 1 --until 'ci < 0.1' -o ";
  ASSERT_EQ(testing::graze(folder.path(), question + "alone.graze").code, 0);
  ASSERT_EQ(testing::shell(folder.path(), mpirun(3) + question + "three.graze").code, 0);
  const Archive alone(folder / "alone.graze"), three(folder / "three.graze");
  EXPECT_LT(alone.info().particles, 20000u);
  EXPECT_EQ(three.info().particles, alone.info().particles);
  EXPECT_EQ(digests(folder / "three.graze"), digests(folder / "alone.graze"));
}

TEST(Ranks, AMistakeIsToldOnceAndEndsAll) {
  if (!kHaveMpi) GTEST_SKIP() << "built without MPI";
  const TemporaryFolder folder;
  const testing::Result run = testing::shell(folder.path(), mpirun(2) + "run nothing.yaml");
  EXPECT_EQ(run.code, 2);
  const std::string message = "graze: nothing.yaml: there is no such file";
  const auto first = run.err.find(message);
  ASSERT_NE(first, std::string::npos) << run.err;
  EXPECT_EQ(run.err.find(message, first + 1), std::string::npos) << run.err;
}

/// Kills a rank or the whole job at a random instant, several times, and resumes under other numbers of ranks.
void kill_ranks(int rounds) {
  if (!kHaveMpi) GTEST_SKIP() << "built without MPI";
  const TemporaryFolder folder;
  testing::write_ball(folder);
  const std::string run = "run ball.yaml -n 20000 --threads 1 --quiet -o ";
  ASSERT_EQ(testing::graze(folder.path(), run + "whole.graze").code, 0);
  const auto wanted = digests(folder / "whole.graze");
  std::mt19937 random(11);
  std::uniform_real_distribution<double> instant(0.3, 1.5);
  int killed = 0;
  for (int round = 0; round < rounds; ++round) {
    const std::string name = "killed" + std::to_string(round) + ".graze", path = (folder / name).string();
    // All processes of the job have the directory's name in their command lines. The newest is a rank.
    const std::string which = round % 2 ? "-n -f '^[^ ]*graze run .*" : "-f '";
    const std::string kill = "sleep " + std::to_string(instant(random)) + "; pkill -KILL " + which + path + "'";
    const testing::Result cut = testing::shell(
        folder.path(), "(" + kill + ") & exec 3>&1; " + mpirun(2) + run + path + "; code=$?; wait; exit $code");
    killed += cut.code != 0;
    if (round % 2 && cut.code != 0) {
      EXPECT_THAT(cut.err, AllOf(HasSubstr("rank "), HasSubstr(" on node ")))
          << "round " << round << ", exit code " << cut.code;
    }
    if (!std::filesystem::exists(folder / name / "campaign.h5")) continue;  // killed before it had begun
    const auto before = digests(folder / name);
    const std::set<std::string> shards = shards_of(folder / name);
    const testing::Result end = testing::shell(folder.path(), mpirun(1 + round % 3) + "resume --quiet " + path);
    ASSERT_EQ(end.code, 0) << "round " << round << ": " << end.err << "\nbefore: " << cut.err;
    EXPECT_EQ(digests(folder / name), wanted) << "round " << round;
    const std::set<std::string> now = shards_of(folder / name);
    EXPECT_TRUE(std::includes(now.begin(), now.end(), shards.begin(), shards.end())) << "a finished shard was lost";
    for (const auto& [policy, traces] : before) {
      for (const auto& [particle, digest] : traces) EXPECT_EQ(wanted.at(policy).at(particle), digest);
    }
  }
  EXPECT_GT(killed, 0) << "no round killed anything";
}

TEST(Ranks, SurviveKillsAtRandomInstants) { kill_ranks(5); }
TEST(Ranks, SurviveManyKillsAtRandomInstants) {
  if (!std::getenv("GRAZE_LONG")) GTEST_SKIP() << "tests/run --long runs it";
  kill_ranks(50);
}

/// A job of two ranks that goes on until it is ended; the launcher and whoever is left are killed with it.
class Job {
 public:
  explicit Job(const TemporaryFolder& folder) {
    testing::shell(
        folder.path(),
        "{ " + mpirun(2) +
            "run ball.yaml -n 100000000 --ignore-space --threads 1 --quiet -o a.graze >/dev/null 2>job.err & "
            "echo $! >job.pid; }");
    launcher_ = number(testing::read_file(folder / "job.pid"));
    const auto there = [&](const char* shard) { return std::filesystem::exists(folder / "a.graze/shards" / shard); };
    for (int i = 0; i < 6000 && !(there("000001.h5") && there("r00001-000001.h5")); ++i) usleep(10'000);
    leader_ = number(testing::read_file(folder / "a.graze/lock").substr(std::string("process ").size()));
    std::istringstream children(
        testing::shell(folder.path(), "cat /proc/" + std::to_string(launcher_) + "/task/*/children").out);
    for (pid_t child = 0; children >> child;) {
      if (child != leader_) member_ = child;
    }
  }
  ~Job() { end(); }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  bool runs() const { return launcher_ > 0 && leader_ > 0 && member_ > 0; }
  /// Kills the leader alone; the other rank, and the launcher, which would end it, are held.
  void kill_leader() const {
    kill(launcher_, SIGSTOP);
    kill(member_, SIGSTOP);
    kill(leader_, SIGKILL);
  }
  void end() {
    if (!runs()) return;
    kill(leader_, SIGKILL);
    kill(member_, SIGKILL);
    kill(launcher_, SIGCONT);
    for (int i = 0; i < 1000 && kill(launcher_, 0) == 0; ++i) usleep(10'000);
    launcher_ = 0;
  }

 private:
  static pid_t number(const std::string& text) { return static_cast<pid_t>(std::atoi(text.c_str())); }
  pid_t launcher_ = 0, leader_ = 0, member_ = 0;
};

// Claim: when the leading rank is killed and another is still there, nobody takes the directory over; once that one is
// gone, too, `resume` does, and nothing that was finished is lost.
TEST(Ranks, KeepTheDirectoryWithoutTheirLeader) {
  if (!kHaveMpi) GTEST_SKIP() << "built without MPI";
  const TemporaryFolder folder;
  testing::write_ball(folder);
  Job job(folder);
  ASSERT_TRUE(job.runs()) << testing::read_file(folder / "job.err");
  job.kill_leader();
  const auto content = [&] {
    std::map<std::string, std::string> out;
    for (const auto& shard : shard_files(folder / "a.graze")) out[shard.filename()] = testing::read_file(shard);
    out["campaign.h5"] = testing::read_file(folder / "a.graze/campaign.h5");
    return out;
  };
  const auto before = content();
  ASSERT_GE(before.size(), 3u);
  EXPECT_THAT(testing::graze(folder.path(), "status a.graze").out, HasSubstr("running (process "));
  for (const char* verb : {"resume a.graze", "run ball.yaml --force -o a.graze"}) {
    const std::string patient = std::string("timeout -s KILL 1 '" GRAZE_PROGRAM "' ") + verb;
    EXPECT_NE(testing::shell(folder.path(), patient).code, 0) << verb;
    EXPECT_TRUE(content() == before) << verb << ": something was changed";
  }
  job.end();
  testing::Process process(folder.path(), "resume a.graze --threads 1");  // it would go on for long
  process.wait_until([&] { return process.catches(SIGXCPU); });
  process.send(SIGTERM);
  const testing::Result resumed = process.wait();
  EXPECT_THAT(resumed.err, AllOf(HasSubstr(" of 100000000 traces are there"), HasSubstr("stopped by SIGTERM")));
  auto after = content();
  for (const auto& [name, bytes] : before) {
    EXPECT_TRUE(name == "campaign.h5" || after[name] == bytes) << name << " was lost";
  }
}

// ---- without MPI: ranks that are threads of this process

/// What the ranks of a fake communicator share.
struct Meeting {
  explicit Meeting(int size) : size(size), barrier(size) {}
  int size;
  std::unique_ptr<Communicator> counters = make_local_communicator();
  std::barrier<> barrier;
  std::string text;
};

class FakeRank final : public Communicator {
 public:
  FakeRank(Meeting& meeting, int rank) : meeting_(meeting), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return meeting_.size; }
  std::uint64_t fetch_add(std::size_t counter, std::uint64_t delta) override {
    return meeting_.counters->fetch_add(counter, delta);
  }
  void add(std::size_t first, std::span<const std::uint64_t> deltas) override { meeting_.counters->add(first, deltas); }
  std::vector<std::uint64_t> read(std::size_t first, std::size_t count) override {
    return meeting_.counters->read(first, count);
  }
  void barrier() override { meeting_.barrier.arrive_and_wait(); }
  std::string broadcast(const std::string& text) override {
    if (rank_ == 0) meeting_.text = text;
    barrier();
    return meeting_.text;
  }
  void leave() override {}

 private:
  Meeting& meeting_;
  int rank_;
};

// Claim: what rank 0 tells arrives as it was told.
TEST(Briefing, ComesBackFromText) {
  Briefing told{"/tmp/a.graze", 17, 4, 2.5, 3, {}};
  told.finished["step/1cm"] = {true, false, true, true, false, false, false, false, true};
  told.finished["none"] = {};
  const Briefing heard = Briefing::from_text(told.to_text());
  EXPECT_EQ(heard.directory, told.directory);
  EXPECT_EQ(heard.particles, 17u);
  EXPECT_EQ(heard.workers, 4u);
  EXPECT_EQ(heard.watchdog, 2.5);
  EXPECT_EQ(heard.shards, 3);
  EXPECT_EQ(heard.finished, told.finished);
}

// Claim: a rank that cannot begin says who it is and why; rank 0 goes on to the end and knows of it.
TEST(Ranks, OneThatFailsIsNamedAndHoldsNobodyUp) {
  Meeting meeting(2);
  FakeRank leader(meeting, 0), member(meeting, 1);
  int code = 0;
  ::testing::internal::CaptureStderr();
  std::thread other([&] { code = assist(member, 1); });
  {
    Start start(leader);
    start.give({"/nowhere/a.graze", 8, 2, 0, 0, {}});
    together(leader, [] { return CampaignEnd{}; });
  }
  other.join();
  EXPECT_EQ(code, 3);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), AllOf(HasSubstr("rank 1 of 2 on "), HasSubstr("/nowhere")));
  EXPECT_EQ(leader.read(kFailedRanks, 1).front(), 1u);
}

// Claim: ranks are sent home when rank 0 fails before the start.
TEST(Ranks, AreSentHomeWithoutAStart) {
  Meeting meeting(2);
  FakeRank leader(meeting, 0), member(meeting, 1);
  int code = -1;
  std::thread other([&] { code = assist(member, 1); });
  { const Start start(leader); }
  other.join();
  EXPECT_EQ(code, 0);
}

}  // namespace
}  // namespace graze
