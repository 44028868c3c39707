// Claim: whichever thread cannot be started, nor any after it, a campaign ends: with all traces, by the threads that
// there are, or with a message that says what is lacking, and resume makes of the rest what it was to be.
#include <gmock/gmock.h>

#include "tests/faults/stage.h"

namespace graze::faults {
namespace {

using testing::Digests;
using ::testing::HasSubstr;

TEST(Threads, NoneIsWaitedForThatCannotBeStarted) {
  const Stage stage;
  const std::string verb = "run ball.yaml -n 40 --threads 2 -o a.graze";
  const long threads = stage.must(verb).threads;
  ASSERT_GE(threads, 3) << "two simulate, one writes";
  const Digests digests = stage.whole("a.graze");
  ASSERT_FALSE(digests.empty());
  int whole = 0;
  Plan plan;
  for (plan.thread = 1; plan.thread <= threads; ++plan.thread) {
    fs::remove_all(stage / "a.graze");
    const Outcome outcome = run(stage.folder(), verb, plan);
    SCOPED_TRACE("thread " + std::to_string(plan.thread) + " of " + std::to_string(threads) + ": exit code " +
                 std::to_string(outcome.code) + "\n" + outcome.err);
    if (outcome.code == 0) {
      ++whole;
    } else {
      EXPECT_EQ(outcome.code, 3);
      EXPECT_THAT(outcome.err, HasSubstr("lets no further thread be started (ulimit -u)"));
      stage.must((fs::exists(stage / "a.graze/campaign.h5") ? "resume a.graze" : verb) + " --quiet");
    }
    EXPECT_EQ(stage.whole("a.graze"), digests);
  }
  EXPECT_GE(whole, 1) << "one thread that simulates is enough";
}

}  // namespace
}  // namespace graze::faults
