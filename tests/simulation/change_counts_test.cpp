#include "simulation/change_counts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace graze {
namespace {

// Claim: the median is that of a sorted list to 7 %, whatever the order and number of the changes, and counting one so
// often is counting it again and again.
TEST(ChangeCounts, GiveTheMedian) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-6, 3);
  for (const std::size_t n : {1u, 2u, 3u, 10u, 1001u}) {
    std::vector<double> changes(n);
    for (double& change : changes) change = std::pow(10, exponent(random));
    ChangeCounts forwards, backwards;
    for (std::size_t i = 0; i < n; ++i) {
      forwards.add(changes[i], 3);
      for (int k = 0; k < 3; ++k) backwards.add(changes[n - 1 - i]);
    }
    std::sort(changes.begin(), changes.end());
    const double median = changes[(n - 1) / 2];
    EXPECT_NEAR(forwards.median(), median, 0.07 * median) << n;
    EXPECT_EQ(forwards.median(), backwards.median()) << n;
  }
}

// Claim: changes beyond the bins count at their ends; none have no median.
TEST(ChangeCounts, TakeAnything) {
  ChangeCounts counts;
  EXPECT_TRUE(std::isnan(counts.median()));
  counts.add(std::numeric_limits<double>::infinity(), 2);
  EXPECT_GT(counts.median(), 1e6);
  counts.add(0, 3);
  EXPECT_LT(counts.median(), 1e-6);
  counts.clear();
  EXPECT_TRUE(std::isnan(counts.median()));
}

// Claim: what is carried goes on as if nothing had been.
TEST(ChangeCounts, AreCarried) {
  ChangeCounts before;
  before.add(1e-3), before.add(2), before.add(3);
  LaneTape written;
  before.carry(written);
  const LaneTape::Content content = written.take();
  LaneTape read(content);
  ChangeCounts after;
  after.add(7);
  after.carry(read);
  EXPECT_EQ(after.median(), before.median());
  after.add(1e-3, 5), before.add(1e-3, 5);
  EXPECT_EQ(after.median(), before.median());
}

}  // namespace
}  // namespace graze
