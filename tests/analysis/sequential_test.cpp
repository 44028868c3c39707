// The confidence sequence against its definition by another road, its coverage under continuous looking, and questions
// as text.
#include "analysis/sequential.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sampling/stream.h"

namespace graze {
namespace {

using ::testing::HasSubstr;

/// The mixture martingale in logarithms as a bet, particle by particle: before each one success is given the
/// probability (k + 1/2) / (n + 1), or (k + mass p) / (n + mass) to test p; the stake is multiplied by that over what p
/// would give.
class Bet {
 public:
  explicit Bet(double rate, double mass = 0) : rate_(rate), mass_(mass) {}
  void see(bool success) {
    const double predicted = mass_ > 0 ? (k_ + mass_ * rate_) / (n_ + mass_) : (k_ + 0.5) / (n_ + 1);
    log_stake_ += success ? std::log(predicted / rate_) : std::log((1 - predicted) / (1 - rate_));
    n_ += 1;
    k_ += success ? 1 : 0;
  }
  double log_stake() const { return log_stake_; }

 private:
  double rate_, mass_, k_ = 0, n_ = 0, log_stake_ = 0;
};

// Claim: at both ends of the interval the bet of an independent implementation has grown to 1 / alpha exactly.
TEST(ConfidenceSequence, EndsWhereTheBetReachesItsLimit) {
  for (const auto& [confidence, mass] : {std::pair{0.9, 0.0}, {0.95, 0.0}, {0.999, 0.0}, {0.95, 4.0}, {0.9, 1000.0}}) {
    for (const auto& [k, n] : {std::pair{1, 5}, {3, 10}, {50, 64}, {64, 64}, {0, 64}, {990, 1000}, {5000, 20000}}) {
      const auto successes = static_cast<std::uint64_t>(k), trials = static_cast<std::uint64_t>(n);
      const Interval interval = confidence_sequence(successes, trials, confidence, mass);
      EXPECT_LE(interval.low, static_cast<double>(k) / n);
      EXPECT_GE(interval.high, static_cast<double>(k) / n);
      for (const double end : {interval.low, interval.high}) {
        if (end == 0 || end == 1) continue;
        Bet bet(end, mass);
        for (int i = 0; i < n; ++i) bet.see(i < k);
        EXPECT_NEAR(bet.log_stake(), -std::log(1 - confidence), 1e-7) << k << " of " << n << " at " << end;
      }
    }
  }
  EXPECT_LT(confidence_sequence(5000, 20000, 0.95, 2000).high, confidence_sequence(5000, 20000).high);  // well tuned
  EXPECT_EQ(confidence_sequence(0, 64).low, 0);
  EXPECT_EQ(confidence_sequence(64, 64).high, 1);
  EXPECT_EQ(confidence_sequence(0, 0).low, 0);
  EXPECT_EQ(confidence_sequence(0, 0).high, 1);
}

// Claim: successes and failures change places.
TEST(ConfidenceSequence, IsSymmetric) {
  for (const std::uint64_t k : {0, 1, 17, 100}) {
    const Interval there = confidence_sequence(k, 100), back = confidence_sequence(100 - k, 100);
    EXPECT_NEAR(there.low, 1 - back.high, 1e-12);
    EXPECT_NEAR(there.high, 1 - back.low, 1e-12);
  }
}

// Claim: it is wider than the interval for a number that was fixed beforehand, and stays sane for a billion.
TEST(ConfidenceSequence, IsWiderThanClopperPearsonAndNarrows) {
  double before = 1;
  for (std::uint64_t n = 64; n < std::uint64_t{4} << 30; n *= 4) {
    const Interval sequence = confidence_sequence(n / 4, n), fixed = clopper_pearson(n / 4, n);
    EXPECT_LT(sequence.low, fixed.low);
    EXPECT_GT(sequence.high, fixed.high);
    EXPECT_LT(sequence.high - sequence.low, 0.6 * before);
    before = sequence.high - sequence.low;
  }
}

// Claim: of 4000 campaigns that are looked at after every one of 4000 particles, at most 5 % have any interval that
// misses the true rate (false-alarm rate of this test: 4 standard errors, six comparisons, 1.9e-4). The looking is
// real: Clopper-Pearson intervals, which are for one look, miss in far more of the same campaigns. Nor is the sequence
// so wide that the test could not fail: over 1 % of campaigns are missed.
TEST(ConfidenceSequence, CoversAtAllLooksTogether) {
  constexpr int kCampaigns = 4000;
  constexpr std::uint32_t kParticles = 4000;
  for (const auto& [rate, mass] :
       {std::pair{0.02, 0.0}, {0.3, 0.0}, {0.5, 0.0}, {0.95, 0.0}, {0.3, 160.0}, {0.95, 160.0}}) {
    int missed = 0, missed_by_fixed = 0;
    for (std::uint32_t campaign = 0; campaign < kCampaigns; ++campaign) {
      Bet bet(rate, mass);
      std::uint64_t k = 0;
      bool miss = false, fixed = false;
      for (std::uint32_t i = 0; i < kParticles; ++i) {
        const bool success = uniform(5, i, campaign, static_cast<std::uint32_t>(1000 * rate)) < rate;
        bet.see(success);
        k += success;
        miss = miss || bet.log_stake() >= std::log(20);
        if (fixed || campaign >= 200 || (i + 1) % 64 != 0) continue;
        const Interval interval = clopper_pearson(k, i + 1);
        fixed = rate < interval.low || rate > interval.high;
      }
      missed += miss;
      missed_by_fixed += fixed;
    }
    const double error = std::sqrt(0.05 * 0.95 / kCampaigns);
    EXPECT_LE(missed, (0.05 + 4 * error) * kCampaigns) << rate;
    EXPECT_GE(missed, 0.01 * kCampaigns) << rate;
    EXPECT_GT(missed_by_fixed, 0.12 * 200) << rate;
  }
}

// Claim: with the looks of a campaign and real stopping, both kinds of wrong answer to `p >= 0.9` stay under 5 %, at
// rates just on the wrong side of the bound; the truth is found when the rate is clear of it.
TEST(ConfidenceSequence, AnswersWrongInAtMostFivePercent) {
  const Question question = parse_question("p >= 0.9", "--until");
  const auto answer = [&](double rate, std::uint32_t campaign) {
    std::uint64_t k = 0, n = 0;
    for (const std::uint64_t look : look_boundaries(20000)) {
      for (; n < look; ++n) k += uniform(9, static_cast<std::uint32_t>(n), campaign, 1) < rate;
      const Verdict verdict = judge(question, confidence_sequence(k, n));
      if (verdict != Verdict::open) return verdict;
    }
    return Verdict::open;
  };
  int falsely_held = 0, falsely_refuted = 0, held = 0, refuted = 0;
  constexpr int kCampaigns = 1000;
  for (std::uint32_t campaign = 0; campaign < kCampaigns; ++campaign) {
    falsely_held += answer(0.8995, campaign) == Verdict::holds;
    falsely_refuted += answer(0.9005, campaign) == Verdict::refuted;
    held += answer(0.94, campaign) == Verdict::holds;
    refuted += answer(0.85, campaign) == Verdict::refuted;
  }
  EXPECT_LE(falsely_held, 0.05 * kCampaigns);
  EXPECT_LE(falsely_refuted, 0.05 * kCampaigns);
  EXPECT_GE(held, 0.99 * kCampaigns);
  EXPECT_GE(refuted, 0.99 * kCampaigns);
}

// Claim: looks are multiples of 64 that depend on nothing but the particle number, few, and end with the last particle.
TEST(LookBoundaries, GrowSlowlyAndDependOnNothing) {
  EXPECT_EQ(look_boundaries(10), std::vector<std::uint64_t>{10});
  EXPECT_EQ(look_boundaries(64), std::vector<std::uint64_t>{64});
  EXPECT_EQ(look_boundaries(130), (std::vector<std::uint64_t>{64, 128, 130}));
  const auto few = look_boundaries(100'000), many = look_boundaries(10'000'000);
  EXPECT_TRUE(std::equal(few.begin(), few.end() - 1, many.begin()));
  EXPECT_EQ(few.back(), 100'000u);
  EXPECT_LT(many.size(), 200u);
  for (std::size_t i = 1; i + 1 < many.size(); ++i) {
    EXPECT_EQ(many[i] % 64, 0u);
    EXPECT_LE(many[i] - many[i - 1], std::max<std::uint64_t>(64, many[i - 1] / 16));
  }
  EXPECT_LT(look_boundaries(std::uint64_t{1} << 32).size(), 5000u);
}

TEST(Question, ReadsWhatItSays) {
  const Question above = parse_question(" p >= 0.95 ", "--until");
  EXPECT_EQ(above.kind, Question::Kind::rate_above);
  EXPECT_EQ(above.bound, 0.95);
  EXPECT_EQ(above.selector, "*");
  EXPECT_EQ(above.text, "p >= 0.95");
  const Question below = parse_question("step/*cm : p<5%", "--until");
  EXPECT_EQ(below.kind, Question::Kind::rate_below);
  EXPECT_EQ(below.bound, 0.05);
  EXPECT_EQ(below.selector, "step/*cm");
  EXPECT_EQ(parse_question("ci < 2 %", "--until").kind, Question::Kind::narrow);
  EXPECT_EQ(parse_question("ci < 2 %", "--until").bound, 0.02);
  EXPECT_EQ(parse_fraction("99%", "--confidence"), 0.99);
}

// Claim: each mistake is told with the text, the place and an answer that would be right (which then reads).
TEST(Question, MistakesAreToldWithTheNearestRightAnswer) {
  const auto expect = [](const std::string& text, int place, const std::string& what, const std::string& right) {
    try {
      parse_question(text, "--until");
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("--until '" + text + "':" + std::to_string(place) + ": " + what));
      EXPECT_THAT(error.what(), HasSubstr("nearest right answer: '" + right + "'"));
      EXPECT_NO_THROW(parse_question(right, "--until")) << right;
    }
  };
  expect("rate >= 0.9", 1, "'rate' is neither p", "p >= 0.9");
  expect("", 1, "'' is neither p", "p >= 0.95");
  expect("p => 0.9", 3, "'=>': a rate is asked", "p >= 0.9");
  expect("p 0.9", 3, "'': a rate is asked", "p >= 0.9");
  expect("ci >= 0.02", 4, "'>=': an interval can only be asked to be narrow", "ci < 0.02");
  expect("p >= 95", 6, "95 is not between 0 and 1", "p >= 95%");
  expect("p >= 1", 6, "1 is not between", "p >= 0.95");
  expect("p >= 1.5", 6, "1.5 is not between", "p >= 0.95");
  expect("p < 120%", 5, "120 % is not between", "p < 0.95");
  expect("p >= high", 6, "a number is missing", "p >= 0.95");
  expect("ci < 0.02 m", 11, "'m' behind the number", "ci < 0.02");
  expect("step/4cm: q >= 0.9", 11, "'q' is neither p", "step/4cm: p >= 0.9");
  expect("p = 0.9", 3, "'=': a rate is asked", "p >= 0.9");
  expect("p =< 5 %", 3, "'=<': a rate is asked", "p < 5%");
  expect("soft p >= 0.9", 1, "'soft' is neither p", "soft: p >= 0.9");
  expect("soft ci > 2%", 1, "'soft' is neither p", "soft: ci < 2%");
  expect("90%", 1, "'' is neither p", "p >= 90%");
  expect("p >= -0.9", 6, "-0.9 is not between", "p >= 0.95");
  expect("step/4cm >= 0.9", 1, "'step' is neither p", "p >= 0.9");
  expect(": p >= 0.9", 1, "no policy before ':'", "p >= 0.9");
}

TEST(Question, SelectorsMustChooseAPolicy) {
  const std::vector<std::string> policies = {"step/1cm", "step/4cm"};
  EXPECT_NO_THROW(check_selectors({parse_question("step/*: p >= 0.9", "--until")}, policies));
  try {
    check_selectors({parse_question("step/4m: p >= 0.9", "--until")}, policies);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("nearest: step/4cm"));
  }
}

// Claim: an answer is asked for by each question for each policy that it is about; others do not matter.
TEST(Question, AnswersAreCountedForEachPolicyItIsAbout) {
  const std::vector<std::string> policies = {"a", "b"};
  const std::vector<RateCount> counts = {{990, 1000}, {9, 10}};
  const auto count = [&](const std::vector<std::string>& texts) {
    std::vector<Question> questions;
    for (const std::string& text : texts) questions.push_back(parse_question(text, "-"));
    const AnswerCount answers = count_answers(questions, policies, counts, 0.95);
    return std::pair(answers.answered, answers.all);
  };
  EXPECT_EQ(count({"a: p >= 0.9"}), std::pair(1ul, 1ul));
  EXPECT_EQ(count({"p >= 0.9"}), std::pair(1ul, 2ul));
  EXPECT_EQ(count({"a: p >= 0.9", "b: ci < 0.1"}), std::pair(1ul, 2ul));
  EXPECT_EQ(count({"p < 0.1", "a: ci < 0.9"}), std::pair(3ul, 3ul));
}

// Claim: a rate is told only if the invalid traces could not have changed it; the width of its interval is that of the
// valid ones.
TEST(Question, RatesAreToldWhateverInvalidTracesWouldHaveDone) {
  const auto answered = [](const std::string& text, const RateCount& count) {
    return count_answers({parse_question(text, "-")}, {"a"}, {count}, 0.95).answered;
  };
  EXPECT_EQ(answered("p >= 0.9", {990, 1000, 0}), 1u);
  EXPECT_EQ(answered("p >= 0.9", {990, 1000, 20}), 1u);
  EXPECT_EQ(answered("p >= 0.9", {990, 1000, 200}), 0u);  // 0.825 of all, if they had failed
  EXPECT_EQ(answered("p < 0.1", {10, 1000, 200}), 0u);    // 0.175 of all, if they had succeeded
  EXPECT_EQ(answered("p >= 0.9", {100, 1000, 200}), 1u);  // refuted whatever they would have done
  EXPECT_EQ(answered("ci < 0.1", {990, 1000, 200}), 1u);
  EXPECT_EQ(answered("p >= 0.9", {0, 0, 1000}), 0u);
}

}  // namespace
}  // namespace graze
