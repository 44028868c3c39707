#pragma once
// Why a campaign ended as it did, as plain numbers: causes, modes, survival and statistics of each policy. The text,
// JSON and tables of `graze explain` come from these.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/bifurcation_causes.h"
#include "analysis/rates.h"
#include "analysis/scatter.h"
#include "analysis/score.h"
#include "analysis/survival.h"
#include "archive/archive.h"

namespace graze {

/// The traces of one mode of final states: what became of them, and which they are.
struct ModeTraces {
  std::uint64_t success = 0, known = 0, unknown = 0;
  std::vector<std::uint32_t> particles;  // rising
};

/// How far traces are apart at one time.
struct SpreadAt {
  double time = 0;                 // s
  std::vector<double> deviations;  // standard, by Growth::names
};
struct Growth {
  std::vector<std::string> names, units;  // of floating bodies' degrees of freedom, else of joints: six at most
  std::vector<SpreadAt> times;
  std::size_t traces = 0;  // looked at, up to 100 chosen evenly
  std::string note;        // why there is nothing
};

/// The margins that a target is, one of these; null: it is something else.
const MarginSummary* margins_of(const Causes& causes, const std::vector<MarginSummary>& margins);

struct PolicyExplanation {
  std::string policy;
  std::uint64_t n = 0, success = 0, known = 0, unknown = 0, invalid = 0;  // of the particles looked at
  /// Success, failures by requirement, unmet objective, modes, margins; then branches of bifurcations.
  std::vector<Causes> causes;
  std::size_t bifurcations = 0;       // the last so many of them, which are corrected for each other alone
  std::vector<std::string> verdicts;  // of all, in words
  Scatter ended, all;                 // of valid traces that ran to the end, and of all valid ones
  std::vector<ModeTraces> modes;      // of `ended`, by its clearest degree of freedom; empty: one mode
  Growth growth;
  std::vector<Survival> survival;       // any requirement, then each; last the objective, which fails at the end
  std::vector<MarginSummary> margins;   // requirements and measures, then the objective
  std::vector<std::uint64_t> sizes;     // particles for each of kHalfWidths
  std::vector<DecisionSize> decisions;  // for each of kBounds
};
inline constexpr double kHalfWidths[] = {0.05, 0.02, 0.01};
inline constexpr double kBounds[] = {0.5, 0.9, 0.95, 0.99};

/// Two policies' survival, particle by particle.
struct SurvivalPair {
  std::string a, b;
  LogRank plain, paired;
  double p_holm = 1;  // of the paired test, over all pairs
};

struct Explanation {
  std::string campaign, archive;
  bool complete = true;
  std::uint64_t particles = 0;  // of the campaign
  std::uint64_t looked_at = 0;  // the first so many of them
  ParticleTable parameters;     // a row for each particle that has values
  std::vector<PolicyExplanation> policies;
  Score score;  // of all particles
  RateStatistics rates;
  LogRank log_rank;  // of all policies together
  std::vector<SurvivalPair> pairs;
  std::vector<std::string> notes;
};

struct ExplainOptions {
  std::uint64_t most_particles = kMostExplained;  // beyond it only rates count them
};

/// `policies`: those of the archive's that it is about; empty: all. A function of the archive's content alone. Memory:
/// about 16 bytes for each parameter, 8 for each coordinate and 20 for each contact phase of a particle. Throws
/// InputError: the archive is damaged.
Explanation explain(const Archive& archive, const std::vector<std::string>& policies = {},
                    const ExplainOptions& options = {});

/// Only how long traces last and whether policies differ in it: names, numbers of traces and `survival` of each policy,
/// `log_rank` and `pairs`, as explain() has them. Takes little longer than reading.
Explanation explain_survival(const Archive& archive, const std::vector<std::string>& policies = {},
                             const ExplainOptions& options = {});

/// For people, 80 columns wide but for names that are longer.
std::string format_explanation(const Explanation& explanation);
/// Everything, for scripts.
std::string explanation_json(const Explanation& explanation);

/// A table for other programs: its name, column names, and cells as text.
struct ExplanationTable {
  std::string name;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};
/// causes, rules, spread, modes, survival, margins, rates, convergence.
std::vector<ExplanationTable> explanation_tables(const Explanation& explanation);

}  // namespace graze
