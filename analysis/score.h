#pragma once
// Scores: how often each policy succeeds, how it fails, and whether two policies differ on the same particles.

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/convergence.h"
#include "analysis/culprits.h"
#include "analysis/failures.h"
#include "archive/archive.h"

namespace graze {

struct Interval {
  double low = 0, high = 1;
};

/// Clopper-Pearson interval for k successes of n (exact, conservative). n = 0 gives [0, 1].
Interval clopper_pearson(std::uint64_t k, std::uint64_t n, double confidence = 0.95);

/// Two-sided exact McNemar p-value for b and c discordant pairs (binomial, p = 1/2).
double mcnemar_exact(std::uint64_t b, std::uint64_t c);

struct PolicyScore {
  std::string policy;
  std::uint64_t n = 0;  // valid traces, S + K + U
  std::uint64_t success = 0, known = 0, unknown = 0, invalid = 0;
  std::vector<std::uint64_t> by_requirement;  // known failures, by the requirement that was violated first
  std::uint64_t objective_met = 0;  // valid traces that lasted and met the objective, whatever they violated on the way
  double rate = 0;                  // success / n; NaN if n = 0
  Interval interval;  // 95 %: Clopper-Pearson, or the confidence sequence if --until chose the number of particles
  struct Kept {
    std::uint64_t all = 0, met = 0;  // valid traces that kept a measure; of these, those that met the objective
    std::uint64_t undecided = 0;     // valid traces that ended before they had shown it; not among the others
    Interval interval = {};          // of all / n, 95 %, Clopper-Pearson
  };
  std::vector<Kept> kept = {};                 // per measure
  std::vector<Culprits::Count> culprits = {};  // failures, by the part that is to blame
  Convergence convergence = {};                // of the contact solver
};

/// Policies a and b on the particles for which both traces are valid.
struct PairedComparison {
  std::string a, b;
  std::uint64_t n = 0, both = 0, only_a = 0, only_b = 0, neither = 0;
  double difference = 0;  // rate(b) - rate(a) on these particles
  Interval interval;      // 95 %, Newcombe's score interval for paired proportions
  double p_value = 1;     // McNemar, exact
};

/// What became of one question of --until for one policy.
struct Answer {
  std::string question, policy, verdict;  // "holds", "refuted", "undecided"
  std::uint64_t n = 0, invalid = 0;       // valid traces, and the others, which may leave a rate undecided
  Interval interval;                      // of the confidence sequence, at the questions' confidence
  bool by_invalid = false;                // it would have an answer without the invalid traces
};

struct Score {
  std::string campaign;
  std::vector<std::string> requirements, measures;
  std::vector<PolicyScore> policies;
  std::vector<PairedComparison> pairs;
  bool complete = true;
  ParticleRange part;                // if it is one of several parts of a campaign
  std::uint64_t particles = 0;       // of the campaign; with --until those that it stopped at
  bool stopped_by_question = false;  // --until chose the number of particles: intervals are of the confidence sequence
  double mixture_mass = 0;           // of the confidence sequence
  double confidence = 0.95;          // of the answers
  double unconverged = 0;            // share of steps, above which a trace is flagged
  std::vector<Answer> answers;       // of a complete campaign with --until
  std::string archive;               // as replay commands name it
  bool trust = false;                // needs_trust()
  std::string failures_command;      // that lists every failure of these policies
  std::string flagged_command;       // that lists every flagged trace of them
  std::vector<Failure> failures;     // the first of each kind
  /// Of a rate of k among n traces of a policy: Clopper-Pearson, or the confidence sequence where --until chose n.
  Interval interval(std::uint64_t k, std::uint64_t n, double level = 0.95) const;
};

/// `name`: the archive as replay commands shall name it; empty: its path. `policies`: those of the archive's that it is
/// about; empty: all.
Score score(const Archive& archive, const std::string& name = "", const std::vector<std::string>& policies = {});

/// The table as printed, and as JSON text; `failures`: with the first of each kind.
std::string format_score(const Score& score, bool failures = true);
std::string score_json(const Score& score, bool failures = true);

}  // namespace graze
