// Claim: quantiles are NumPy's (type 7), whatever the order and the infinities.
#include "analysis/quantiles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sampling/constants.h"

namespace graze {
namespace {

TEST(Quantiles, OfNumPy) {
  // numpy.quantile([1, 2, 4, 8], [0, 0.25, 0.4, 0.5, 0.95, 1])
  const std::vector<double> x = {1, 2, 4, 8};
  const double wanted[][2] = {{0, 1}, {0.25, 1.75}, {0.4, 2.4}, {0.5, 3}, {0.95, 7.4}, {1, 8}};
  for (const auto& [p, value] : wanted) EXPECT_NEAR(quantile(x, p), value, 1e-14) << p;
  const Quantiles q = quantiles({8, 1, 4, 2});
  EXPECT_NEAR(q.low, 1.15, 1e-15);
  EXPECT_EQ(q.median, 3);
  EXPECT_NEAR(q.high, 7.4, 1e-14);
}

TEST(Quantiles, MedianIsTheHalf) {
  EXPECT_EQ(median({5, 1, 9}), 5);
  EXPECT_EQ(median({5, 9, 1, 6}), 5.5);
  EXPECT_EQ(median({7}), 7);
  EXPECT_TRUE(std::isnan(median({})));
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(Quantiles, InfiniteValues) {
  const std::vector<double> x = {-kInfinity, -kInfinity, 1, kInfinity};
  EXPECT_EQ(quantile(x, 0), -kInfinity);
  EXPECT_EQ(quantile(x, 0.2), -kInfinity) << "between two equal ones";
  EXPECT_EQ(quantile(x, 2.0 / 3), 1) << "on one, beside an infinite one";
  EXPECT_EQ(quantile(x, 0.9), kInfinity);
  EXPECT_EQ(median({kInfinity, kInfinity}), kInfinity);
}

}  // namespace
}  // namespace graze
