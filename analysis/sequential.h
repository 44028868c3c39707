#pragma once
// Looking at a success rate while the campaign runs. A confidence sequence holds at every look at once, so that a
// campaign may stop as soon as its question is answered. docs/statistics.md says what it promises and what it costs.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/score.h"

namespace graze {

/// The confidence sequence of a rate after k successes of n: the rates p at which the beta-binomial mixture martingale
///   M_n(p) = B(k + 1/2, n - k + 1/2) / (B(1/2, 1/2) p^k (1 - p)^(n - k))
/// is below 1 / (1 - confidence). By Ville's inequality the true rate is in all intervals n = 1, 2, … together with at
/// least that probability (Robbins 1970; Howard, Ramdas, McAuliffe and Sekhon, Annals of Statistics 49 (2021) 1055).
/// `mass` > 0: the mixture is centred at the rate it tests, Beta(mass p, mass (1 - p)) in place of Beta(1/2, 1/2),
/// which makes the sequence tightest when n is some ten times the mass, and wider much earlier and later. A function of
/// k and n alone. n = 0 gives [0, 1]. Throws std::invalid_argument unless 0 < confidence < 1, mass >= 0.
Interval confidence_sequence(std::uint64_t k, std::uint64_t n, double confidence = 0.95, double mass = 0);

/// One `--until` or `--require`: something about the success rate of each policy that the selector chooses.
struct Question {
  enum class Kind { rate_above, rate_below, narrow };  // p >= bound, p < bound, ci < bound
  std::string text;                                    // as asked
  std::string selector = "*";                          // glob of policies
  Kind kind = Kind::narrow;
  double bound = 0;  // a rate, or the full width of the interval (high - low); within (0, 1)
};

/// `[POLICY:] p >= RATE`, `[POLICY:] p < RATE` or `[POLICY:] ci < WIDTH`; numbers as 0.95 or 95 %. Throws InputError
/// with the text, the place and the nearest right answer; `option` names where it was given ("--until").
Question parse_question(const std::string& text, const std::string& option);

/// The mass of the mixture that answers these questions soonest: for the narrowest `ci` of width w, 0.4 / w^2; 0 if
/// none asks for one. All intervals of a campaign are made with it.
double mixture_mass(const std::vector<Question>& questions);

/// What a campaign was asked to stop at. Throws InputError if the archive's questions do not read.
std::vector<Question> questions_of(const CampaignInfo& info);

/// A number within (0, 1), written as 0.95 or 95 %. Throws InputError as parse_question.
double parse_fraction(const std::string& text, const std::string& option);
/// The same of the width of an interval, which some number of particles must reach.
double parse_width(const std::string& text, const std::string& option);

enum class Verdict { open, holds, refuted };
/// "undecided", "holds", "refuted".
const char* verdict_name(Verdict verdict);

/// What an interval of the rate says to a question. `narrow` is never refuted.
Verdict judge(const Question& question, const Interval& interval);

/// Successes among valid traces; invalid ones count in neither.
struct RateCount {
  std::uint64_t success = 0, valid = 0, invalid = 0;
};

/// An interval of the rate after k successes of n.
using IntervalOf = std::function<Interval(std::uint64_t k, std::uint64_t n)>;

/// Of the rate if all invalid traces had failed, or had succeeded: a controller that breaks down on hard robots, and so
/// leaves them out, shall gain nothing by that.
Interval with_invalid(const RateCount& count, const IntervalOf& interval);

/// What traces say to a question about the rate whatever would have become of the invalid ones; to one about the width
/// of its interval, without them.
Verdict judge(const Question& question, const RateCount& count, const IntervalOf& interval);

/// How many answers the questions ask for, one for each policy that each is about, and how many are there.
struct AnswerCount {
  std::size_t answered = 0, all = 0;
};
/// counts: by policy.
AnswerCount count_answers(const std::vector<Question>& questions, const std::vector<std::string>& policies,
                          const std::vector<RateCount>& counts, double confidence);

/// Throws InputError with the nearest name if a selector chooses none of the policies; `option` names where the
/// questions were given.
void check_selectors(const std::vector<Question>& questions, const std::vector<std::string>& policies,
                     const std::string& option = "--until");

/// The looks of a campaign of at most so many particles: numbers of particles, rising, the last one `most`. Each other
/// one is a multiple of 64 that depends on nothing: 64, 128, … 1024, then growing by a sixteenth, by 2^20 at most.
std::vector<std::uint64_t> look_boundaries(std::uint64_t most);

}  // namespace graze
