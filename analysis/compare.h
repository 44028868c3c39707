#pragma once
// Two campaigns side by side: on the same particles, who was fixed and who broke.

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/convergence.h"
#include "analysis/proportions.h"
#include "analysis/scenario_changes.h"
#include "archive/archive.h"

namespace graze {

struct CompareRequest {
  std::string name_a, name_b;         // as replay commands shall name them
  std::vector<std::string> policies;  // of both; empty: all that both have
  std::string policy_a, policy_b;     // or one of each
};

/// Whether particle i of both campaigns is the same robot in the same world.
struct SameParticles {
  std::string others;               // why they have nothing in common: "the seeds differ (1 and 2)"; empty: they have
  std::uint64_t compared = 0;       // particles whose values were compared: the first few thousand that both keep
  std::vector<std::string> common;  // parameters of both with equal values
  std::vector<std::string> differ;  // of both, with other values
  std::vector<std::string> only_a, only_b;
  bool same() const { return others.empty() && differ.empty(); }
};

/// One particle that ends otherwise in b than in a.
struct Change {
  std::uint32_t particle;
  std::string in_a, in_b;                     // "success", the requirement that was violated, "objective"
  bool flagged_a = false, flagged_b = false;  // more of its steps did not converge than that campaign lets pass
};

/// A margin on the same particles, of the pairs of traces that ended at the same time: a trace that was cut short has
/// had less time to come near a violation.
struct MarginChange {
  std::string requirement, unit;
  std::uint64_t n = 0, better = 0, worse = 0;  // such pairs with a finite margin in both; larger, smaller in b
  double low = 0, median = 0, high = 0;        // quartiles of b - a
  double p_value = 1;                          // sign test, exact
};

struct PolicyComparison {
  std::string policy_a, policy_b;
  std::uint64_t n_a = 0, success_a = 0, n_b = 0, success_b = 0;  // valid traces of each
  PairedTable pairs;         // of particles with a valid trace in both: only_a broke, only_b was fixed
  std::uint64_t uneven = 0;  // pairs that did not end at the same time
  bool paired = true;        // else the particles are others, and the numbers below take them for independent
  double difference = 0;     // success rate of b minus that of a; NaN: no traces
  Interval interval;         // 95 %: Newcombe, for paired or independent proportions
  double p_value = 1;        // McNemar, exact; Fisher, exact
  double corrected = 1;      // by Holm, over the policies that are compared
  std::vector<std::pair<std::string, std::vector<std::uint64_t>>> moves;  // outcome in a: counts by `ends`
  std::vector<std::string> ends;                                          // outcomes in b
  std::vector<Change> fixed, broken;                                      // by particle
  std::vector<MarginChange> margins;
  Convergence convergence_a, convergence_b;  // of the contact solver, over all traces of each
};

struct Comparison {
  CompareRequest request;
  std::string campaign_a, campaign_b;
  bool complete_a = true, complete_b = true;
  bool trust_b = false;                         // needs_trust(), of b
  double unconverged_a = 0, unconverged_b = 0;  // shares of steps, above which a trace is flagged
  SameParticles particles;
  std::vector<ScenarioChange> changes;  // of the scenario
  std::vector<PolicyComparison> policies;
};

/// Throws InputError: no policy in common.
Comparison compare_campaigns(const Archive& a, const Archive& b, const CompareRequest& request);

/// For people; `most`: particles listed as fixed and broken.
std::string format_comparison(const Comparison& comparison, std::size_t most);
std::string comparison_json(const Comparison& comparison);
/// One line per particle that ends otherwise: policies, particle, outcome in a, outcome in b.
std::string changes_csv(const Comparison& comparison);

}  // namespace graze
