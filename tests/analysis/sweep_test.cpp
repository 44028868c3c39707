// Sweeps: counts and intervals, where an adaptive one sends its particles, and that its intervals hold.
#include "analysis/sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include "analysis/sequential.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr auto kSuccess = static_cast<std::int8_t>(Outcome::success);
constexpr auto kFailure = static_cast<std::int8_t>(Outcome::unknown_failure);
constexpr auto kInvalid = static_cast<std::int8_t>(Outcome::invalid);

/// One axis, one policy; `traces` by value.
Sweep sweep_of(const std::vector<std::vector<std::int8_t>>& traces) {
  Sweep out;
  out.scenario = "Planted";
  out.policies = {"only"};
  SweepAxis axis{"contact.friction", "", true, {}, {}};
  for (std::size_t i = 0; i < traces.size(); ++i) {
    axis.texts.push_back(std::to_string(i));
    axis.values.push_back(static_cast<double>(i));
    out.points.push_back({{i}, "", {traces[i]}, traces[i].size()});
  }
  out.axes = {axis};
  return out;
}

std::vector<std::int8_t> successes(std::size_t k, std::size_t n) {
  std::vector<std::int8_t> out(n, kFailure);
  std::fill_n(out.begin(), k, kSuccess);
  return out;
}

// Claim: rates leave invalid traces out, and a fixed sweep has Clopper and Pearson's intervals.
TEST(Sweep, CountsValidTraces) {
  const Sweep sweep = sweep_of({{kSuccess, kFailure, kInvalid, kSuccess, kNoTrace}});
  const SweepCount count = sweep.count(0, 0);
  EXPECT_EQ(count.success, 2u);
  EXPECT_EQ(count.valid(), 3u);
  EXPECT_EQ(count.invalid, 1u);
  EXPECT_EQ(sweep.count(0, 0, 2).valid(), 2u);
  EXPECT_DOUBLE_EQ(sweep.interval(count).low, clopper_pearson(2, 3).low);
  EXPECT_DOUBLE_EQ(sweep.interval(count).high, clopper_pearson(2, 3).high);
}

// Claim: a value that matters to nothing is told, and no other.
TEST(Sweep, TellsWhatHasNoEffect) {
  Sweep sweep = sweep_of({{kSuccess, kFailure}, {kSuccess, kFailure, kSuccess}});
  EXPECT_TRUE(axes_without_effect(sweep).empty()) << "bits are not known";
  sweep.points[0].digests = {{7, 8}};
  sweep.points[1].digests = {{7, 8, 9}};
  EXPECT_THAT(axes_without_effect(sweep), ElementsAre(0u));
  EXPECT_THAT(format_sweep(sweep), HasSubstr("\ncontact.friction has no effect here"));
  EXPECT_THAT(format_sweep(sweep), HasSubstr("--over uncertain.contact.friction=…\n"));
  EXPECT_THAT(sweep_json(sweep), HasSubstr("\"has_effect\": false"));
  sweep.points[1].digests[0][1] = 0;
  EXPECT_TRUE(axes_without_effect(sweep).empty()) << "another trace";
  sweep.points[1].digests[0][1] = 8;
  sweep.points[1].traces[0][0] = kFailure;
  EXPECT_TRUE(axes_without_effect(sweep).empty()) << "the same trace, judged otherwise";
  EXPECT_THAT(sweep_json(sweep), HasSubstr("\"has_effect\": true"));
  sweep.points[1].traces[0] = {kNoTrace, kNoTrace, kSuccess};
  EXPECT_TRUE(axes_without_effect(sweep).empty()) << "nothing to compare";
}

// Claim: of two values the one that matters is not taken for the other.
TEST(Sweep, TellsWhichOfTwoHasNoEffect) {
  Sweep sweep = sweep_of(std::vector<std::vector<std::int8_t>>(4, {kSuccess}));
  sweep.axes[0].texts = {"a", "b"};
  sweep.axes.push_back({"uncertain.name", "", false, {"x", "y"}, {}});
  for (std::size_t i = 0; i < 4; ++i) {
    sweep.points[i].at = {i % 2, i / 2};
    sweep.points[i].digests = {{i % 2}};
  }
  EXPECT_THAT(axes_without_effect(sweep), ElementsAre(1u));
}

// Claim: on a grid a point's neighbours differ from it by one value of one axis.
TEST(Sweep, KnowsNeighboursOnAGrid) {
  Sweep sweep = sweep_of(std::vector<std::vector<std::int8_t>>(6));
  sweep.axes[0].texts = {"a", "b", "c"};
  sweep.axes.push_back({"second", "", true, {"0", "1"}, {0, 1}});
  for (std::size_t i = 0; i < 6; ++i) sweep.points[i].at = {i % 3, i / 3};
  EXPECT_THAT(sweep.neighbours(0), ElementsAre(1, 3));
  EXPECT_THAT(sweep.neighbours(4), ElementsAre(3, 5, 1));
}

// Claim: paired changes count who was mended and who broke, on particles valid at both values.
TEST(Sweep, PairsNeighbouringValues) {
  const Sweep sweep = sweep_of(
      {{kSuccess, kSuccess, kFailure, kInvalid, kFailure}, {kFailure, kSuccess, kSuccess, kSuccess, kSuccess}});
  const std::vector<SweepChange> changes = sweep_changes(sweep);
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0].pairs.only_a, 1u);
  EXPECT_EQ(changes[0].pairs.only_b, 2u);
  EXPECT_EQ(changes[0].pairs.n(), 4u);
  EXPECT_DOUBLE_EQ(changes[0].p_value, mcnemar_exact(1, 2));
}

// Claim: more particles go where the curve is steep or undecided, and nowhere else.
TEST(Sweep, SendsParticlesWhereTheyMatter) {
  Sweep sweep = sweep_of(
      {successes(0, 64), successes(0, 64), successes(0, 64), successes(60, 64), successes(64, 64), successes(64, 64)});
  sweep.adaptive = true;
  // Between the third and the fourth value the rate rises by 0.94; the others are flat, far from 1/2.
  EXPECT_THAT(unsettled(sweep, std::vector<std::uint64_t>(6, 64)), ElementsAre(2, 3, 4));
  Sweep flat = sweep_of({successes(32, 64), successes(32, 64)});
  flat.adaptive = true;
  EXPECT_THAT(unsettled(flat, {64, 64}), ElementsAre(0, 1)) << "on which side of 1/2 is not decided";
  // Once the interval is narrow there is nothing more to ask.
  Sweep narrow = sweep_of({successes(0, 4096), successes(2048, 4096)});
  narrow.adaptive = true;
  EXPECT_THAT(unsettled(narrow, {4096, 4096}), ElementsAre());
  std::vector<std::uint64_t> particles(6, 64);
  EXPECT_TRUE(next_turn(sweep, 100, particles));
  EXPECT_THAT(particles, ElementsAre(64, 64, 100, 100, 100, 64));
  sweep.points[2].particles = sweep.points[3].particles = 100;
  EXPECT_FALSE(next_turn(sweep, 64, particles = std::vector<std::uint64_t>(6, 64))) << "all have the most";
}

// Claim: an adaptive sweep looks often and stops where outcomes tell it to, and its intervals hold all the same. Rates
// are planted; each value's interval may miss its rate in 5 % of 400 sweeps at most. False alarm of the test: 3
// standard errors above that, 1 in 700 for each of five values if coverage were exactly 95 %, which it is not below.
TEST(Sweep, AdaptiveIntervalsHoldTheirRate) {
  const std::vector<double> rates = {0.02, 0.1, 0.5, 0.85, 0.97};
  constexpr int kSweeps = 400;
  constexpr std::uint64_t kMost = 512;
  std::vector<int> missed(rates.size());
  std::mt19937_64 dice(1);
  for (int replication = 0; replication < kSweeps; ++replication) {
    Sweep sweep = sweep_of(std::vector<std::vector<std::int8_t>>(rates.size()));
    sweep.adaptive = true;
    for (std::uint64_t i = 0; i < kMost; ++i) {
      const double u = std::uniform_real_distribution<double>()(dice);  // common to all values
      for (std::size_t k = 0; k < rates.size(); ++k) {
        sweep.points[k].traces[0].push_back(u < rates[k] ? kSuccess : kFailure);
      }
    }
    std::vector<std::uint64_t> particles(rates.size(), sweep.rule.least);
    while (next_turn(sweep, kMost, particles)) {
    }
    for (std::size_t k = 0; k < rates.size(); ++k) {
      const Interval interval = sweep.interval(sweep.count(k, 0, particles[k]));
      missed[k] += rates[k] < interval.low || rates[k] > interval.high;
    }
  }
  const double most = 0.05 * kSweeps + 3 * std::sqrt(0.05 * 0.95 * kSweeps);
  for (std::size_t k = 0; k < rates.size(); ++k) EXPECT_LE(missed[k], most) << rates[k];
}

// Claim: text, CSV and JSON name values, counts and what kind of interval it is.
TEST(Sweep, TellsWhatItFound) {
  Sweep sweep = sweep_of({successes(1, 4), successes(3, 4)});
  EXPECT_THAT(format_sweep(sweep), HasSubstr("4 particles, the same at every value"));
  EXPECT_THAT(format_sweep(sweep), HasSubstr("0 -> 1"));
  EXPECT_THAT(sweep_csv(sweep), HasSubstr("\n1,only,4,3,0,1,0,0.75,"));
  EXPECT_THAT(sweep_json(sweep), HasSubstr("Clopper-Pearson"));
  sweep.adaptive = true;
  EXPECT_THAT(sweep_json(sweep), HasSubstr("confidence sequence"));
  EXPECT_TRUE(sweep_changes(sweep).empty());
  const Figure figure = sweep_figure(sweep);
  ASSERT_EQ(figure.panels.size(), 1u);
  EXPECT_THAT(figure.panels[0].series[0].y, ElementsAre(0.25, 0.75));
  EXPECT_THAT(figure.panels[0].series[0].x, ElementsAre(0, 1));
}

// Claim: where requirements were violated, table and picture tell the mean time until then, which stops at what was
// seen.
TEST(Sweep, TellsTimes) {
  Sweep sweep = sweep_of({successes(2, 2), successes(1, 2)});
  sweep.points[0].lifetimes = {{{20, false}, {20, false}}};
  sweep.points[1].lifetimes = {{{20, false}, {20, false}}};
  EXPECT_THAT(format_sweep(sweep), ::testing::Not(HasSubstr("Time until")));
  sweep.points[1].lifetimes = {{{20, false}, {1, true}}};
  EXPECT_THAT(format_sweep(sweep), HasSubstr("0   20.00              -         -         20.00\n1"));
  EXPECT_THAT(format_sweep(sweep), HasSubstr("10.50  0.00 .. 20.00      1.00         20.00"));
  const Figure figure = sweep_times_figure(sweep);
  ASSERT_EQ(figure.panels.size(), 1u);
  EXPECT_THAT(figure.panels[0].series[0].y, ElementsAre(20, 10.5));
  EXPECT_EQ(figure.panels[0].series[0].low[0], 20) << "no bar where nothing was violated";
  EXPECT_LE(figure.panels[0].series[0].high[1], 20);
}

// Claim: of several curves none hides another's bars, and bands are drawn only while they can be told apart.
TEST(Sweep, DrawsCurvesBesideEachOther) {
  Sweep sweep = sweep_of({successes(1, 4), successes(3, 4)});
  sweep.policies = {"a", "b", "c"};
  for (SweepPoint& point : sweep.points) point.traces.resize(3, point.traces[0]);
  const Figure figure = sweep_figure(sweep);
  ASSERT_EQ(figure.panels.size(), 1u);
  const std::vector<PlotSeries>& series = figure.panels[0].series;
  ASSERT_EQ(series.size(), 6u);
  EXPECT_LT(series[1].x[0], series[3].x[0]);
  EXPECT_EQ(series[3].x[0], 0) << "the middle one stands at the value";
  EXPECT_TRUE(series[0].low.empty());
  EXPECT_FALSE(series[1].low.empty());
  EXPECT_EQ(figure.legend.size(), 3u);
}

// Claim: of more curves than there are colours each is told apart, and all stand nearer to their value than to the
// next.
TEST(Sweep, TellsManyCurvesApart) {
  Sweep sweep = sweep_of({successes(1, 4), successes(3, 4)});
  const SweepPoint point = sweep.points[0];
  sweep.axes.push_back({"uncertain.disturbances.shove.azimuth", "deg", true, {}, {}});
  sweep.axes[0].path = "uncertain.disturbances.shove.impulse";
  sweep.points.clear();
  for (std::size_t second = 0; second < 12; ++second) {
    sweep.axes[1].texts.push_back(std::to_string(30 * second) + " deg");
    sweep.axes[1].values.push_back(30.0 * static_cast<double>(second));
    for (std::size_t first = 0; first < 2; ++first) {
      sweep.points.push_back(point);
      sweep.points.back().at = {first, second};
    }
  }
  const Figure figure = sweep_figure(sweep);
  std::set<std::tuple<int, bool, int>> looks;
  for (const PlotSeries& series : figure.panels.at(0).series) {
    EXPECT_LT(std::abs(series.x.at(0) - sweep.axes[0].values[0]),
              0.5 * std::abs(sweep.axes[0].values[1] - sweep.axes[0].values[0]));
    if (series.kind == PlotSeries::Kind::line) {
      looks.insert({static_cast<int>(series.color), series.dashed, static_cast<int>(series.mark)});
    }
  }
  EXPECT_EQ(looks.size(), 12u);
  EXPECT_EQ(figure.legend.at(1).text, "azimuth: 30 deg");
  EXPECT_EQ(figure.title, "Success against impulse and azimuth");
}

}  // namespace
}  // namespace graze
