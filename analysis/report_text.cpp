// A score as a table for people and as JSON for scripts.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "analysis/json_of.h"
#include "analysis/number_words.h"
#include "analysis/rates.h"
#include "analysis/score.h"
#include "analysis/text_table.h"
#include "archive/files/utf8.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;
using graze::json_of;
using Rows = std::vector<std::vector<std::string>>;

constexpr std::size_t kMostKinds = 16;     // lines of the table of failures
constexpr std::size_t kMostCulprits = 16;  // lines of the table of culprits

std::uint64_t failed_traces(const Score& score) {
  std::uint64_t failed = 0;
  for (const PolicyScore& policy : score.policies) failed += policy.known + policy.unknown + policy.invalid;
  return failed;
}

std::string decimal(double x) { return std::isnan(x) ? "-" : fmt::format("{:.4f}", x); }
std::string signed_interval_text(const Interval& interval) {
  return fmt::format("{:+.4f} .. {:+.4f}", interval.low, interval.high);
}

/// The column "objective" is there only where it says more than S: where traces went on after a violation. The column
/// "flagged", of the N, is there only if there are such traces.
std::string policy_table(const std::vector<PolicyScore>& policies) {
  const bool met_after_violation =
      std::any_of(policies.begin(), policies.end(), [](const PolicyScore& p) { return p.objective_met > p.success; });
  Rows rows = {{"policy", "N", "S", "K", "U", "invalid", "rate", "95 % interval"}};
  const bool flagged = std::any_of(policies.begin(), policies.end(),
                                   [](const PolicyScore& p) { return p.convergence.flagged_valid() > 0; });
  if (met_after_violation) rows[0].push_back("objective met");
  if (flagged) rows[0].push_back("flagged");
  for (const PolicyScore& p : policies) {
    rows.push_back({p.policy, std::to_string(p.n), std::to_string(p.success), std::to_string(p.known),
                    std::to_string(p.unknown), std::to_string(p.invalid), decimal(p.rate), interval_text(p.interval)});
    if (met_after_violation) rows.back().push_back(std::to_string(p.objective_met));
    if (flagged) rows.back().push_back(std::to_string(p.convergence.flagged_valid()));
  }
  return text_table(rows, 1);
}

/// With the command that lists flagged traces where there are any.
std::string convergence_text(const Score& score) {
  std::vector<NamedConvergence> rows;
  bool flagged = false;
  for (const PolicyScore& p : score.policies) {
    rows.push_back({p.policy, p.convergence});
    flagged = flagged || p.convergence.flagged_all() > 0;
  }
  const std::string table = convergence_table(rows, flag_rule(score.unconverged));
  return flagged ? table + fmt::format("'{}' lists the flagged traces\n", score.flagged_command) : table;
}

std::string answer_table(const Score& score) {
  Rows rows = {{"question", "policy", "answer", "N", fmt::format("{:g} % sequence", 100 * score.confidence)}};
  for (const Answer& a : score.answers) {
    rows.push_back({a.question, a.policy, a.verdict, std::to_string(a.n), interval_text(a.interval)});
  }
  std::string open;
  for (const Answer& a : score.answers) {
    if (!a.by_invalid) continue;
    open += fmt::format("{}: {}: left open by {} invalid traces, of which nobody knows how they would have ended\n",
                        a.question, a.policy, a.invalid);
  }
  return text_table(rows, 3) + open;
}

std::string requirement_table(const Score& score) {
  Rows rows = {{"policy"}};
  rows[0].insert(rows[0].end(), score.requirements.begin(), score.requirements.end());
  for (const PolicyScore& p : score.policies) {
    rows.push_back({p.policy});
    for (const std::uint64_t count : p.by_requirement) rows.back().push_back(std::to_string(count));
  }
  return text_table(rows, 1);
}

/// One line per policy and measure. The column "undecided" is there only if there is such a trace.
std::string measure_table(const Score& score) {
  const bool undecided = std::any_of(score.policies.begin(), score.policies.end(), [](const PolicyScore& p) {
    return std::any_of(p.kept.begin(), p.kept.end(), [](const PolicyScore::Kept& kept) { return kept.undecided > 0; });
  });
  Rows rows = {{"policy", "measure", "N", "kept", "rate", "95 % interval", "objective met", "of these kept"}};
  if (undecided) rows[0].push_back("undecided");
  for (const PolicyScore& p : score.policies) {
    for (std::size_t k = 0; k < p.kept.size(); ++k) {
      const PolicyScore::Kept& kept = p.kept[k];
      const double rate = static_cast<double>(kept.all) / static_cast<double>(p.n);  // NaN if n = 0
      rows.push_back({p.policy, score.measures[k], std::to_string(p.n), std::to_string(kept.all), decimal(rate),
                      interval_text(kept.interval), std::to_string(p.objective_met), std::to_string(kept.met)});
      if (undecided) rows.back().push_back(std::to_string(kept.undecided));
    }
  }
  return text_table(rows, 2);
}

/// A line per culprit, a column per policy; lines in the order in which policies bring them up.
std::string culprit_table(const Score& score) {
  Rows rows = {{"requirement", "culprit"}};
  std::map<std::pair<std::string, std::string>, std::size_t> line;
  const std::size_t policies = score.policies.size();
  for (std::size_t k = 0; k < policies; ++k) {
    rows[0].push_back(score.policies[k].policy);
    for (const Culprits::Count& count : score.policies[k].culprits) {
      const auto [at, fresh] = line.emplace(std::pair(count.what, count.culprit), rows.size());
      if (fresh) {
        rows.push_back({count.what, count.culprit});
        rows.back().resize(2 + policies, "0");
      }
      rows[at->second][2 + k] = std::to_string(count.traces);
    }
  }
  const std::size_t left = rows.size() > 1 + kMostCulprits ? rows.size() - 1 - kMostCulprits : 0;
  rows.resize(rows.size() - left);
  return text_table(rows, 2) + (left == 0 ? "" : fmt::format("… and {} more culprits (--json has all)\n", left));
}

std::string pair_table(const std::vector<PairedComparison>& all) {
  std::vector<double> p_values;
  for (const PairedComparison& p : all) p_values.push_back(p.p_value);
  const std::vector<std::size_t> shown = pairs_to_show(p_values);
  Rows rows = {{"a", "b", "pairs", "both", "only a", "only b", "neither", "rate b - a", "95 % interval", "McNemar p"}};
  for (const std::size_t i : shown) {
    const PairedComparison& p = all[i];
    rows.push_back({p.a, p.b, std::to_string(p.n), std::to_string(p.both), std::to_string(p.only_a),
                    std::to_string(p.only_b), std::to_string(p.neither),
                    std::isnan(p.difference) ? "-" : fmt::format("{:+.4f}", p.difference),
                    signed_interval_text(p.interval), p_text(p.p_value, 3)});
  }
  return text_table(rows, 2) + pairs_left_out(all.size(), shown.size());
}

Json json_of(const PolicyScore& p, const std::vector<std::string>& requirements,
             const std::vector<std::string>& names) {
  Json culprits = Json::array();
  for (const Culprits::Count& one : p.culprits) {
    culprits.push_back({{"requirement", one.what}, {"culprit", one.culprit}, {"traces", one.traces}});
  }
  Json by_requirement = Json::object();
  for (std::size_t i = 0; i < requirements.size(); ++i) by_requirement[requirements[i]] = p.by_requirement[i];
  Json measures = Json::object();
  for (std::size_t k = 0; k < p.kept.size(); ++k) {
    const PolicyScore::Kept& kept = p.kept[k];
    measures[names[k]] = {{"kept", kept.all},
                          {"undecided", kept.undecided},
                          {"kept_and_objective_met", kept.met},
                          {"interval", json_of(kept.interval)}};
  }
  return {{"policy", p.policy},
          {"n", p.n},
          {"success", p.success},
          {"known_failure", p.known},
          {"by_requirement", by_requirement},
          {"culprits", culprits},
          {"unknown_failure", p.unknown},
          {"objective_met", p.objective_met},
          {"measures", measures},
          {"invalid", p.invalid},
          {"rate", json_of(p.rate)},
          {"interval", json_of(p.interval)},
          {"convergence", convergence_json(p.convergence)}};
}

Json json_of(const Answer& a) {
  return {{"question", a.question}, {"policy", a.policy},
          {"answer", a.verdict},    {"n", a.n},
          {"invalid", a.invalid},   {"interval", json_of(a.interval)}};
}

Json json_of(const PairedComparison& p) {
  return {{"a", p.a},
          {"b", p.b},
          {"n", p.n},
          {"both", p.both},
          {"only_a", p.only_a},
          {"only_b", p.only_b},
          {"neither", p.neither},
          {"difference", json_of(p.difference)},
          {"interval", json_of(p.interval)},
          {"p_value", p.p_value}};
}

}  // namespace

std::string format_score(const Score& score, bool failures) {
  std::string out = printable(score.campaign);
  if (score.part.end > 0) {
    out.append(
        fmt::format(" (ONE PART: particles {} to {} of {})", score.part.begin, score.part.end - 1, score.particles));
  }
  out.append(score.complete ? "\n" : " (INCOMPLETE: not all traces have been simulated)\n");
  out.append("\n").append(policy_table(score.policies));
  out.append(convergence_text(score));
  if (!score.answers.empty()) {
    out.append(fmt::format("\nAsked by --until; {} particles\n", score.particles)).append(answer_table(score));
  }
  if (!score.requirements.empty()) {
    out.append("\nKnown failures by the requirement that was violated first\n").append(requirement_table(score));
  }
  if (!score.measures.empty()) {
    out.append("\nMeasures, which decide nothing: valid traces that kept them\n").append(measure_table(score));
  }
  if (std::any_of(score.policies.begin(), score.policies.end(), [](const auto& p) { return !p.culprits.empty(); })) {
    out.append("\nFailures by the part that is to blame: below 0 first, or short of the objective\n");
    out.append(culprit_table(score));
  }
  if (!score.pairs.empty()) {
    out.append("\nThe same particles under two policies\n").append(pair_table(score.pairs));
  }
  if (failures) out.append(format_failures(score.failures, score.archive, score.failures_command, kMostKinds));
  return out;
}

std::string score_json(const Score& score, bool failures) {
  Json json = {{"campaign", score.campaign}, {"complete", score.complete},
               {"confidence", 0.95},         {"requirements", score.requirements},
               {"measures", score.measures}, {"policies", Json::array()},
               {"pairs", Json::array()}};
  for (const PolicyScore& policy : score.policies)
    json["policies"].push_back(json_of(policy, score.requirements, score.measures));
  for (const PairedComparison& pair : score.pairs) json["pairs"].push_back(json_of(pair));
  json["interval_method"] = score.stopped_by_question ? "confidence_sequence" : "clopper_pearson";
  json["particles"] = score.particles;
  json["unconverged_limit"] = score.unconverged;
  if (score.part.end > 0) json["part"] = {{"begin", score.part.begin}, {"end", score.part.end}};
  if (score.stopped_by_question) {
    json["until"] = {{"confidence", score.confidence}, {"answers", Json::array()}};
    for (const Answer& answer : score.answers) json["until"]["answers"].push_back(json_of(answer));
  }
  json["failed"] = failed_traces(score);
  if (failures) {
    json["failures_listed"] = "first_of_each_kind";
    json["failures"] = Json::array();
    for (const Failure& failure : score.failures) {
      json["failures"].push_back(Json::parse(failure_json(failure, score.archive)));
    }
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace graze
