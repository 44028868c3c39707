#include "analysis/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "analysis/failures.h"
#include "analysis/quantiles.h"
#include "analysis/significance.h"

namespace graze {
namespace {

/// How one trace ended, and its margins.
struct End {
  Outcome outcome = Outcome::invalid;
  int violated = -1;
  double time = 0;  // s
  std::vector<double> margins;
  bool flagged = false;
};

/// Of all traces of a policy, by particle.
using EndOfParticle = std::map<std::uint32_t, End>;

/// Of the valid traces; adds up what became of the contacts of all.
EndOfParticle read_ends(const Archive& archive, const std::string& policy, Convergence& convergence) {
  EndOfParticle out;
  ConvergenceSum sum;
  archive.scan(policy, kEndTime | kMargins | kSolver, [&](const TraceRows& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const SolverLog log = rows.has_solver() ? rows.solver(i) : SolverLog();
      const bool flagged = log.flagged(archive.info().unconverged);
      sum.add(rows.particle(i), rows.outcome(i), log, flagged);
      if (rows.outcome(i) == Outcome::invalid) continue;
      const auto margins = rows.margins(i);
      out[rows.particle(i)] = {
          rows.outcome(i), rows.violated(i), rows.end_time(i), {margins.begin(), margins.end()}, flagged};
    }
  });
  convergence = sum.total();
  return out;
}

/// "success", the requirement that was violated, "objective".
std::string end_name(const End& end, const CampaignInfo& info) {
  if (end.outcome == Outcome::success) return "success";
  if (end.outcome == Outcome::unknown_failure) return "objective";
  return info.requirements[static_cast<std::size_t>(end.violated)].name;
}

std::uint64_t successes(const EndOfParticle& ends) {
  return static_cast<std::uint64_t>(
      std::count_if(ends.begin(), ends.end(), [](const auto& one) { return one.second.outcome == Outcome::success; }));
}

/// `step`: s, of the physics.
bool ended_together(const End& a, const End& b, double step) { return std::abs(a.time - b.time) < 0.5 * step; }

void count_pairs(const EndOfParticle& a, const EndOfParticle& b, const CampaignInfo& info_a, const CampaignInfo& info_b,
                 PolicyComparison& out) {
  std::map<std::string, std::map<std::string, std::uint64_t>> moves;
  std::set<std::string> ends;
  for (const auto& [particle, in_a] : a) {
    const auto found = b.find(particle);
    if (found == b.end()) continue;
    const End& in_b = found->second;
    const bool met_a = in_a.outcome == Outcome::success, met_b = in_b.outcome == Outcome::success;
    ++(met_a ? met_b ? out.pairs.both : out.pairs.only_a : met_b ? out.pairs.only_b : out.pairs.neither);
    if (!ended_together(in_a, in_b, info_a.step)) ++out.uneven;
    const std::string name_a = end_name(in_a, info_a), name_b = end_name(in_b, info_b);
    ++moves[name_a][name_b];
    ends.insert(name_b);
    const Change change{particle, name_a, name_b, in_a.flagged, in_b.flagged};
    if (!met_a && met_b) out.fixed.push_back(change);
    if (met_a && !met_b) out.broken.push_back(change);
  }
  out.ends.assign(ends.begin(), ends.end());
  for (const auto& [name, counts] : moves) {
    std::vector<std::uint64_t> row;
    for (const std::string& end : out.ends) row.push_back(counts.contains(end) ? counts.at(end) : 0);
    out.moves.emplace_back(name, std::move(row));
  }
}

MarginChange margin_change(const EndOfParticle& a, const EndOfParticle& b, std::size_t of_a, std::size_t of_b,
                           const CampaignInfo::RequirementRow& requirement, double step) {
  MarginChange out;
  out.requirement = requirement.name;
  out.unit = requirement.unit;
  std::vector<double> changes;
  for (const auto& [particle, in_a] : a) {
    const auto found = b.find(particle);
    if (found == b.end() || !ended_together(in_a, found->second, step)) continue;
    const double change = found->second.margins[of_b] - in_a.margins[of_a];
    if (!std::isfinite(change)) continue;  // a window that was never reached, in one or both
    changes.push_back(change);
    out.better += change > 0;
    out.worse += change < 0;
  }
  out.n = changes.size();
  out.p_value = mcnemar_exact(out.better, out.worse);  // the sign test: the same binomial
  if (changes.empty()) return out;
  std::sort(changes.begin(), changes.end());
  out.low = quantile(changes, 0.25), out.median = quantile(changes, 0.5), out.high = quantile(changes, 0.75);
  return out;
}

PolicyComparison compare_policies(const Archive& a, const Archive& b, const std::string& policy_a,
                                  const std::string& policy_b, bool paired) {
  PolicyComparison out;
  out.policy_a = policy_a;
  out.policy_b = policy_b;
  out.paired = paired;
  const EndOfParticle ends_a = read_ends(a, policy_a, out.convergence_a),
                      ends_b = read_ends(b, policy_b, out.convergence_b);
  out.n_a = ends_a.size();
  out.n_b = ends_b.size();
  out.success_a = successes(ends_a);
  out.success_b = successes(ends_b);
  if (!paired) {
    out.difference = static_cast<double>(out.success_b) / static_cast<double>(out.n_b) -
                     static_cast<double>(out.success_a) / static_cast<double>(out.n_a);
    out.interval = newcombe_independent(out.success_a, out.n_a, out.success_b, out.n_b);
    out.p_value =
        out.n_a > 0 && out.n_b > 0
            ? fisher_two_sided({out.success_a, out.n_a - out.success_a, out.success_b, out.n_b - out.success_b})
            : 1;
    return out;
  }
  count_pairs(ends_a, ends_b, a.info(), b.info(), out);
  out.difference = paired_difference(out.pairs);
  out.interval = newcombe_paired(out.pairs);
  out.p_value = mcnemar_exact(out.pairs.only_a, out.pairs.only_b);
  for (std::size_t i = 0; i < a.info().requirements.size(); ++i) {
    for (std::size_t j = 0; j < b.info().requirements.size(); ++j) {
      const auto &in_a = a.info().requirements[i], &in_b = b.info().requirements[j];
      if (in_a.name == in_b.name && in_a.unit == in_b.unit) {
        out.margins.push_back(margin_change(ends_a, ends_b, i, j, in_a, a.info().step));
      }
    }
  }
  return out;
}

/// Why particle i of a is not that of b; empty: it is.
std::string why_others(const CampaignInfo& a, const CampaignInfo& b) {
  if (a.q_names != b.q_names) return "the robots differ";
  if (a.seed != b.seed) return fmt::format("the seeds differ ({} and {})", a.seed, b.seed);
  if (a.design != b.design) return fmt::format("the sampling designs differ ({} and {})", a.design, b.design);
  if (a.design == "latin_hypercube" && a.particles != b.particles) {
    return fmt::format("points of a Latin hypercube depend on how many there are ({} and {})", a.particles,
                       b.particles);
  }
  return "";
}

/// Particles whose values are compared: another seed, design or distribution shows in any of them.
constexpr std::uint32_t kMostCompared = 4096;

/// Values of parameters that both have, on the first particles that both have.
void compare_values(const Archive& a, const Archive& b, SameParticles& out) {
  std::map<std::string, std::size_t> column_b;
  for (std::size_t i = 0; i < b.info().parameters.size(); ++i) column_b[b.info().parameters[i].name] = i;
  std::vector<std::pair<std::size_t, std::size_t>> common;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < a.info().parameters.size(); ++i) {
    const std::string& name = a.info().parameters[i].name;
    const auto found = column_b.find(name);
    if (found == column_b.end()) {
      out.only_a.push_back(name);
      continue;
    }
    common.emplace_back(i, found->second);
    names.push_back(name);
    column_b.erase(found);
  }
  for (const auto& [name, column] : column_b) out.only_b.push_back(name);
  std::map<std::uint32_t, std::vector<double>> values;
  a.scan_values([&](std::uint32_t particle, std::span<const double> row) {
    if (particle >= kMostCompared) return;
    std::vector<double>& own = values[particle];
    for (const auto& [i, j] : common) own.push_back(row[i]);
  });
  std::vector<bool> differ(common.size());
  b.scan_values([&](std::uint32_t particle, std::span<const double> row) {
    const auto found = values.find(particle);
    if (found == values.end()) return;
    ++out.compared;
    for (std::size_t k = 0; k < common.size(); ++k) {
      if (found->second[k] != row[common[k].second]) differ[k] = true;
    }
  });
  if (out.compared == 0) return;
  for (std::size_t k = 0; k < names.size(); ++k) (differ[k] ? out.differ : out.common).push_back(names[k]);
}

std::vector<std::pair<std::string, std::string>> policies_of(const CampaignInfo& a, const CampaignInfo& b,
                                                             const CompareRequest& request) {
  if (!request.policy_a.empty()) return {{request.policy_a, request.policy_b}};
  std::vector<std::pair<std::string, std::string>> out;
  for (const std::string& policy : a.policies) {
    const auto has = [&](const std::vector<std::string>& all) {
      return std::find(all.begin(), all.end(), policy) != all.end();
    };
    if (has(b.policies) && (request.policies.empty() || has(request.policies))) out.emplace_back(policy, policy);
  }
  if (out.empty() && a.policies.size() == 1 && b.policies.size() == 1) {
    out.emplace_back(a.policies.front(), b.policies.front());
  }
  if (out.empty()) {
    throw InputError(fmt::format("no policy in common: {} has {}; {} has {}; name one of each by --policy and --with",
                                 request.name_a, fmt::join(a.policies, ", "), request.name_b,
                                 fmt::join(b.policies, ", ")));
  }
  return out;
}

}  // namespace

Comparison compare_campaigns(const Archive& a, const Archive& b, const CompareRequest& request) {
  Comparison out;
  out.request = request;
  out.campaign_a = a.info().scenario_name;
  out.campaign_b = b.info().scenario_name;
  out.complete_a = a.complete();
  out.complete_b = b.complete();
  out.unconverged_a = a.info().unconverged;
  out.unconverged_b = b.info().unconverged;
  out.trust_b = needs_trust(b.info());
  const auto policies = policies_of(a.info(), b.info(), request);
  out.particles.others = why_others(a.info(), b.info());
  out.changes = scenario_changes(a.info().scenario_text, b.info().scenario_text);
  const std::vector<ScenarioChange> of_files = file_changes(a.info().source.inputs, b.info().source.inputs);
  out.changes.insert(out.changes.end(), of_files.begin(), of_files.end());
  compare_values(a, b, out.particles);
  std::vector<double> p_values;
  for (const auto& [policy_a, policy_b] : policies) {
    out.policies.push_back(compare_policies(a, b, policy_a, policy_b, out.particles.others.empty()));
    p_values.push_back(out.policies.back().p_value);
  }
  const std::vector<double> corrected = holm(p_values);
  for (std::size_t i = 0; i < corrected.size(); ++i) out.policies[i].corrected = corrected[i];
  return out;
}

}  // namespace graze
