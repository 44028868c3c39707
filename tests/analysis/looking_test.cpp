// What is said of rates, margins and dependence: searches against every size, quantiles against counting, the criterion
// of dependence against its definition, and what looking at modes keeps when units change.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "analysis/dependence.h"
#include "analysis/dip.h"
#include "analysis/quantiles.h"
#include "analysis/ranks.h"
#include "analysis/rates.h"
#include "analysis/scatter.h"
#include "analysis/sequential.h"
#include "analysis/sources.h"
#include "sampling/constants.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Claim: a quantile lies between the order statistics on both sides of p (n - 1), in the share of the way that is left;
// quantiles rise with p, and shift and scale with the values.
TEST(Looking, QuantilesLieBetweenNeighbours) {
  std::mt19937_64 random(171);
  for (int round = 0; round < 60; ++round) {
    std::vector<double> x(1 + random() % 25);
    for (double& one : x) one = static_cast<double>(random() % 40) - 20;
    std::sort(x.begin(), x.end());
    std::vector<double> scaled;
    for (const double one : x) scaled.push_back(3 * one + 7);
    double before = -kInfinity;
    for (int percent = 0; percent <= 100; ++percent) {
      const double p = percent / 100.0, got = quantile(x, p);
      double wanted = 0;  // sum over the values of the triangle that the place p (n - 1) gives each
      const double place = p * static_cast<double>(x.size() - 1);
      for (std::size_t i = 0; i < x.size(); ++i) {
        wanted += x[i] * std::max(0.0, 1 - std::abs(place - static_cast<double>(i)));
      }
      EXPECT_NEAR(got, wanted, 1e-10);
      EXPECT_GE(got, before - 1e-12);
      EXPECT_NEAR(quantile(scaled, p), 3 * got + 7, 1e-10);
      before = got;
    }
    std::vector<double> shuffled = x;
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    EXPECT_NEAR(median(shuffled), quantile(x, 0.5), 1e-12);
    const Quantiles three = quantiles(shuffled);
    EXPECT_EQ(three.low, quantile(x, 0.05));
    EXPECT_EQ(three.median, quantile(x, 0.5));
    EXPECT_EQ(three.high, quantile(x, 0.95));
  }
  EXPECT_EQ(quantile(std::vector<double>{4}, 0.99), 4);
  EXPECT_TRUE(std::isnan(quantiles({}).low));
}

// Claim: margins are summed up as counting says: NaN is none, -0 is not below 0, and of equal worst ones the lowest
// particle is named, in whatever order they come.
TEST(Looking, MarginsAreCounted) {
  std::mt19937_64 random(172);
  for (int round = 0; round < 60; ++round) {
    const std::size_t n = random() % 30;
    std::vector<double> margins(n), valid;
    std::vector<std::uint32_t> particles(n);
    std::iota(particles.begin(), particles.end(), 100u);
    std::shuffle(particles.begin(), particles.end(), random);
    double worst = kInfinity;
    std::uint32_t who = 0;
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < n; ++i) {
      margins[i] = random() % 6 == 0 ? std::nan("") : static_cast<double>(random() % 9) - 3;
      if (margins[i] == 0 && random() % 2 == 0) margins[i] = -0.0;
      if (std::isnan(margins[i])) continue;
      valid.push_back(margins[i]);
      below += margins[i] < 0;
      if (margins[i] < worst || (margins[i] == worst && particles[i] < who)) worst = margins[i], who = particles[i];
    }
    const MarginSummary got = summarise_margins(margins, particles);
    EXPECT_EQ(got.n, valid.size());
    EXPECT_EQ(got.below, below);
    EXPECT_EQ(got.interval.low, clopper_pearson(below, valid.size()).low);
    ASSERT_THAT(got.quantiles, SizeIs(6));
    if (valid.empty()) {
      EXPECT_TRUE(std::isnan(got.worst));
      EXPECT_TRUE(std::isnan(got.quantiles[3]));
      continue;
    }
    EXPECT_EQ(got.worst, worst);
    EXPECT_EQ(got.worst_particle, who);
    EXPECT_NEAR(got.quantiles[3], median(valid), 1e-12);
  }
}

// Claim: as many particles are asked for as make the interval narrow: at that number it is, at one less it is not; more
// where the rate is in the middle, the interval is narrower, or the confidence higher; never for what cannot be.
TEST(Looking, SizesAreTheLeast) {
  const auto width = [](double rate, std::uint64_t n, double confidence) {
    const auto k = std::min(n, static_cast<std::uint64_t>(std::llround(rate * static_cast<double>(n))));
    const Interval interval = clopper_pearson(k, n, confidence);
    return interval.high - interval.low;
  };
  for (const double rate : {0.0, 0.03, 0.5, 0.81, 1.0}) {
    for (const double half : {0.2, 0.05, 0.01}) {
      const std::uint64_t n = particles_for_width(rate, half);
      EXPECT_LE(width(rate, n, 0.95), 2 * half) << rate;
      EXPECT_GT(width(rate, n - 1, 0.95), 2 * half) << rate;
      EXPECT_GT(particles_for_width(rate, half, 0.99), n);
    }
    EXPECT_GT(particles_for_width(rate, 0.01), particles_for_width(rate, 0.05));
    EXPECT_LE(particles_for_width(rate, 0.01), particles_for_width(0.5, 0.01));
  }
  EXPECT_EQ(particles_for_width(0.5, 0.6), 1u);
  EXPECT_EQ(particles_for_width(0.5, 1e-6), 0u) << "more than 10^9";
}

// Claim: deciding takes the more the nearer the rate is to the bound, looking again and again takes more than a number
// fixed beforehand, and a rate at the bound is never decided below it; both sizes decide, on the right side.
TEST(Looking, DecisionsTakeMoreNearTheBound) {
  std::uint64_t fixed = 0, sequence = 0;
  for (const double rate : {0.5, 0.7, 0.85, 0.88}) {
    const DecisionSize got = particles_to_decide(rate, 0.9);
    EXPECT_GT(got.fixed, fixed) << rate;
    EXPECT_GT(got.sequence, sequence) << rate;
    EXPECT_GT(got.sequence, got.fixed) << rate;
    fixed = got.fixed, sequence = got.sequence;
    const auto k = static_cast<std::uint64_t>(std::llround(rate * static_cast<double>(got.fixed)));
    EXPECT_LT(clopper_pearson(k, got.fixed).high, 0.9);
  }
  const DecisionSize above = particles_to_decide(1, 0.9);
  EXPECT_GE(clopper_pearson(above.fixed, above.fixed).low, 0.9);
  EXPECT_LT(clopper_pearson(above.fixed - 1, above.fixed - 1).low, 0.9);
  EXPECT_GE(confidence_sequence(above.sequence, above.sequence).low, 0.9);
  EXPECT_EQ(above.fixed, 36u) << "0.025^(1/n) >= 0.9: n >= 35.01";
}

// Claim: questions are judged by the interval alone, and on its border as they are written: p >= 0.9 holds where the
// lower end is 0.9, and p < 0.9 is refuted there; an interval as wide as was asked is not yet narrow.
TEST(Looking, JudgementsAtTheBorder) {
  const auto at = [](Question::Kind kind, double low, double high) {
    return judge({"", "*", kind, 0.25}, {low, high});
  };
  using Kind = Question::Kind;
  EXPECT_EQ(at(Kind::rate_above, 0.25, 0.5), Verdict::holds);
  EXPECT_EQ(at(Kind::rate_above, 0.2, 0.25), Verdict::open);
  EXPECT_EQ(at(Kind::rate_above, 0.1, 0.2), Verdict::refuted);
  EXPECT_EQ(at(Kind::rate_below, 0.25, 0.5), Verdict::refuted);
  EXPECT_EQ(at(Kind::rate_below, 0.2, 0.25), Verdict::open);
  EXPECT_EQ(at(Kind::rate_below, 0.1, 0.2), Verdict::holds);
  EXPECT_EQ(at(Kind::narrow, 0.5, 0.75), Verdict::open);
  EXPECT_EQ(at(Kind::narrow, 0.5, 0.7), Verdict::holds);
  EXPECT_STREQ(verdict_name(Verdict::holds), "holds");
  EXPECT_STREQ(verdict_name(Verdict::refuted), "refuted");
  EXPECT_STREQ(verdict_name(Verdict::open), "undecided");
}

// Claim: the mixture is that of the narrowest width that is asked for, 0.4 / w^2, and of none where none is.
TEST(Looking, MixturesFollowTheNarrowestQuestion) {
  EXPECT_EQ(mixture_mass({}), 0);
  EXPECT_EQ(mixture_mass({parse_question("p >= 0.9", "-")}), 0);
  EXPECT_NEAR(mixture_mass(
                  {parse_question("ci < 0.1", "-"), parse_question("ci < 0.05", "-"), parse_question("ci < 0.2", "-")}),
              160, 1e-9);
  EXPECT_THROW(confidence_sequence(1, 2, 1), std::invalid_argument);
  EXPECT_THROW(confidence_sequence(1, 2, 0), std::invalid_argument);
  EXPECT_THROW(confidence_sequence(1, 2, 0.9, -1), std::invalid_argument);
  EXPECT_THROW(confidence_sequence(1, 2, std::nan("")), std::invalid_argument);
}

// Claim: a higher confidence holds a lower one's interval, for both mixtures, and more successes never lower an end.
TEST(Looking, SequencesAreNested) {
  for (const double mass : {0.0, 40.0}) {
    Interval before{0, 0};
    for (std::uint64_t k = 0; k <= 60; ++k) {
      const Interval low = confidence_sequence(k, 60, 0.8, mass), high = confidence_sequence(k, 60, 0.99, mass);
      EXPECT_LE(high.low, low.low);
      EXPECT_GE(high.high, low.high);
      EXPECT_GE(low.low, before.low);
      EXPECT_GE(low.high, before.high);
      before = low;
    }
  }
}

/// n^-2 tr(K H L H) by its definition, with kernels of ranks over n.
double hsic_by_definition(const std::vector<double>& a, const std::vector<double>& b) {
  const std::size_t n = a.size();
  const auto scale = static_cast<double>(n);
  const auto kernel = [&](const std::vector<double>& x, std::size_t i, std::size_t j) {
    const double distance = (x[i] - x[j]) / scale;
    return 0.5 * (std::exp(-12.5 * distance * distance) + std::exp(-200 * distance * distance));
  };
  double both = 0, row_products = 0, all_a = 0, all_b = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double row_a = 0, row_b = 0;
    for (std::size_t j = 0; j < n; ++j) {
      both += kernel(a, i, j) * kernel(b, i, j);
      row_a += kernel(a, i, j);
      row_b += kernel(b, i, j);
    }
    row_products += row_a * row_b;
    all_a += row_a;
    all_b += row_b;
  }
  return both / (scale * scale) - 2 * row_products / std::pow(scale, 3) + all_a * all_b / std::pow(scale, 4);
}

// Claim: the share is HSIC by its definition over the geometric mean of both variables' own (three sums of kernels, not
// a centred matrix); it is 1 for a number with itself or turned round, and the same in both directions. 1 %: 64 points
// stand for the distribution in the denominator.
TEST(Looking, DependenceIsItsDefinition) {
  std::mt19937_64 random(173);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 12; ++round) {
    const std::size_t n = 30 + random() % 60;
    std::vector<double> x(n), y(n), turned(n);
    for (std::size_t i = 0; i < n; ++i) {
      x[i] = normal(random);
      y[i] = round % 3 == 0   ? x[i] * x[i] + 0.3 * normal(random)
             : round % 3 == 1 ? std::round(2 * normal(random))
                              : x[i];
      turned[i] = -x[i];
    }
    const std::vector<double> a = midranks(x), b = midranks(y);
    const RankDependence of_a(a), of_b(b);
    const double wanted = hsic_by_definition(a, b) / std::sqrt(hsic_by_definition(a, a) * hsic_by_definition(b, b));
    EXPECT_NEAR(of_a.test(b).share, wanted, 0.01) << round;
    EXPECT_NEAR(of_a.test(b).share, of_b.test(a).share, 1e-4);
    EXPECT_NEAR(of_a.test(b).p_value, of_b.test(a).p_value, 1e-3);
    EXPECT_NEAR(of_a.test(a).share, 1, 0.01);
    EXPECT_NEAR(of_a.test(midranks(turned)).share, of_a.test(a).share, 1e-4);
    EXPECT_LT(of_a.test(a).p_value, 1e-5);
  }
}

// Claim: what rises and falls again is seen where no rank correlation is; what does not vary has no answer.
TEST(Looking, DependenceWithoutADirection) {
  std::vector<double> x(80), hill(80);
  for (std::size_t i = 0; i < 80; ++i) {
    x[i] = static_cast<double>(i);
    hill[i] = -std::abs(static_cast<double>(i) - 39.5);
  }
  const RankDependence of_hill(midranks(hill));
  EXPECT_NEAR(correlation(midranks(x), midranks(hill)), 0, 1e-9);
  EXPECT_LT(of_hill.test(midranks(x)).p_value, 1e-6);
  EXPECT_GT(of_hill.test(midranks(x)).share, 0.1);
  // Two hills: one kernel of width 0.2 would see nothing.
  std::vector<double> angle(200), struck(200);
  for (std::size_t i = 0; i < 200; ++i) {
    angle[i] = static_cast<double>(i);
    struck[i] = std::abs(std::sin(0.01 * std::numbers::pi * static_cast<double>(i))) > 0.75 && i % 5 != 0 ? 1 : 0;
  }
  EXPECT_LT(RankDependence(midranks(struck)).test(midranks(angle)).p_value, 1e-5);
  EXPECT_TRUE(std::isnan(of_hill.test(std::vector<double>(80, 40.5)).p_value));
  EXPECT_TRUE(std::isnan(RankDependence(std::vector<double>(80, 40.5)).test(midranks(x)).share));
}

// Claim: the dip does not change with shifts, scales and mirrors, nor when every value comes twice (up to rounding of a
// step), and is within 1 / (2 n) and 1 / 4.
TEST(Looking, DipsHaveNoUnit) {
  std::mt19937_64 random(174);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 40; ++round) {
    const std::size_t n = 4 + random() % 40;
    std::vector<double> x(n);
    for (double& one : x) one = normal(random) + (random() % 2 == 0 ? 3 : 0);
    std::sort(x.begin(), x.end());
    std::vector<double> moved, mirrored;
    for (const double one : x) moved.push_back(8 * one + 3);
    for (auto one = x.rbegin(); one != x.rend(); ++one) mirrored.push_back(-*one);
    const double here = dip(x);
    EXPECT_GE(here, 0.5 / static_cast<double>(n) - 1e-12);
    EXPECT_LE(here, 0.25);
    EXPECT_NEAR(dip(moved), here, 1e-9);
    EXPECT_NEAR(dip(mirrored), here, 1e-9);
  }
  std::vector<double> halves(100, 0.0);
  std::fill(halves.begin() + 50, halves.end(), 1.0);
  EXPECT_NEAR(dip(halves), 0.25, 1e-12) << "two points of equal weight: the largest there is";
  EXPECT_DOUBLE_EQ(dip(std::vector<double>{3}), 0.5);
}

// Claim: p-values of the dip fall as it grows, never below one of 5000; a level is undercut exactly where the p-value
// is below it, also for samples so large that they are scaled.
TEST(Looking, DipsPValues) {
  DipTest test;
  for (const std::size_t n : {12u, 60u}) {
    double before = 1;
    for (double d = 0.5 / static_cast<double>(n); d < 0.25; d += 0.01) {
      const double p = test.p_value(d, n);
      EXPECT_LE(p, before);
      EXPECT_GE(p, 1.0 / 5000);
      for (const double level : {0.01, 0.05, 0.5}) EXPECT_EQ(test.below(d, n, level), p < level) << d;
      before = p;
    }
    EXPECT_EQ(test.p_value(0.25, n), 1.0 / 5000);
  }
}

/// Columns of a normal spread, or of two or three clusters.
std::vector<double> clusters(std::mt19937_64& random, const std::vector<double>& means, std::size_t n, double width) {
  std::normal_distribution<double> normal;
  std::vector<double> out;
  for (std::size_t i = 0; i < n; ++i) out.push_back(means[i % means.size()] + width * normal(random));
  return out;
}

// Claim: means, deviations, medians and quartiles of a degree of freedom are those of its values by hand, and each
// trace's side is the cluster that it was drawn from; modes rise, their traces add up.
TEST(Looking, ScatterDescribesItsColumns) {
  std::mt19937_64 random(175);
  const std::vector<std::vector<double>> columns = {clusters(random, {0}, 90, 1),
                                                    clusters(random, {0, 5, 10}, 90, 0.3)};
  DipTest test;
  const Scatter got = judge_scatter({"base.x", "hip"}, {"m", ""}, columns, test);
  ASSERT_THAT(got.freedoms, SizeIs(2));
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<double> sorted = columns[k];
    std::sort(sorted.begin(), sorted.end());
    const double mean = std::accumulate(sorted.begin(), sorted.end(), 0.0) / 90;
    double squares = 0;
    for (const double x : sorted) squares += (x - mean) * (x - mean);
    EXPECT_NEAR(got.freedoms[k].mean, mean, 1e-12);
    EXPECT_NEAR(got.freedoms[k].deviation, std::sqrt(squares / 89), 1e-12);
    EXPECT_NEAR(got.freedoms[k].iqr, quantile(sorted, 0.75) - quantile(sorted, 0.25), 1e-12);
    EXPECT_NEAR(got.freedoms[k].skew_drift, mean - quantile(sorted, 0.5), 1e-12);
    EXPECT_GE(got.freedoms[k].p_holm, got.freedoms[k].p_value);
  }
  EXPECT_THAT(got.freedoms[0].modes, SizeIs(1));
  ASSERT_THAT(got.freedoms[1].modes, SizeIs(3));
  EXPECT_EQ(got.clearest, 1);
  for (std::size_t i = 0; i < 90; ++i) EXPECT_EQ(got.side[i], static_cast<int>(i % 3));
  for (std::size_t m = 0; m < 3; ++m) {
    EXPECT_EQ(got.freedoms[1].modes[m].traces, 30u);
    EXPECT_NEAR(got.freedoms[1].modes[m].mean, 5.0 * static_cast<double>(m), 4 * 0.3 / std::sqrt(30.0));
  }
  EXPECT_THAT(scatter_text(got), HasSubstr("bifurcates: hip has 3 modes, 30 at "));
}

// Claim: a column that is not finite is left out by name, and the sides are still those of the column that parts; one
// that does not vary has no p-value and does not count for Holm's correction; too few traces are not tested.
TEST(Looking, ScatterLeavesOut) {
  std::mt19937_64 random(176);
  std::vector<double> broken = clusters(random, {0, 9}, 40, 0.2), parts = clusters(random, {0, 9}, 40, 0.2);
  broken[3] = kInfinity;
  DipTest test;
  const std::vector<double> flat(40, 2.5);
  const Scatter got = judge_scatter({"a", "flat", "b"}, {"m", "m", "m"}, {broken, flat, parts}, test);
  ASSERT_THAT(got.freedoms, SizeIs(2));
  ASSERT_THAT(got.notes, SizeIs(1));
  EXPECT_THAT(got.notes[0], HasSubstr("left out a"));
  EXPECT_TRUE(std::isnan(got.freedoms[0].p_holm));
  EXPECT_EQ(got.freedoms[1].p_holm, got.freedoms[1].p_value) << "one test, no correction";
  EXPECT_EQ(got.freedoms[1].name, "b");
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(got.side[i], static_cast<int>(i % 2));
  const Scatter few = judge_scatter({"a"}, {"m"}, {{1, 2, 3}}, test);
  EXPECT_THAT(few.freedoms, IsEmpty());
  EXPECT_EQ(scatter_text(few), "not tested: 3 traces, and it takes 10");
  EXPECT_EQ(scatter_text(judge_scatter({}, {}, {}, test)), "not tested: 0 traces, and it takes 10");
  EXPECT_EQ(deviation_of({}), 0);
  EXPECT_EQ(deviation_of(std::vector<double>{4}), 0);
  EXPECT_DOUBLE_EQ(deviation_of(std::vector<double>{1, 3}), std::sqrt(2.0));
}

// Claim: each source has paths of its own, coefficients of contact are told by their last word wherever they stand, and
// what no rule names is of the environment.
TEST(Looking, SourcesOfOddPaths) {
  const std::pair<const char*, const char*> wanted[] = {{"robot.link.A.restitution", "contact"},
                                                        {"robot.joint.A.friction", "fabrication"},
                                                        {"robot.link.friction.mass", "fabrication"},
                                                        {"environment.box.stiffness", "contact"},
                                                        {"environment.friction.height", "environment"},
                                                        {"control.gain", "environment"},
                                                        {"sensor.imu.bias", "sensing"},
                                                        {"wind.speed", "environment"},
                                                        {"contacts.friction", "environment"},
                                                        {"", "environment"}};
  for (const auto& [path, source] : wanted) EXPECT_EQ(source_of(path), source) << path;
  EXPECT_THAT(source_names(), SizeIs(9));
}

}  // namespace
}  // namespace graze
