// Claim: score --json, the table that score prints, report --json, explain --json, and h5py with pandas alone agree
// exactly on counts, rates, intervals, margins' quantiles and failure classes (same_numbers.py); of a campaign with
// several policies and every kind of outcome, and of one that was interrupted.
#include <gtest/gtest.h>

#include "tests/jobs/striking_balls.h"

namespace graze {
namespace {

class SameNumbers : public ::testing::Test {
 protected:
  testing::TemporaryFolder folder;

  void SetUp() override {
    if (testing::shell(folder.path(), "/usr/bin/python3 -c 'import h5py, pandas'").code != 0) {
      GTEST_SKIP() << "no Python with h5py and pandas";
    }
    testing::write_striking_balls(folder);
  }

  Scenario scenario() const {
    ScenarioOptions options;
    options.overrides = {{"task.measures.beside", "{position: {link: ball, y: {above: -5 cm}}}"}};
    return load_scenario((folder / "ball.yaml").string(), options);
  }

  void outputs(const std::string& verb, const std::string& file, int code) const {
    const testing::Result run = testing::graze(folder.path(), verb);
    EXPECT_EQ(run.code, code) << verb << run.err;
    testing::write_file(folder / file, run.out);
  }

  void agree(int code) const {
    ASSERT_EQ(testing::graze(folder.path(), "pack a.graze").code, 0);
    outputs("score a.h5 --json", "score.json", code);
    outputs("score a.h5", "score.txt", code);
    outputs("report a.h5 --json --replays 1 --trajectories 2", "report.json", code);
    outputs("explain a.h5 --json", "explain.json", code);
    const testing::Result run = testing::shell(
        folder.path(), "/usr/bin/python3 '" GRAZE_SOURCE_DIR
                       "/tests/jobs/same_numbers.py' a.h5 score.json report.json explain.json score.txt");
    EXPECT_EQ(run.code, 0) << run.out << run.err;
  }
};

/// Outcomes of the balls, but that policies differ: under "other" every seventh trace is invalid, under "third" every
/// fifth success violates the requirement instead.
void make_policies_differ(TraceRecord& trace, int policy) {
  if (policy == 1 && trace.particle % 7 == 3) {
    trace.outcome = Outcome::invalid;
    trace.violated = -1;
    trace.invalid_reason = "planted";
  }
  if (policy == 2 && trace.particle % 5 == 2 && trace.outcome == Outcome::success) {
    trace.outcome = Outcome::known_failure;
    trace.violated = 0;
    trace.margins[0] = -0.01;
    trace.first_violations[0] = 0.2;
  }
}

TEST_F(SameNumbers, OfSeveralPolicies) {
  testing::write_part(folder / "a.graze", scenario(), 60, 60, make_policies_differ);
  agree(0);
}

TEST_F(SameNumbers, OfAnIncompleteCampaign) {
  testing::write_part(folder / "a.graze", scenario(), 24, 40, make_policies_differ);
  agree(3);
}

}  // namespace
}  // namespace graze
