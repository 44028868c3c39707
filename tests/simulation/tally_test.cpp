// Claims: what a prediction keeps of its traces is what all of them together give at once, in whatever blocks they
// come; its interval is Wilson's; the best candidate is the one that a sorted table has first; a unit that hangs is
// tried one particle at a time; frames read back; builds differ in what both know.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "simulation/build_facts.h"
#include "simulation/contained.h"
#include "simulation/prediction_tally.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double mean_of(const std::vector<double>& all) {
  return std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
}

double std_of(const std::vector<double>& all) {
  double squares = 0;
  for (const double x : all) squares += (x - mean_of(all)) * (x - mean_of(all));
  return std::sqrt(squares / static_cast<double>(all.size() - 1));
}

TEST(NumberSummaries, AreThoseOfTwoPasses) {
  std::mt19937 random(5);
  for (const double offset : {0.0, 1e6}) {
    std::vector<double> all(200);
    for (double& x : all) x = offset + random() / 4294967296.0;
    NumberSummary one_by_one, in_parts, nothing;
    for (const double x : all) one_by_one.add(x);
    for (std::size_t from = 0; from < all.size();) {
      NumberSummary part;
      const std::size_t to = std::min(all.size(), from + random() % 40);
      for (; from < to; ++from) part.add(all[from]);
      in_parts.add(part);
    }
    in_parts.add(nothing);
    for (const NumberSummary& one : {one_by_one, in_parts}) {
      EXPECT_EQ(one.count(), 200u);
      EXPECT_NEAR(one.mean(), mean_of(all), 1e-15 * (1 + offset));
      EXPECT_NEAR(one.std(), std_of(all), 1e-9) << "also where the mean is a million times as large";
      EXPECT_EQ(one.least(), *std::min_element(all.begin(), all.end()));
    }
  }
  NumberSummary one;
  EXPECT_TRUE(std::isnan(one.mean()) && std::isnan(one.std()) && std::isnan(one.least()));
  one.add(-3);
  EXPECT_EQ(one.mean(), -3);
  EXPECT_EQ(one.least(), -3);
  EXPECT_TRUE(std::isnan(one.std())) << "of one";
}

/// A layout of two requirements, a floating base at q[1] and two joints.
PredictionLayout a_layout() { return {2, 1, {4, 6}, 1e-3}; }

TraceRecord random_trace(std::mt19937& random, std::uint32_t particle) {
  const auto number = [&] { return random() / 4294967296.0; };
  TraceRecord out;
  out.particle = particle;
  out.outcome = static_cast<Outcome>(random() % 4);
  out.violated = out.outcome == Outcome::known_failure ? static_cast<int>(random() % 2) : -1;
  out.end_time = random() % 2 ? 3.0 : 1 + 1.9 * number();
  out.objective_margin = random() % 5 ? number() : kNone;
  out.margins = {number(), random() % 5 ? number() : std::numeric_limits<double>::infinity()};
  for (int i = 0; i < 7; ++i) out.q.push_back(number());
  if (out.outcome == Outcome::invalid) out.invalid_reason = "of " + std::to_string(particle);
  return out;
}

TEST(PredictionTallies, AreThoseOfAllTracesAtOnce) {
  std::mt19937 random(12);
  const PredictionLayout layout = a_layout();
  std::vector<TraceRecord> traces;
  for (std::uint32_t i = 0; i < 90; ++i) traces.push_back(random_trace(random, i));
  PredictionTally whole(layout), blocks(layout);
  for (const TraceRecord& one : traces) whole.add(layout, one, 1, 3);
  for (std::size_t from = 0; from < traces.size();) {
    PredictionTally block(layout);
    for (std::size_t left = 1 + random() % 8; left > 0 && from < traces.size(); --left)
      block.add(layout, traces[from++], 1, 3);
    blocks.add(block);
  }
  std::array<std::uint64_t, 4> outcomes{};
  std::vector<std::uint64_t> violated(2);
  std::vector<double> lasted, objective, margin;
  std::vector<std::vector<double>> at_the_end(5);
  std::vector<Outcome> by_particle;
  std::string reason;
  for (const TraceRecord& one : traces) {
    ++outcomes[static_cast<std::size_t>(one.outcome)];
    by_particle.push_back(one.outcome);
    if (reason.empty()) reason = one.invalid_reason;
    if (one.outcome == Outcome::invalid) continue;
    if (one.violated >= 0) ++violated[static_cast<std::size_t>(one.violated)];
    lasted.push_back(one.end_time - 1);
    if (std::isfinite(one.objective_margin)) objective.push_back(one.objective_margin);
    if (std::isfinite(one.margins[1])) margin.push_back(one.margins[1]);
    const std::size_t columns[] = {1, 2, 3, 4, 6};
    for (std::size_t k = 0; one.end_time == 3 && k < 5; ++k) at_the_end[k].push_back(one.q[columns[k]]);
  }
  const auto spread = [&](std::size_t from, std::size_t to) {
    double squares = 0;
    for (std::size_t k = from; k < to; ++k) squares += std_of(at_the_end[k]) * std_of(at_the_end[k]);
    return squares;
  };
  for (const PredictionTally& tally : {whole, blocks}) {
    const CandidatePrediction told = tally.told(layout, "walk");
    EXPECT_EQ(told.policy, "walk");
    EXPECT_EQ(told.outcomes, outcomes);
    EXPECT_EQ(told.by_particle, by_particle);
    EXPECT_EQ(told.violated, violated);
    EXPECT_EQ(told.invalid_reason, reason) << "of the first";
    EXPECT_NEAR(told.lasted.mean(), mean_of(lasted), 1e-13);
    EXPECT_NEAR(told.objective.std(), std_of(objective), 1e-13);
    EXPECT_EQ(told.objective.count(), objective.size()) << "without those that were never looked at";
    EXPECT_NEAR(told.margins[1].mean(), mean_of(margin), 1e-13);
    EXPECT_EQ(told.margins[1].count(), margin.size());
    EXPECT_DOUBLE_EQ(told.rate, static_cast<double>(outcomes[0]) / static_cast<double>(told.valid()));
    EXPECT_NEAR(told.place, std::sqrt(spread(0, 3)), 1e-12);
    EXPECT_NEAR(told.joints, std::sqrt(spread(3, 5) / 2), 1e-12) << "of the root mean square of the two";
  }
}

// Particles that cannot be made are invalid; the reason is that of the first invalid one.
TEST(PredictionTallies, CountWhatCannotBeMade) {
  const PredictionLayout fixed{0, -1, {}, 1e-3};
  PredictionTally tally(fixed);
  tally.add_unfabricated(0, "nothing");
  EXPECT_EQ(tally.told(fixed, "p").invalid_reason, "");
  tally.add_unfabricated(3, "first");
  tally.add_unfabricated(1, "second");
  const CandidatePrediction told = tally.told(fixed, "p");
  EXPECT_EQ(told.invalid_reason, "first");
  EXPECT_EQ(told.outcomes[3], 4u);
  EXPECT_EQ(told.by_particle.size(), 4u);
  EXPECT_TRUE(std::isnan(told.rate)) << "none is valid";
  EXPECT_EQ(told.low, 0);
  EXPECT_EQ(told.high, 1);
  EXPECT_TRUE(std::isnan(told.place) && std::isnan(told.joints)) << "of a base that is fixed and no joints";
}

// Wilson's bounds are the rates p that lie 1.96 of their own standard errors, sqrt(p (1 - p) / n), from what was seen.
TEST(PredictionTallies, HaveWilsonsInterval) {
  const PredictionLayout layout{0, -1, {}, 1e-3};
  const double z = 1.959963984540054;
  for (const int n : {1, 2, 10, 137}) {
    for (int k = 0; k <= n; k += std::max(1, n / 7)) {
      PredictionTally tally(layout);
      for (int i = 0; i < n; ++i) {
        TraceRecord trace;
        trace.outcome = i < k ? Outcome::success : Outcome::unknown_failure;
        trace.objective_margin = kNone;
        tally.add(layout, trace, 0, 1);
      }
      const CandidatePrediction told = tally.told(layout, "p");
      const double seen = static_cast<double>(k) / n;
      for (const double p : {told.low, told.high}) {
        if (p == 0 || p == 1) continue;
        EXPECT_NEAR(std::abs(p - seen), z * std::sqrt(p * (1 - p) / n), 1e-12) << k << " of " << n;
      }
      EXPECT_EQ(told.low == 0, k == 0) << k << " of " << n;
      EXPECT_EQ(told.high == 1, k == n) << k << " of " << n;
      EXPECT_LE(told.low, seen);
      EXPECT_GE(told.high, seen);
    }
  }
}

// The rate decides, of equal ones how long they lasted, then the objective; of all that is equal the first.
TEST(PredictionTallies, TheBestIsTheFirstOfASortedTable) {
  std::mt19937 random(9);
  for (int round = 0; round < 300; ++round) {
    std::vector<CandidatePrediction> all(1 + random() % 5);
    std::vector<std::array<double, 4>> table;  // what is best is greatest
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].outcomes[0] = random() % 4 ? 1 : 0;
      all[i].rate = static_cast<double>(random() % 3);
      const double lasted = static_cast<double>(random() % 2), objective = static_cast<double>(random() % 2) - 0.5;
      const bool known = random() % 3 > 0;
      all[i].lasted.add(lasted);
      if (known) all[i].objective.add(objective);
      if (all[i].valid() > 0) table.push_back({all[i].rate, lasted, known ? objective : -9, -static_cast<double>(i)});
    }
    const int right = table.empty() ? -1 : static_cast<int>(-(*std::max_element(table.begin(), table.end()))[3]);
    EXPECT_EQ(best_of(all), right);
  }
  EXPECT_EQ(best_of({}), -1);
}

Particle particle_of(std::uint32_t id) {
  Particle out;
  out.id = id;
  return out;
}

// Of several particles that hang together each is tried alone; one that was alone is left unfinished, and the next is
// next.
TEST(TakenOver, UnitsGoOnAlone) {
  WorkUnit unit;
  for (const std::uint32_t id : {7u, 8u, 9u}) unit.particles.push_back(particle_of(id));
  take_over(unit);
  EXPECT_TRUE(unit.alone);
  EXPECT_EQ(unit.next, 0u);
  EXPECT_THAT(unit.unfinished, IsEmpty());
  unit.next = 1;  // the first came to its end
  take_over(unit);
  ASSERT_EQ(unit.unfinished.size(), 1u);
  EXPECT_EQ(unit.unfinished[0].particle, 8u);
  EXPECT_EQ(unit.unfinished[0].reason, "did not come back from a step; its thread was given up");
  EXPECT_EQ(unit.next, 2u);
  EXPECT_FALSE(unit.done());
  WorkUnit one;
  one.particles.push_back(particle_of(3));
  take_over(one);
  EXPECT_TRUE(one.done()) << "a unit of one was alone from the beginning";
  EXPECT_EQ(one.unfinished.at(0).particle, 3u);
}

TEST(FrameLogs, ReadBack) {
  std::mt19937 random(2);
  const auto row = [&](std::size_t n) {
    std::vector<double> out(n);
    for (double& x : out) x = static_cast<double>(random());
    return out;
  };
  FrameLog log;
  log.reserve(20, 4, 3, 2);
  std::vector<TelemetryFrame> frames;
  for (int i = 0; i < 20; ++i) frames.push_back({0.1 * i, row(4), row(3), row(2)});
  for (const TelemetryFrame& frame : frames) log.add(frame);
  frames[11] = {99, row(4), row(3), row(2)};
  log.set(11, 99, frames[11].q, frames[11].v, frames[11].tau);
  ASSERT_EQ(log.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(log[i].time, frames[i].time);
    EXPECT_EQ(log[i].q, frames[i].q);
    EXPECT_EQ(log[i].v, frames[i].v);
    EXPECT_EQ(log[i].tau, frames[i].tau);
  }
  log.clear();
  EXPECT_TRUE(log.empty() && log.q().empty() && log.v().empty() && log.tau().empty());
}

// A trace is flagged above the limit and not at it; back ends that tell nothing have no facts.
TEST(SolverLogs, AreFlaggedAboveTheirLimit) {
  SolverLog log;
  std::vector<std::string> told;
  const auto note = [&](const char* name, double value, const char*) {
    told.push_back(name + (" " + std::to_string(value)));
  };
  each_solver_fact(log, 0.05, note);
  EXPECT_THAT(told, IsEmpty());
  EXPECT_FALSE(log.flagged(0)) << "of no steps there is no share";
  log.mean_sweeps = 3, log.steps = 200, log.unconverged_steps = 10;
  EXPECT_FALSE(log.flagged(0.05));
  EXPECT_TRUE(log.flagged(0.0499));
  each_solver_fact(log, 0.0499, note);
  EXPECT_THAT(told, ElementsAre("solver_steps 200.000000", "unconverged_steps 10.000000", "median_change 0.000000",
                                "largest_change 0.000000", "braked_steps 0.000000", "most_braked 0.000000",
                                "flagged 1.000000"));
}

TEST(BuildsDiffer, InWhatBothKnow) {
  const BuildFacts here = build_facts();
  int known = 0;
  each_fact(here, [&](const char* name, const std::string& text) {
    EXPECT_FALSE(text.empty()) << name;
    ++known;
  });
  EXPECT_EQ(known, 6);
  EXPECT_THAT(build_differences(here, here), IsEmpty());
  BuildFacts there = here;
  there.compiler = "";
  EXPECT_THAT(build_differences(there, here), IsEmpty()) << "an archive that does not know it";
  there.eigen = "9.9";
  there.instruction_set = "abacus";
  EXPECT_THAT(build_differences(there, here),
              ElementsAre("eigen_version: '9.9' there, '" + here.eigen + "' here",
                          "instruction_set: 'abacus' there, '" + here.instruction_set + "' here"));
  EXPECT_EQ(outcome_name(Outcome::success), "success");
  EXPECT_EQ(outcome_name(Outcome::known_failure), "known failure");
  EXPECT_EQ(outcome_name(Outcome::unknown_failure), "unknown failure");
  EXPECT_EQ(outcome_name(Outcome::invalid), "invalid");
}

}  // namespace
}  // namespace graze
