// Which frames of a trace are kept.
#include "simulation/telemetry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "archive/archive.h"
#include "tests/archive/tables.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Steps of the frames that are kept of a trace of `steps` steps of 1 ms that violates something after `violation`
/// steps (0: never). Each value of a frame tells its step.
std::vector<int> kept(const Recording& recording, int steps, int violation, bool failed) {
  TelemetryRecorder recorder(recording, 1e-3);
  std::vector<int> out;
  for (int round = 0; round < 2; ++round) {  // a lane is used again and again
    recorder.start(3);
    BlockArray q(2), v(1), tau(1);
    for (int step = 0; step <= steps; ++step) {
      q(0, 3) = q(1, 3) = v(0, 3) = tau(0, 3) = step;
      const bool violated = violation > 0 && step >= violation;
      recorder.take(3, static_cast<std::uint32_t>(step), step == steps, violated, {q, v, tau});
    }
    const FrameLog log = recorder.hand_over(3, failed);
    out.clear();
    for (std::size_t i = 0; i < log.size(); ++i) {
      const TelemetryFrame frame = log[i];
      const double step = frame.q.at(0);
      EXPECT_EQ(frame.time, step * 1e-3);
      EXPECT_THAT(frame.q, ElementsAre(step, step));
      EXPECT_THAT(frame.v, ElementsAre(step));
      EXPECT_THAT(frame.tau, ElementsAre(step));
      out.push_back(static_cast<int>(step));
    }
  }
  return out;
}

// Claim: `all` keeps every k-th step and the last one, of every trace; `failures` of failures only.
TEST(Telemetry, EveryKthStep) {
  EXPECT_THAT(kept({.telemetry = Telemetry::all, .every = 4}, 10, 0, false), ElementsAre(0, 4, 8, 10));
  EXPECT_THAT(kept({.telemetry = Telemetry::all, .every = 4}, 10, 6, true), ElementsAre(0, 4, 8, 10));
  EXPECT_THAT(kept({.telemetry = Telemetry::failures, .every = 5}, 10, 0, true), ElementsAre(0, 5, 10));
  EXPECT_THAT(kept({.telemetry = Telemetry::failures, .every = 5}, 10, 0, false), IsEmpty());
}

// Claim: `last` keeps the last seconds before a failure, both ends included, and nothing of a success. A trace that
// goes on after its violation keeps what came before it.
TEST(Telemetry, TheLastSecondsBeforeAFailure) {
  const Recording recording{.telemetry = Telemetry::last, .every = 1, .last = 3e-3};
  EXPECT_THAT(kept(recording, 10, 0, true), ElementsAre(7, 8, 9, 10));
  EXPECT_THAT(kept(recording, 10, 6, true), ElementsAre(3, 4, 5, 6));
  EXPECT_THAT(kept(recording, 2, 0, true), ElementsAre(0, 1, 2));
  EXPECT_THAT(kept(recording, 10, 0, false), IsEmpty());
  // Every fourth step, and the failure itself though it is not due.
  EXPECT_THAT(kept({.telemetry = Telemetry::last, .every = 4, .last = 8e-3}, 30, 22, true), ElementsAre(16, 20, 22));
  EXPECT_THAT(kept({.telemetry = Telemetry::last, .every = 4, .last = 8e-3}, 24, 0, true), ElementsAre(16, 20, 24));
}

// Claim: the command line chooses what is kept; outcomes and digests do not depend on it.
TEST(Telemetry, IsChosenOnTheCommandLine) {
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  const auto run = [&](const std::string& options, const std::string& name) {
    const testing::Result result = testing::graze(folder.path(), "run ball.yaml -n 30 --quiet -o " + name + options);
    ASSERT_EQ(result.code, 0) << result.err;
  };
  run("", "none.h5");
  run(" --telemetry all --every 10", "all.h5");
  run(" --last '5 ms' --every 1", "last.h5");
  const Archive none(folder / "none.h5"), all(folder / "all.h5"), last(folder / "last.h5");
  const TraceTable table = table_of(none, "still");
  EXPECT_EQ(table.digest, table_of(all, "still").digest);
  EXPECT_EQ(table.digest, table_of(last, "still").digest);
  int failures = 0, successes = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const bool failed = table.outcome[i] != Outcome::success;
    ++(failed ? failures : successes);
    const std::uint32_t id = table.particle[i];
    EXPECT_THAT(none.telemetry("still", id), IsEmpty());
    const auto frames = all.telemetry("still", id);
    EXPECT_EQ(frames.size(), static_cast<std::size_t>(table.end_time[i] * 100 + 1e-6) + 1);
    EXPECT_EQ(last.telemetry("still", id).size(), failed ? 6u : 0u);
  }
  EXPECT_GT(failures, 0);
  EXPECT_GT(successes, 0);
  EXPECT_THAT(testing::graze(folder.path(), "run ball.yaml --telemetry all --last '1 s'").err,
              HasSubstr("--last 1 s: is for --telemetry last, not all"));
  EXPECT_THAT(testing::graze(folder.path(), "run ball.yaml --last nonsense").err, HasSubstr("record.last: nonsense"));
}

}  // namespace
}  // namespace graze
