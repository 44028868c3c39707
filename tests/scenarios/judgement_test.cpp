// Claim: an objective of any shape is met as its parts say, judged here by a recursion over all that a trace went
// through; its culprit is the leaf that decides; the range of a tree is the least and greatest that its leaves allow;
// windows open where a step falls into them.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "sampling/constants.h"
#include "scenarios/task_range.h"
#include "tests/scenarios/task_bench.h"

namespace graze {
namespace {

using Kind = Objective::Kind;

/// A predicate of the base's height or place, with what decides it.
struct Predicate {
  Kind kind = Kind::at_end;
  int axis = 0;
  double above = 0;
  Window window;
  std::vector<Predicate> parts;
};

class Judgements : public testing::TaskBench {
 protected:
  double number() { return random_() / 4294967296.0; }

  Predicate grown(int depth) {
    Predicate out;
    const int choice = static_cast<int>(random_() % (depth > 0 ? 6 : 3));
    if (choice >= 3) {
      out.kind = choice == 3 ? Kind::all : choice == 4 ? Kind::any : Kind::negation;
      const int parts = choice == 5 ? 1 : 1 + static_cast<int>(random_() % 3);
      for (int i = 0; i < parts; ++i) out.parts.push_back(grown(depth - 1));
      return out;
    }
    out.kind = choice == 0 ? Kind::at_end : choice == 1 ? Kind::always : Kind::once;
    out.axis = static_cast<int>(random_() % 3);
    out.above = 2 * number() - 1;
    if (out.kind != Kind::at_end && random_() % 2) out.window = {2 + 5 * number(), 8 + 3 * number()};
    return out;
  }

  static std::string yaml_of(const Predicate& one) {
    if (one.parts.empty()) {
      std::string out = fmt::format("{{position: {{link: base, {}: {{above: {:.17g}}}}}", "xyz"[one.axis], one.above);
      if (one.kind == Kind::always) out += ", always: true";
      if (one.kind == Kind::once) out += ", once: true";
      if (std::isfinite(one.window.to))
        out += fmt::format(", window: [{:.17g}, {:.17g}]", one.window.from, one.window.to);
      return out + "}";
    }
    if (one.kind == Kind::negation) return "{not: " + yaml_of(one.parts[0]) + "}";
    std::string list;
    for (const Predicate& part : one.parts) list += (list.empty() ? "" : ", ") + yaml_of(part);
    return fmt::format("{{{}: [{}]}}", one.kind == Kind::all ? "all" : "any", list);
  }

  static double judged(const Predicate& one, const std::vector<Vec3>& way) {
    if (one.kind == Kind::negation) return -judged(one.parts[0], way);
    const bool greatest = one.kind == Kind::any || one.kind == Kind::once;
    std::vector<double> values;
    for (const Predicate& part : one.parts) values.push_back(judged(part, way));
    if (one.parts.empty() && one.kind == Kind::at_end) return way.back()[one.axis] - one.above;
    for (std::size_t t = 0; one.parts.empty() && t < way.size(); ++t) {
      const double time = static_cast<double>(t);
      if (time >= one.window.from && time <= one.window.to) values.push_back(way[t][one.axis] - one.above);
    }
    return greatest ? *std::max_element(values.begin(), values.end()) : *std::min_element(values.begin(), values.end());
  }

  static void leaves_of(const Predicate& one, const std::vector<Vec3>& way, std::vector<double>& out) {
    if (one.parts.empty()) out.push_back(judged(one, way));
    for (const Predicate& part : one.parts) leaves_of(part, way, out);
  }

  std::mt19937 random_{17};
};

TEST_F(Judgements, OfRandomTreesAgreeWithARecursion) {
  for (int tree = 0; tree < 80; ++tree) {
    const Predicate predicate = grown(3);
    const Task t = task("objective: " + yaml_of(predicate));
    TaskMonitor monitor(t), continued(t);
    monitor.start(kLane, model_);
    continued.start(kLane, model_);
    std::vector<Vec3> way;
    const int carried = static_cast<int>(random_() % 13);
    TaskMonitor* judge = &monitor;
    for (int time = 0; time <= 12; ++time) {
      way.emplace_back(2 * number() - 1, 2 * number() - 1, 2 * number() - 1);
      q_.segment<3>(4) = way.back();
      judge->update(input(time));
      if (time != carried) continue;
      LaneTape written;
      monitor.carry(kLane, written);
      const LaneTape::Content content = written.take();
      LaneTape read(content);
      continued.carry(kLane, read);
      read.end();
      judge = &continued;
    }
    judge->finish(input(12));
    const double right = judged(predicate, way);
    EXPECT_NEAR(judge->objective_margin(kLane), right, 1e-14) << yaml_of(predicate);
    EXPECT_EQ(judge->objective_met(kLane), right >= 0) << yaml_of(predicate);
    std::vector<double> leaf_margins;
    leaves_of(predicate, way, leaf_margins);
    ASSERT_EQ(leaf_margins.size(), leaves(t.objective).size());
    const int culprit = judge->objective_culprit(kLane).leaf;
    ASSERT_GE(culprit, 0);
    EXPECT_NEAR(std::abs(leaf_margins[static_cast<std::size_t>(culprit)]), std::abs(right), 1e-14);
  }
}

/// A tree of nodes with ranges alone.
Objective ranged(std::mt19937& random, int depth) {
  const auto number = [&] { return 4 * (random() / 4294967296.0) - 2; };
  Objective out;
  const int choice = depth > 0 ? static_cast<int>(random() % 4) : 3;
  if (choice == 3) {
    const double a = number(), b = number();
    out.range = {std::min(a, b), std::max(a, b), fmt::format("{:.6f}", a), random() % 2 == 0};
    if (random() % 5 == 0) out.range.high = kInfinity;
    if (random() % 5 == 0) out.range.low = -kInfinity;
    return out;
  }
  out.kind = choice == 0 ? Kind::all : choice == 1 ? Kind::any : Kind::negation;
  for (int i = choice == 2 ? 1 : 3; i > 0; --i) out.parts.push_back(ranged(random, depth - 1));
  out.range = range_of_parts(out);
  return out;
}

/// The margin of a tree whose leaves are all as great as they can be, or as small; under a `not` the other way.
double extreme(const Objective& node, bool high) {
  if (node.parts.empty()) return high ? node.range.high : node.range.low;
  if (node.kind == Kind::negation) return -extreme(node.parts[0], !high);
  double out = node.kind == Kind::any ? -kInfinity : kInfinity;
  for (const Objective& part : node.parts) {
    out = node.kind == Kind::any ? std::max(out, extreme(part, high)) : std::min(out, extreme(part, high));
  }
  return out;
}

bool has_reason(const Objective& node, const WitnessRange& range) {
  if (node.parts.empty()) return node.range.why == range.why && node.range.of_nominal == range.of_nominal;
  return std::any_of(node.parts.begin(), node.parts.end(), [&](const auto& part) { return has_reason(part, range); });
}

TEST(TaskRanges, OfTreesAreThoseOfTheirCorners) {
  std::mt19937 random(2);
  int never = 0, always = 0;
  for (int i = 0; i < 400; ++i) {
    const Objective tree = ranged(random, 3);
    EXPECT_EQ(tree.range.low, extreme(tree, false));
    EXPECT_EQ(tree.range.high, extreme(tree, true));
    EXPECT_TRUE(has_reason(tree, tree.range)) << "a reason is that of one of its leaves";
    never += tree.range.never_holds();
    always += tree.range.always_holds();
  }
  EXPECT_GT(never, 20);
  EXPECT_GT(always, 20);
}

// The reason of an `all` that never holds is its part that never holds, and of one that always holds its worst part.
TEST(TaskRanges, TellWhoDecides) {
  const auto leaf = [](double low, double high, const char* why) {
    Objective out;
    out.range = {low, high, why, std::string(why) == "b"};
    return out;
  };
  const auto why = [&](Kind kind, const std::vector<Objective>& parts) {
    Objective out;
    out.kind = kind;
    out.parts = parts;
    return range_of_parts(out).why;
  };
  EXPECT_EQ(why(Kind::all, {leaf(-5, 5, "a"), leaf(-2, -1, "b")}), "b");
  EXPECT_EQ(why(Kind::all, {leaf(1, 5, "a"), leaf(2, 9, "b")}), "a");
  EXPECT_EQ(why(Kind::any, {leaf(-5, -3, "a"), leaf(-9, -1, "b")}), "b") << "the best that there is";
  EXPECT_EQ(why(Kind::any, {leaf(1, 2, "a"), leaf(3, 4, "b")}), "b");
  EXPECT_EQ(why(Kind::negation, {leaf(1, 2, "a")}), "a");
  const WitnessRange late = unopened({2, 3}, false), never = unopened({2, 3}, true);
  EXPECT_EQ(late.low, kInfinity);
  EXPECT_EQ(never.high, -kInfinity);
  EXPECT_EQ(never.why, "no trace comes to its window [2, 3] s");
  EXPECT_TRUE(late.always_holds() && never.never_holds());
}

// A window opens if one of the times 0, step, 2 step, … end lies in it, as a loop over all of them finds.
TEST(TaskWindows, OpenAtSteps) {
  std::mt19937 random(9);
  const auto number = [&] { return random() / 4294967296.0; };
  int opened = 0;
  for (int i = 0; i < 3000; ++i) {
    const double step = 1e-3 * (1 + 9 * number());
    const long steps = 1 + static_cast<long>(random() % 40);
    const TraceTimes times{step, step * static_cast<double>(steps)};
    Window window;
    window.from = 1.3 * times.end * number();
    if (random() % 3 == 0) window.from = step * std::floor(window.from / step);
    window.to = window.from + (random() % 3 == 0 ? 0 : 2 * step * number());
    bool in = false;
    for (long k = 0; k <= steps; ++k) in = in || window.contains(static_cast<double>(k) * step);
    EXPECT_EQ(window.opens(times), in) << window.from << " to " << window.to << ", step " << step;
    opened += in;
  }
  EXPECT_GT(opened, 500);
  EXPECT_LT(opened, 2500);
  EXPECT_TRUE((Window{3, 3}).opens({0, 5})) << "any time at all";
  EXPECT_FALSE((Window{6, 7}).opens({0, 5}));
}

}  // namespace
}  // namespace graze
