// Claim: whenever the power fails, a shard that was promised (synced, under a name that was synced) is there
// afterwards, and `resume` makes of what is there the campaign that was to be; where nothing had been promised, `run`
// does. Of a campaign that --force replaces, it or the new one is there.
#include <gmock/gmock.h>

#include <set>

#include "tests/faults/disk.h"

namespace graze::faults {
namespace {

using testing::Digests;
using Luck = Disk::Luck;

const std::string kRunTwice = "run ball.yaml --threads 1 --quiet ";

/// A run of a verb, and what a cut must leave.
struct Case {
  std::string name;
  std::vector<std::string> before;  // verbs that make what is there, all of it safe
  std::string arguments;
  std::string resume;           // what goes on afterwards
  std::vector<Digests> wanted;  // what may come out: the new campaign, or the old one
};

/// Shards of a.graze, in the state in which all that is not promised is lost.
Tree promised_shards(const Disk& disk, std::mt19937& random) {
  Tree out;
  for (const auto& [name, content] : disk.after_power_cut(Luck::none, random)) {
    if (name.rfind("a.graze/shards/", 0) == 0 && name.size() > 3 && name.substr(name.size() - 3) == ".h5") {
      out[name] = content;
    }
  }
  return out;
}

class Power : public ::testing::Test {
 protected:
  Digests reference(const std::string& arguments) const {
    const Stage alone;
    alone.must(kRunTwice + "-o r.graze " + arguments);
    return alone.whole("r.graze");
  }

  /// Mends what a power cut has left, as a user would, and looks at it.
  void judge(const Case& test, const Tree& left, const Tree& promised) const {
    const Stage after;
    put(left, after.folder());
    const Outcome resumed = run(after.folder(), test.resume);
    if (resumed.code != 0) {
      EXPECT_TRUE(promised.empty()) << "a shard had been promised: " << resumed.err;
      ASSERT_TRUE(test.before.empty()) << "there was a whole campaign before: " << resumed.err;
      EXPECT_EQ(resumed.code, 2) << resumed.err;
      EXPECT_THAT(resumed.err, ::testing::HasSubstr("graze: a.graze: "));
      const Outcome again = run(after.folder(), test.arguments);
      EXPECT_EQ(again.code, 0) << "resume: " << resumed.err << "\nrun: " << again.err;
    }
    const Digests now = after.whole("a.graze");
    EXPECT_TRUE(std::count(test.wanted.begin(), test.wanted.end(), now)) << "another campaign came out";
    if (promised.empty()) return;
    const Tree tree = tree_of(after.folder());
    bool all = true;
    for (const auto& [name, content] : promised) all = all && tree.count(name) && tree.at(name) == content;
    EXPECT_TRUE(all || (!test.before.empty() && now == test.wanted.front())) << "a promised shard was lost";
  }

  void cut_everywhere(const Case& test, int moments, int tosses) const {
    const Stage stage;
    for (const std::string& arguments : test.before) stage.must(arguments);
    Disk disk(stage.folder());
    Plan plan;
    plan.what = What::record;
    const Outcome outcome = run(stage.folder(), test.arguments, plan);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    ASSERT_GT(outcome.changes.size(), 20u);
    std::mt19937 random(5);
    std::set<Tree> seen;
    long states = 0;
    const auto chosen = some_of(static_cast<long>(outcome.changes.size()), moments);
    for (std::size_t i = 0; i < outcome.changes.size(); ++i) {
      disk.apply(outcome.changes[i]);
      if (!std::binary_search(chosen.begin(), chosen.end(), static_cast<long>(i) + 1)) continue;
      const Tree promised = promised_shards(disk, random);
      std::vector<Luck> luck = {Luck::none, Luck::all, Luck::names, Luck::zeros};
      for (int k = 0; k < tosses; ++k) luck.insert(luck.end(), {Luck::in_order, Luck::any});
      for (const Luck one : luck) {
        const Tree left = disk.after_power_cut(one, random);
        if (!seen.insert(left).second) continue;
        ++states;
        SCOPED_TRACE(test.name + ": the power fails after change " + std::to_string(i + 1) + " of " +
                     std::to_string(outcome.changes.size()) + ", luck " + std::to_string(static_cast<int>(one)) +
                     ", state " + std::to_string(states));
        judge(test, left, promised);
        if (HasFatalFailure()) return;
      }
    }
    RecordProperty("states", static_cast<int>(states));
    std::printf("%s: %ld states of the disk after %zu changes\n", test.name.c_str(), states, outcome.changes.size());
    EXPECT_EQ(disk.after_power_cut(Luck::all, random) == tree_of(stage.folder()), true) << "the record is not whole";
  }
};

TEST_F(Power, FailsInARun) {
  const Digests wanted = reference("-n 16");
  cut_everywhere({"run", {}, kRunTwice + "-n 16 -o a.graze", "resume a.graze --quiet --threads 1", {wanted}}, 16, 2);
}

TEST_F(Power, FailsWhileACampaignIsReplaced) {
  const Digests before = reference("-n 16"), wanted = reference("-n 16 --seed 3");
  cut_everywhere({"run --force",
                  {kRunTwice + "-n 16 -o a.graze"},
                  kRunTwice + "-n 16 --seed 3 --force -o a.graze",
                  "resume a.graze --quiet --threads 1",
                  {wanted, before}},
                 16, 2);
}

TEST_F(Power, FailsInAResume) {
  const Digests wanted = reference("-n 24");
  cut_everywhere({"resume",
                  {kRunTwice + "-n 16 -o a.graze"},
                  "resume a.graze -n 24 --quiet --threads 1",
                  "resume a.graze -n 24 --quiet --threads 1",
                  {wanted}},
                 16, 2);
}

}  // namespace
}  // namespace graze::faults
