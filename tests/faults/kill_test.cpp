// Claim: whenever the program is killed, in whatever verb, nothing that was finished is lost: what was in shards stays
// there, bit for bit, and `resume` (or, where nothing was finished, `run`) makes of the rest what it was to be.
#include <gmock/gmock.h>

#include <random>

#include "tests/faults/stage.h"

namespace graze::faults {
namespace {

using testing::Digests;

const std::string kOptions = " --quiet --threads 2 --watchdog 0 ";
const std::string kNew = "run ball.yaml -n 40 --seed 3 -o a.graze" + kOptions;

/// A chain of kills: each verb in turn begins, goes on with, or replaces one campaign, and is killed.
class Kills : public ::testing::Test {
 protected:
  Kills() {
    stage.must(kNew);
    fresh = stage.whole("a.graze");
    put({}, stage / "a.graze");
    fs::remove(stage / "a.graze");
    stage.must("run ball.yaml -n 40 --seed 4 -o a.graze" + kOptions);
    old = stage.whole("a.graze");
    campaign = tree_of(stage / "a.graze");
    put({}, stage / "a.graze");
    fs::remove(stage / "a.graze");
  }

  static Tree shards(const Tree& tree) {
    Tree out;
    for (const auto& [name, content] : tree) {
      if (name.rfind("shards/", 0) == 0 && name.ends_with(".h5")) out[name] = content;
    }
    return out;
  }

  /// A verb that is killed, at a call that concerns files or after some time; gives whether it was.
  bool killed(const std::string& arguments, long at, long microseconds) {
    Plan plan;
    plan.what = What::kill;
    plan.at = at;
    plan.kill_after = microseconds;
    const Outcome outcome = run(stage.folder(), arguments, plan);
    // What reads shards for it may be killed alone.
    const bool reader = outcome.code == 3 && outcome.err.find("was killed (SIGKILL)") != std::string::npos;
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 128 + SIGKILL || reader)
        << arguments << ": " << outcome.code << outcome.err;
    return outcome.code != 0;
  }

  /// What is in the campaign's folder after a kill has all shards that were there before.
  void expect_kept(const Tree& before) const {
    const Tree now = shards(tree_of(stage / "a.graze"));
    bool kept = true;
    for (const auto& [name, content] : before) kept = kept && now.count(name) && now.at(name) == content;
    EXPECT_TRUE(kept) << "a finished shard was lost";
  }

  /// The campaign in the end.
  void expect_whole(const std::vector<Digests>& wanted) const {
    const Outcome resumed = run(stage.folder(), "resume a.graze" + kOptions);
    if (resumed.code != 0) {
      EXPECT_EQ(wanted.size(), 1u) << "there was a whole campaign before: " << resumed.err;
      const Outcome again = run(stage.folder(), kNew);
      EXPECT_EQ(again.code, 0) << resumed.err << again.err;
    }
    EXPECT_TRUE(std::count(wanted.begin(), wanted.end(), stage.whole("a.graze"))) << "another campaign came out";
  }

  /// One campaign that is killed several times.
  void round(int number, long calls, double seconds) {
    const bool replaces = number % 2 == 1, by_call = number % 4 < 2;
    fs::remove_all(stage / "a.graze");
    if (replaces) put(campaign, stage / "a.graze");
    const auto at = [&] { return by_call ? 1 + static_cast<long>(random() % static_cast<unsigned long>(calls)) : 0; };
    const auto when = [&] {
      return by_call ? -1 : static_cast<long>(random() % static_cast<unsigned long>(seconds * 1e6));
    };
    kills += killed(replaces ? kNew + "--force" : kNew, at(), when());
    for (int again = 0; again < 3 && fs::exists(stage / "a.graze/campaign.h5"); ++again) {
      const Tree before = shards(tree_of(stage / "a.graze"));
      kills += killed("resume a.graze" + kOptions, at(), when());
      if (!replaces) expect_kept(before);
    }
    expect_whole(replaces ? std::vector{fresh, old} : std::vector{fresh});
  }

  void torture(int wanted) {
    const auto begin = std::chrono::steady_clock::now();
    const long calls = stage.must(kNew).calls;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    for (int number = 0; kills < wanted && !HasFailure(); ++number) {
      SCOPED_TRACE("round " + std::to_string(number));
      ASSERT_LT(number, 4 * wanted) << "hardly anything was killed";
      round(number, calls, seconds);
    }
    std::printf("%d kills, none lost anything\n", kills);
  }

  Stage stage;
  Digests fresh, old;
  Tree campaign;
  std::mt19937 random{17};
  int kills = 0;
};

// Fewer with a sanitizer, under which a process takes ten times as long.
TEST_F(Kills, LoseNothing) { torture(long_tests() ? 10'000 : can_exhaust_memory() ? 300 : 30); }

}  // namespace
}  // namespace graze::faults
