// Claim: the intervals by which tests and benchmarks compare a number on the same particles in two ways miss what is
// true as often as they say, and not more; they see a shift that particles share, and need no normal numbers.
#include "tests/paired_numbers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sampling/distribution.h"
#include "sampling/stream.h"

namespace graze {
namespace {

constexpr int kSamples = 2000;

double draw(int i, std::uint64_t column, int sample) {
  return normal_quantile(uniform(41, static_cast<std::uint32_t>(i), column, static_cast<std::uint32_t>(sample)));
}

/// Numbers of `n` particles that share most of their scatter; y scatters `wider` times as much as x about a mean that
/// is lower by `off`. `heavy`: with tails as those of an exponential.
struct Twins {
  std::vector<double> x, y;

  Twins(int sample, int n, double off, double wider, bool heavy) {
    const auto noise = [&](int i, std::uint64_t column) {
      const double z = draw(i, column, sample);
      return heavy ? std::copysign(z * z, z) : z;
    };
    for (int i = 0; i < n; ++i) {
      const double shared = noise(i, 0);
      x.push_back(shared + 0.3 * noise(i, 1));
      y.push_back(wider * (shared + 0.3 * noise(i, 2)) - off);
    }
  }
};

/// How many of kSamples intervals miss.
template <class Misses>
int misses(const Misses& of) {
  int out = 0;
  for (int sample = 0; sample < kSamples; ++sample) out += of(sample);
  return out;
}

// 5 % of 2000 are 100 with a scatter of 10; beyond four of that lies one seed in 15,000.
TEST(PairedNumbers, MeansMissAsOftenAsTheySay) {
  const int missed = misses([](int sample) {
    const Twins twins(sample, 20, 0.7, 1, false);
    return !difference_of_means(twins.x, twins.y, 0.95).holds(0.7);
  });
  EXPECT_NEAR(missed, 100, 40);
}

// The ratio of scatters is right for many numbers only: of 200, also if their tails are heavy, at most 8 % miss.
TEST(PairedNumbers, ScattersMissLittleMoreThanTheySay) {
  for (const bool heavy : {false, true}) {
    const int missed = misses([&](int sample) {
      const Twins twins(sample, 200, 0, 1.5, heavy);
      return !ratio_of_scatters(twins.y, twins.x, 0.95).holds(1.5);
    });
    EXPECT_GT(missed, 60) << heavy;
    EXPECT_LT(missed, 160) << heavy;
  }
}

// What the particles share does not hide a shift of a tenth, or a scatter that is wider by a fifth.
TEST(PairedNumbers, SeeWhatParticlesShare) {
  const int means = misses([](int sample) {
    const Twins twins(sample, 200, 0.1, 1, false);
    return !difference_of_means(twins.x, twins.y, 0.95).holds(0);
  });
  const int scatters = misses([](int sample) {
    const Twins twins(sample, 200, 0, 1.2, false);
    return !ratio_of_scatters(twins.y, twins.x, 0.95).holds(1);
  });
  EXPECT_GT(means, 0.8 * kSamples);
  EXPECT_GT(scatters, 0.9 * kSamples);
}

TEST(PairedNumbers, OfOneNumberTellNothing) {
  const Estimate mean = mean_of({3}, 0.95);
  EXPECT_EQ(mean.value, 3);
  EXPECT_TRUE(mean.holds(1e9) && mean.holds(-1e9));
}

}  // namespace
}  // namespace graze
