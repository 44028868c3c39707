// What looking costs: how many particles `graze run --until` needs, against a number that was fixed beforehand
// (Clopper-Pearson) and Wald's sequential test, by simulated campaigns. The table of docs/statistics.md.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/sequential.h"
#include "sampling/stream.h"

namespace graze {
namespace {

constexpr int kCampaigns = 400;
constexpr std::uint64_t kMost = 2'000'000;

struct Summary {
  std::uint64_t median, late;  // 90 % of campaigns end by then
  double mean;
};

Summary summary(std::vector<std::uint64_t> n) {
  std::sort(n.begin(), n.end());
  double sum = 0;
  for (const std::uint64_t one : n) sum += static_cast<double>(one);
  return {n[n.size() / 2], n[n.size() * 9 / 10], sum / static_cast<double>(n.size())};
}

/// Particles until a question is answered at a true rate.
std::vector<std::uint64_t> sequence_sizes(const Question& question, double rate) {
  const std::vector<std::uint64_t> looks = look_boundaries(kMost);
  const double mass = mixture_mass({question});
  std::vector<std::uint64_t> out;
  for (std::uint32_t campaign = 0; campaign < kCampaigns; ++campaign) {
    std::uint64_t k = 0, n = 0;
    for (const std::uint64_t look : looks) {
      for (; n < look; ++n) k += uniform(1, static_cast<std::uint32_t>(n), campaign, 0) < rate;
      if (judge(question, confidence_sequence(k, n, 0.95, mass)) != Verdict::open) break;
    }
    out.push_back(n);
  }
  return out;
}

/// Least number with which a Clopper-Pearson interval about the expected count is narrow enough.
std::uint64_t fixed_size_narrow(double width, double rate) {
  std::uint64_t low = 1, high = kMost;
  while (low + 1 < high) {
    const std::uint64_t n = (low + high) / 2;
    const Interval interval = clopper_pearson(static_cast<std::uint64_t>(std::llround(rate * double(n))), n);
    (interval.high - interval.low < width ? high : low) = n;
  }
  return high;
}

/// Number that shows p >= bound in 90 % of campaigns (nearly: in the normal approximation of the count).
std::uint64_t fixed_size_above(double bound, double rate) {
  for (std::uint64_t n = 20; n < kMost; n += std::max<std::uint64_t>(1, n / 200)) {
    const double expected = rate * double(n), poor = expected - 1.2816 * std::sqrt(expected * (1 - rate));
    const auto k = static_cast<std::uint64_t>(std::max(0.0, std::floor(poor)));
    const Interval interval = clopper_pearson(k, n);
    if (rate > bound ? interval.low >= bound : false) return n;
  }
  return 0;
}

/// Wald's test of rate <= against rate >= other hypothesis, errors 2.5 % and 10 %: it has to be told both rates.
std::vector<std::uint64_t> sprt_sizes(double bound, double other, double rate) {
  const double up = std::log((1 - 0.10) / 0.025), down = std::log(0.10 / (1 - 0.025));
  std::vector<std::uint64_t> out;
  for (std::uint32_t campaign = 0; campaign < kCampaigns; ++campaign) {
    double ratio = 0;
    std::uint64_t n = 0;
    for (; ratio < up && ratio > down && n < kMost; ++n) {
      const bool success = uniform(1, static_cast<std::uint32_t>(n), campaign, 0) < rate;
      ratio += std::log(success ? other / bound : (1 - other) / (1 - bound));
    }
    out.push_back(n);
  }
  return out;
}

void run() {
  fmt::print("ci < WIDTH\n{:>6} {:>6} {:>10} {:>10} {:>10} {:>8}\n", "width", "rate", "fixed", "median", "90 %",
             "ratio");
  for (const double width : {0.1, 0.05, 0.02}) {
    for (const double rate : {0.5, 0.9, 0.99}) {
      const Question question = parse_question(fmt::format("ci < {}", width), "width");
      const Summary until = summary(sequence_sizes(question, rate));
      const std::uint64_t fixed = fixed_size_narrow(width, rate);
      fmt::print("{:>6} {:>6} {:>10} {:>10} {:>10} {:>8.2f}\n", width, rate, fixed, until.median, until.late,
                 until.mean / double(fixed));
    }
  }
  fmt::print("p >= BOUND\n{:>6} {:>6} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}\n", "bound", "rate", "fixed 90 %",
             "mean", "median", "90 %", "SPRT mean", "SPRT 90 %");
  for (const auto& [bound, rate] : {std::pair{0.9, 0.92}, {0.9, 0.95}, {0.9, 0.99}, {0.95, 0.97}, {0.95, 0.99}}) {
    const Summary until = summary(sequence_sizes(parse_question(fmt::format("p >= {}", bound), "bound"), rate));
    const Summary sprt = summary(sprt_sizes(bound, rate, rate));
    fmt::print("{:>6} {:>6} {:>10} {:>10.0f} {:>10} {:>10} {:>10.0f} {:>10}\n", bound, rate,
               fixed_size_above(bound, rate), until.mean, until.median, until.late, sprt.mean, sprt.late);
  }
}

}  // namespace
}  // namespace graze

int main() { graze::run(); }
