#include "analysis/sequential.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <stdexcept>

namespace graze {
namespace {

double log_beta(double a, double b) {
  using boost::math::lgamma;
  return lgamma(a) + lgamma(b) - lgamma(a + b);
}

/// log of B(a + k, b + n - k) / B(a, b).
double log_beta_ratio(double a, double b, double k, double n) { return log_beta(a + k, b + (n - k)) - log_beta(a, b); }

/// k log p + (n - k) log(1 - p), with 0 log 0 = 0.
double log_likelihood(double k, double n, double p) {
  return (k > 0 ? k * std::log(p) : 0.0) + (n > k ? (n - k) * std::log1p(-p) : 0.0);
}

/// Root of a monotone function between `outer`, where it is positive, and `inner`, where it is not: the end of the last
/// bracket that lies outside, so that rounding never narrows an interval.
template <class Function>
double root_from_outside(const Function& f, double outer, double inner) {
  std::uintmax_t iterations = 200;
  const boost::math::tools::eps_tolerance<double> near(48);
  const double low = std::min(outer, inner), high = std::max(outer, inner);
  const auto [a, b] = boost::math::tools::toms748_solve(f, low, high, near, iterations);
  return outer < inner ? a : b;
}

}  // namespace

Interval confidence_sequence(std::uint64_t k, std::uint64_t n, double confidence, double mass) {
  if (!(confidence > 0 && confidence < 1)) throw std::invalid_argument("confidence must be within (0, 1)");
  if (!(mass >= 0)) throw std::invalid_argument("mass must be >= 0");
  if (n == 0) return {0, 1};
  const auto successes = static_cast<double>(k), trials = static_cast<double>(n);
  const double fixed = log_beta_ratio(0.5, 0.5, successes, trials);
  const double limit = -std::log1p(-confidence);  // log(1 / alpha)
  // Convex in p, also when the mixture moves along (each factor is (mass + i / p) or (mass + j / (1 - p)) then), and
  // below 0 at the rate that was seen, whose likelihood no mixture exceeds: one root on either side.
  const auto excess = [&](double p) {
    const double mixture = mass > 0 ? log_beta_ratio(mass * p, mass * (1 - p), successes, trials) : fixed;
    return mixture - log_likelihood(successes, trials, p) - limit;
  };
  const double rate = successes / trials, tiny = 1e-300, most = 1 - 0x1p-53;
  Interval out{0, 1};
  if (k > 0 && excess(tiny) > 0) out.low = root_from_outside(excess, tiny, std::min(rate, most));
  if (k < n && excess(most) > 0) out.high = root_from_outside(excess, most, std::max(rate, tiny));
  return out;
}

double mixture_mass(const std::vector<Question>& questions) {
  double mass = 0;
  for (const Question& question : questions) {
    if (question.kind == Question::Kind::narrow) mass = std::max(mass, 0.4 / (question.bound * question.bound));
  }
  return mass;
}

Verdict judge(const Question& question, const Interval& interval) {
  const double bound = question.bound;
  switch (question.kind) {
    case Question::Kind::rate_above:
      return interval.low >= bound ? Verdict::holds : interval.high < bound ? Verdict::refuted : Verdict::open;
    case Question::Kind::rate_below:
      return interval.high < bound ? Verdict::holds : interval.low >= bound ? Verdict::refuted : Verdict::open;
    case Question::Kind::narrow:
      return interval.high - interval.low < bound ? Verdict::holds : Verdict::open;
  }
  return Verdict::open;
}

Interval with_invalid(const RateCount& count, const IntervalOf& interval) {
  const std::uint64_t all = count.valid + count.invalid;
  return {interval(count.success, all).low, interval(count.success + count.invalid, all).high};
}

Verdict judge(const Question& question, const RateCount& count, const IntervalOf& interval) {
  const Verdict verdict = judge(question, interval(count.success, count.valid));
  if (question.kind == Question::Kind::narrow || count.invalid == 0) return verdict;
  return judge(question, with_invalid(count, interval)) == verdict ? verdict : Verdict::open;
}

const char* verdict_name(Verdict verdict) {
  return verdict == Verdict::holds ? "holds" : verdict == Verdict::refuted ? "refuted" : "undecided";
}

AnswerCount count_answers(const std::vector<Question>& questions, const std::vector<std::string>& policies,
                          const std::vector<RateCount>& counts, double confidence) {
  const double mass = mixture_mass(questions);
  const auto interval = [&](std::uint64_t k, std::uint64_t n) { return confidence_sequence(k, n, confidence, mass); };
  AnswerCount out;
  for (std::size_t i = 0; i < policies.size(); ++i) {
    for (const Question& question : questions) {
      if (!matches(question.selector, policies[i])) continue;
      ++out.all;
      if (judge(question, counts[i], interval) != Verdict::open) ++out.answered;
    }
  }
  return out;
}

void check_selectors(const std::vector<Question>& questions, const std::vector<std::string>& policies,
                     const std::string& option) {
  for (const Question& question : questions) {
    const auto chosen = [&](const std::string& policy) { return matches(question.selector, policy); };
    if (std::any_of(policies.begin(), policies.end(), chosen)) continue;
    throw InputError(fmt::format("{} '{}': '{}' is none of the policies; {}", option, question.text, question.selector,
                                 nearest_or_all(question.selector, policies)));
  }
}

std::vector<std::uint64_t> look_boundaries(std::uint64_t most) {
  constexpr std::uint64_t kFirst = 64, kPart = 16, kWidest = std::uint64_t{1} << 20;
  std::vector<std::uint64_t> looks;
  for (std::uint64_t look = kFirst; look < most;) {
    looks.push_back(look);
    const std::uint64_t stride = look / kPart / kFirst * kFirst;
    look += std::clamp(stride, kFirst, kWidest);
  }
  looks.push_back(most);
  return looks;
}

}  // namespace graze
