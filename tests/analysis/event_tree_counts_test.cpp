// Event trees of random stories: what their nodes and branches count is counted again from the traces.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "analysis/event_tree.h"
#include "tests/archive/synthetic.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

struct Walker {
  Outcome outcome = Outcome::success;
  int violated = -1;
  double end = 2;
  std::vector<ContactPhase> phases = {};
};

ContactPhase step_of(int a, int b, double begin, double impulse) {
  ContactPhase out;
  out.a = a;
  out.b = b;
  out.begin = begin;
  out.end = begin + 0.05;
  out.impulse = impulse;
  return out;
}

Stories walkers_tell(const std::vector<Walker>& walkers) {
  StoryRules rules;
  rules.light = 0;
  StoryTeller teller({"walk"}, rules, 1e-3);
  for (std::uint32_t i = 0; i < walkers.size(); ++i) {
    const Walker& one = walkers[i];
    teller.add(0, i, one.outcome, one.violated, one.end, one.phases);
  }
  return std::move(teller.take().at(0));
}

/// Two feet (0, 1) on a ground (3); the second contact of foot 0 is with a curb (4) in half of them, which fail more
/// often, by either of two requirements or an unmet objective; a tenth is cut off before.
std::vector<Walker> curb_walkers(std::uint64_t seed, std::size_t n) {
  std::mt19937_64 random(seed);
  std::vector<Walker> out(n);
  for (Walker& one : out) {
    const bool strikes = random() % 2 == 0, cut = random() % 10 == 0;
    const auto impulse = [&] { return 0.5 + 0.001 * static_cast<double>(random() % 1000); };
    const double jitter = 1e-4 * static_cast<double>(random() % 100);
    one.phases = {step_of(0, 3, 0.2 + jitter, impulse()), step_of(1, 3, 0.6 + jitter, impulse())};
    if (cut) {
      one.outcome = Outcome::known_failure;
      one.violated = 1;
      one.end = 0.8;
      continue;
    }
    one.phases.push_back(step_of(0, strikes ? 4 : 3, 1.0 + jitter, impulse()));
    if (random() % 10 < (strikes ? 8u : 1u)) {
      const unsigned kind = static_cast<unsigned>(random() % 3);
      one.outcome = kind == 2 ? Outcome::unknown_failure : Outcome::known_failure;
      if (kind < 2) one.violated = static_cast<int>(kind);
    }
  }
  return out;
}

/// The k-th contact of a part in a trace, or none.
const ContactPhase* contact_of(const Walker& walker, int part, std::size_t k) {
  for (const ContactPhase& phase : walker.phases) {
    if ((phase.a == part || phase.b == part) && k-- == 0) return &phase;
  }
  return nullptr;
}

// Claim: the branches of a node part the traces that come to it: each in one, by what its part touches next, with its
// end; who was cut off before stands in a branch of its own, last. Times and impulses are quantiles of those contacts.
TEST(EventTreeCounts, BranchesPartTheTraces) {
  for (const bool kinds : {false, true}) {
    const std::vector<Walker> walkers = curb_walkers(191, 400);
    EventTreeRules rules;
    rules.kinds = kinds;
    const EventTree tree = event_tree(walkers_tell(walkers), {0, 1}, 2, 2, rules);
    ASSERT_FALSE(tree.nodes.empty());
    EXPECT_EQ(tree.kinds, kinds);
    EXPECT_EQ(tree.all.n, 400u);
    const EventNode& node = tree.nodes[0];
    EXPECT_EQ(node.part, 0);
    ASSERT_THAT(node.past, SizeIs(1));
    std::set<std::size_t> seen;
    for (const EventBranch& branch : node.branches) {
      OutcomeCounts wanted(2);
      std::vector<double> times, impulses;
      for (const std::size_t i : branch.traces) {
        EXPECT_TRUE(seen.insert(i).second) << "in two branches";
        const Walker& one = walkers[i];
        ++wanted.n;
        wanted.success += one.outcome == Outcome::success;
        wanted.unknown += one.outcome == Outcome::unknown_failure;
        if (one.violated >= 0) ++wanted.violated[static_cast<std::size_t>(one.violated)];
        const ContactPhase* next = contact_of(one, 0, 1);
        EXPECT_EQ(next == nullptr, branch.kind == EventBranch::Kind::cut);
        if (next == nullptr) continue;
        EXPECT_EQ(branch.word, static_cast<std::uint32_t>(next->b) << 8);
        times.push_back(static_cast<float>(next->begin));
        impulses.push_back(static_cast<float>(next->impulse));
      }
      EXPECT_EQ(branch.outcomes.n, wanted.n);
      EXPECT_EQ(branch.outcomes.success, wanted.success);
      EXPECT_EQ(branch.outcomes.unknown, wanted.unknown);
      EXPECT_EQ(branch.outcomes.violated, wanted.violated);
      if (times.empty()) continue;
      EXPECT_EQ(branch.time.median, quantiles(times).median);
      EXPECT_EQ(branch.impulse.low, quantiles(impulses).low);
      EXPECT_EQ(branch.impulse.high, quantiles(impulses).high);
    }
    EXPECT_EQ(seen.size(), 400u);
    EXPECT_EQ(node.branches.back().kind, EventBranch::Kind::cut);
    EXPECT_GE(node.branches[0].outcomes.n, node.branches[1].outcomes.n);
  }
}

// Claim: a node's information is the mutual information of branch and class over what there is to know, here from the
// counts of its branches, without those that were cut off in the first and with them in the second.
TEST(EventTreeCounts, InformationIsMutual) {
  const std::vector<Walker> walkers = curb_walkers(192, 500);
  const EventTree tree = event_tree(walkers_tell(walkers), {0, 1}, 2, 2);
  ASSERT_FALSE(tree.nodes.empty());
  const auto nats = [](double a, double b) {
    double out = 0;
    for (const double x : {a, b}) out -= x > 0 ? x * std::log(x / (a + b)) : 0;
    return out;  // times how many there are
  };
  double within = 0, success = 0, failure = 0, all_success = 0, all_failure = 0;
  for (const EventBranch& branch : tree.nodes[0].branches) {
    const auto s = static_cast<double>(branch.outcomes.success), f = static_cast<double>(branch.outcomes.n) - s;
    all_success += s, all_failure += f;
    if (branch.kind == EventBranch::Kind::cut) continue;
    within += nats(s, f);
    success += s, failure += f;
  }
  const double wanted = (nats(success, failure) - within) / nats(all_success, all_failure);
  EXPECT_NEAR(tree.nodes[0].information, wanted, 1e-9);
  EXPECT_GT(wanted, 0.2);
}

// Claim: fewer traces than a branch takes part nothing; a branch of fewer is put together with others of them; the
// depth that is allowed is kept, and none at all leaves the tree bare.
TEST(EventTreeCounts, RulesAreKept) {
  std::vector<Walker> walkers = curb_walkers(193, 300);
  for (std::size_t i = 0; i < 3; ++i) walkers[i].phases = {step_of(0, 3, 0.2, 1), step_of(0, 2, 1.0, 1)};
  for (std::size_t i = 3; i < 6; ++i) walkers[i].phases = {step_of(0, 3, 0.2, 1), step_of(0, 1, 1.0, 1)};
  for (std::size_t i = 0; i < 6; ++i)
    walkers[i].end = 2, walkers[i].outcome = Outcome::success, walkers[i].violated = -1;
  const Stories stories = walkers_tell(walkers);
  const EventTree tree = event_tree(stories, {0}, 2, 2);
  ASSERT_FALSE(tree.nodes.empty());
  const auto rare = std::find_if(tree.nodes[0].branches.begin(), tree.nodes[0].branches.end(),
                                 [](const EventBranch& b) { return b.kind == EventBranch::Kind::others; });
  ASSERT_NE(rare, tree.nodes[0].branches.end());
  EXPECT_THAT(rare->traces, UnorderedElementsAre(0, 1, 2, 3, 4, 5));
  EventTreeRules rules;
  rules.depth = 0;
  EXPECT_TRUE(event_tree(stories, {0}, 2, 2, rules).nodes.empty());
  rules.depth = 1;
  for (const EventNode& node : event_tree(stories, {0}, 2, 2, rules).nodes) EXPECT_EQ(node.depth, 0);
  rules.fewest = 151;
  EXPECT_TRUE(event_tree(stories, {0}, 2, 2, rules).nodes.empty()) << "300 traces, and it takes 302";
  EXPECT_TRUE(event_tree(Stories{}, {0}, 2, 2).nodes.empty());
  EXPECT_TRUE(event_tree(walkers_tell({Walker{}}), {0}, 2, 2).nodes.empty());
}

// Claim: whichever of two parts is followed first, and in whatever order the traces come, the same bifurcation is
// found.
TEST(EventTreeCounts, OrderDoesNotMatter) {
  std::vector<Walker> walkers = curb_walkers(194, 300);
  const EventTree one = event_tree(walkers_tell(walkers), {0, 1}, 2, 2);
  std::mt19937_64 random(195);
  std::shuffle(walkers.begin(), walkers.end(), random);
  const EventTree other = event_tree(walkers_tell(walkers), {1, 0}, 2, 2);
  ASSERT_EQ(one.nodes.size(), other.nodes.size());
  ASSERT_FALSE(one.nodes.empty());
  EXPECT_EQ(one.nodes[0].part, other.nodes[0].part);
  EXPECT_EQ(one.nodes[0].past, other.nodes[0].past);
  EXPECT_EQ(one.nodes[0].time, other.nodes[0].time);
  EXPECT_DOUBLE_EQ(one.nodes[0].p_value, other.nodes[0].p_value);
  EXPECT_NEAR(one.nodes[0].information, other.nodes[0].information, 1e-12);
}

// Claim: rates of ends and their intervals are those of the counts; none has none.
TEST(EventTreeCounts, RatesOfEnds) {
  OutcomeCounts counts(2);
  EXPECT_TRUE(std::isnan(counts.rate()));
  EXPECT_EQ(counts.interval().high, 1);
  Story story;
  story.outcome = Outcome::success;
  for (int i = 0; i < 3; ++i) counts.add(story);
  story.outcome = Outcome::known_failure;
  story.violated = 1;
  counts.add(story);
  EXPECT_EQ(counts.rate(), 0.75);
  EXPECT_EQ(counts.interval().low, clopper_pearson(3, 4).low);
  EXPECT_THAT(counts.violated, ElementsAre(0, 1));
}

// Claim: parts that move are those of links, also of a link's second shape ("LF_FOOT.1"), and no part of the world, nor
// one whose name only begins like a link's.
TEST(EventTreeCounts, MovingParts) {
  CampaignInfo info = synthetic::info();
  info.links = {"FOOT", "BODY"};
  info.colliders = {"FOOT", "ground", "FOOT.1", "FOOT.side", "BODY", "FOOTPRINT", "BODY.12", "BOD", "FOOT.1x"};
  EXPECT_THAT(moving_parts(info), ElementsAre(0, 2, 4, 6));
}

}  // namespace
}  // namespace graze
