// Claim: whatever asks a campaign to stop, a user, a terminal or a scheduler, it finishes what is under way, keeps it,
// says how to go on, and ends with exit code 3; what closes its output does not stop it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "archive/archive.h"
#include "tests/archive/tables.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::digests;
using ::testing::HasSubstr;
using testing::Process;
using testing::Result;

class Signals : public ::testing::Test, public testing::BallCampaign {};

constexpr const char* kRun = "run ball.yaml -n 20000 --threads 2 --quiet -o ";

TEST_F(Signals, EachOfThemLeavesACampaignThatGoesOn) {
  ASSERT_EQ(graze(kRun + std::string("whole.graze")).code, 0);
  const auto wanted = digests(folder / "whole.graze").at("still");
  ASSERT_EQ(wanted.size(), 20000u);
  const std::vector<std::pair<std::string, std::vector<int>>> cases = {
      {"SIGINT", {SIGINT}},   {"SIGTERM", {SIGTERM}}, {"SIGHUP", {SIGHUP}},
      {"SIGUSR1", {SIGUSR1}}, {"SIGXCPU", {SIGXCPU}}, {"SIGTERM", {SIGSTOP, SIGCONT, SIGTERM}}};
  std::vector<testing::TemporaryFolder> folders(cases.size());
  std::vector<std::unique_ptr<Process>> processes;
  for (const testing::TemporaryFolder& own : folders) {
    testing::write_ball(own);
    // So many particles that it cannot be over before the signal comes.
    processes.push_back(std::make_unique<Process>(
        own.path(), "run ball.yaml -n 100000000 --threads 1 --quiet --ignore-space -o a.graze"));
  }
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const auto& [name, signals] = cases[i];
    SCOPED_TRACE(name);
    const testing::TemporaryFolder& own = folders[i];
    processes[i]->wait_until([&] { return std::filesystem::exists(own / "a.graze/shards/000001.h5"); });
    for (const int signal : signals) processes[i]->send(signal);
    const Result stopped = processes[i]->wait();
    EXPECT_EQ(stopped.code, 3) << stopped.err;
    EXPECT_THAT(stopped.err, AllOf(HasSubstr("stopped by " + name + " before"), HasSubstr("what was finished is kept"),
                                   HasSubstr("'graze resume a.graze'")));
    EXPECT_THAT(stopped.err, HasSubstr("graze: " + name + ": the blocks under way are finished first"))
        << "acknowledged, though stderr is a file";
    EXPECT_THAT(testing::graze(own.path(), "status a.graze").out,
                HasSubstr("stopped; 'graze resume a.graze' does the rest"));
    const Archive archive(own / "a.graze");
    const TraceTable traces = table_of(archive, "still");
    EXPECT_FALSE(archive.complete());
    EXPECT_GT(traces.size(), 0u);
    for (std::size_t k = 0; k < traces.size() && traces.particle[k] < wanted.size(); ++k) {
      ASSERT_EQ(traces.digest[k], wanted.at(traces.particle[k]));
    }
  }
}

TEST_F(Signals, WhatWasStoppedAtOnceIsResumedToTheSameBits) {
  ASSERT_EQ(graze(kRun + std::string("whole.graze")).code, 0);
  for (int trial = 0; !std::filesystem::exists(folder / "a.graze"); ++trial) {
    Process process(folder.path(), kRun + std::string("a.graze"));
    process.wait_until([&] { return process.catches(SIGXCPU); });
    usleep(static_cast<useconds_t>(5000 * trial));
    process.send(SIGUSR1);
    const Result stopped = process.wait();
    ASSERT_EQ(stopped.code, 3) << "it was over before the signal came: " << stopped.err;
    const bool kept = std::filesystem::exists(folder / "a.graze");
    EXPECT_THAT(stopped.err, HasSubstr(kept ? "'graze resume a.graze'" : "nothing is kept"));
  }
  EXPECT_EQ(graze("resume a.graze --quiet").code, 0);
  EXPECT_EQ(digests(folder / "a.graze"), digests(folder / "whole.graze"));
}

TEST_F(Signals, ASecondOneDoesNotWaitForTheBlocksUnderWay) {
  // Blocks that take many minutes: only leaving at once ends one that has begun. A signal that comes before that ends
  // the campaign in the usual way; then another one is tried. What a scheduler announces first is not one of the two.
  const std::vector<std::vector<int>> cases = {{SIGINT, SIGINT}, {SIGTERM, SIGTERM}, {SIGUSR1, SIGINT, SIGTERM}};
  for (const std::vector<int>& signals : cases) {
    bool at_once = false;
    for (int trial = 0; !at_once; ++trial) {
      ASSERT_LT(trial, 20);
      Process process(folder.path(), "run ball.yaml -n 16 --quiet --force -o b.graze --set time.end=900000");
      process.wait_until([&] { return process.catches(SIGXCPU); });
      usleep(static_cast<useconds_t>(100'000 * trial));
      for (const int signal : signals) {
        process.send(signal);
        usleep(400'000);  // a signal that comes sooner may be the same one, passed on by a launcher
      }
      const Result left = process.wait();
      EXPECT_EQ(left.code, 3);
      EXPECT_THAT(
          left.err,
          HasSubstr(signals[0] == SIGINT    ? "SIGINT: the blocks under way are finished first; Ctrl-C once more"
                    : signals[0] == SIGTERM ? "SIGTERM: the blocks under way are finished first; SIGTERM once more"
                                            : "SIGUSR1: the blocks under way are finished first; Ctrl-C or SIGTERM"));
      at_once = left.err.find("b.graze: stopped at once") != std::string::npos;
      EXPECT_THAT(left.err, HasSubstr(at_once ? "'graze resume b.graze'" : "nothing is kept"));
    }
  }
}

TEST_F(Signals, WhatIsIgnoredStaysIgnored) {
  Process process(folder.path(), kRun + std::string("a.graze"), [] { std::signal(SIGHUP, SIG_IGN); });  // nohup
  process.wait_until([&] { return process.catches(SIGTERM); });
  process.send(SIGHUP);
  EXPECT_EQ(process.wait().code, 0);
  EXPECT_TRUE(Archive(folder / "a.graze").complete());
}

TEST_F(Signals, AClosedPipeLosesNothing) {
  const std::string program = "'" + std::string(GRAZE_PROGRAM) + "' ";
  const std::string campaign = " ball.yaml -n 400 -o ";
  testing::shell(folder.path(), "( " + program + "run" + campaign + "a.graze; echo $? >code ) 2>err | true");
  EXPECT_EQ(testing::read_file(folder / "code"), "0\n");
  EXPECT_TRUE(Archive(folder / "a.graze").complete());
  testing::shell(folder.path(), "( " + program + "run" + campaign + "b.graze; echo $? >code ) 2>&1 | true");
  EXPECT_EQ(testing::read_file(folder / "code"), "0\n");
  EXPECT_TRUE(Archive(folder / "b.graze").complete());
}

TEST_F(Signals, ASecondWriterIsToldWhoWasFirst) {
  Process process(folder.path(), "run ball.yaml -n 100000000 --quiet --ignore-space -o a.graze");
  process.wait_until([&] { return process.catches(SIGXCPU); });
  const Result second = graze("resume a.graze");
  EXPECT_EQ(second.code, 3);
  EXPECT_THAT(second.err, AllOf(HasSubstr("process "), HasSubstr("is writing here")));
  EXPECT_EQ(graze("run ball.yaml --force -o a.graze").code, 3);
  process.send(SIGKILL);
  process.wait();
  EXPECT_TRUE(std::filesystem::exists(folder / "a.graze/lock")) << "a killed program cannot remove it";
  Process next(folder.path(), "resume a.graze --quiet");  // and it keeps nobody out
  next.wait_until([&] { return next.catches(SIGXCPU); });
  next.send(SIGTERM);
  EXPECT_THAT(next.wait().err, HasSubstr("stopped by SIGTERM"));
}

}  // namespace
}  // namespace graze
