// A comparison as text for people, as JSON and CSV for scripts.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "analysis/compare.h"
#include "analysis/failures.h"
#include "analysis/number_words.h"
#include "analysis/text_table.h"
#include "archive/files/csv.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

std::string rate_text(std::uint64_t k, std::uint64_t n) {
  return n == 0 ? "-" : fmt::format("{:.4f} of {}", static_cast<double>(k) / static_cast<double>(n), n);
}

std::string policy_name(const PolicyComparison& one) {
  return one.policy_a == one.policy_b ? one.policy_a : one.policy_a + " | " + one.policy_b;
}

/// "a, b and 5 more"
std::string some_names(const std::vector<std::string>& names) {
  constexpr std::size_t kShownNames = 3;
  std::string out;
  for (std::size_t i = 0; i < std::min(kShownNames, names.size()); ++i) out += (i > 0 ? ", " : "") + names[i];
  return names.size() > kShownNames ? out + fmt::format(" and {} more", names.size() - kShownNames) : out;
}

/// Two values of a scenario that differ, short: from where they begin to, if their beginnings fill the line.
std::pair<std::string, std::string> told_apart(const std::string& a, const std::string& b) {
  constexpr std::size_t kWidth = 40, kBefore = 12;
  std::pair<std::string, std::string> out{clipped(a, kWidth), clipped(b, kWidth)};
  if (out.first != out.second) return out;
  const auto same = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first - a.begin();
  auto from = static_cast<std::size_t>(same) - std::min<std::size_t>(kBefore, same);
  while (from > 0 && (a[from] & 0xC0) == 0x80) --from;  // within a character of UTF-8
  return {"…" + clipped(a.substr(from), kWidth), "…" + clipped(b.substr(from), kWidth)};
}

std::string changes_text(const std::vector<ScenarioChange>& changes) {
  constexpr std::size_t kShown = 12;
  if (changes.empty()) return "The scenarios are equal.\n";
  std::string out = fmt::format("The scenarios differ in {}:\n", counted(changes.size(), "value", "values"));
  for (std::size_t i = 0; i < std::min(kShown, changes.size()); ++i) {
    const ScenarioChange& one = changes[i];
    const auto [in_a, in_b] = told_apart(one.in_a, one.in_b);
    out += fmt::format("  {}: {} -> {}\n", one.path, in_a.empty() ? "(not there)" : in_a,
                       in_b.empty() ? "(not there)" : in_b);
  }
  return changes.size() <= kShown ? out : out + fmt::format("  … and {} more (--json)\n", changes.size() - kShown);
}

std::string particles_text(const Comparison& c) {
  const SameParticles& p = c.particles;
  if (!p.others.empty()) {
    return fmt::format("Other particles, as {}: rates are compared as of independent samples.\n", p.others);
  }
  const auto pairs = [](const PolicyComparison& one) { return one.pairs.n() > 0; };
  if (std::none_of(c.policies.begin(), c.policies.end(), pairs)) {
    return "No particle has a valid trace in both: there is nothing to compare.\n";
  }
  std::string out;
  if (p.differ.empty()) {
    out = p.compared > 0 ? fmt::format("The same particles: {} equal on the {} that were compared.\n",
                                       counted(p.common.size(), "scalar is", "scalars are"), p.compared)
                         : "The same particles, by seed and design (the values of none are stored in both).\n";
  } else {
    out = fmt::format("The same seed, but {} other values (another distribution): {}.\n",
                      counted(p.differ.size(), "parameter has", "parameters have"), some_names(p.differ));
  }
  if (!p.only_a.empty()) out += fmt::format("Uncertain in A alone: {}.\n", some_names(p.only_a));
  if (!p.only_b.empty()) out += fmt::format("Uncertain in B alone: {}.\n", some_names(p.only_b));
  return out;
}

std::string verdict_table(const Comparison& c) {
  Rows rows = {{"policy", "A", "B", "fixed", "broken", "B - A", "95 % interval", "p", "p, Holm"}};
  for (const PolicyComparison& one : c.policies) {
    // Of the particles of both, of which the difference is.
    const PairedTable& p = one.pairs;
    rows.push_back(
        {policy_name(one), one.paired ? rate_text(p.both + p.only_a, p.n()) : rate_text(one.success_a, one.n_a),
         one.paired ? rate_text(p.both + p.only_b, p.n()) : rate_text(one.success_b, one.n_b),
         one.paired ? std::to_string(one.pairs.only_b) : "-", one.paired ? std::to_string(one.pairs.only_a) : "-",
         std::isnan(one.difference) ? "-" : fmt::format("{:+.4f}", one.difference),
         fmt::format("{:+.4f} .. {:+.4f}", one.interval.low, one.interval.high), p_text(one.p_value, 3),
         p_text(one.corrected, 3)});
  }
  return text_table(rows, 1);
}

std::string moves_table(const PolicyComparison& one) {
  Rows rows = {{"in A \\ in B"}};
  rows[0].insert(rows[0].end(), one.ends.begin(), one.ends.end());
  for (const auto& [name, counts] : one.moves) {
    rows.push_back({name});
    for (const std::uint64_t count : counts) rows.back().push_back(std::to_string(count));
  }
  return text_table(rows, 1);
}

std::string margins_table(const PolicyComparison& one) {
  Rows rows = {{"margin of", "pairs", "wider", "narrower", "median B - A", "quartiles", "sign test p"}};
  for (const MarginChange& m : one.margins) {
    const std::string unit = m.unit == "1" ? "" : " " + m.unit;
    rows.push_back({m.requirement, std::to_string(m.n), std::to_string(m.better), std::to_string(m.worse),
                    m.n == 0 ? "-" : fmt::format("{:+.4g}{}", m.median, unit),
                    m.n == 0 ? "-" : fmt::format("{:+.4g} .. {:+.4g}", m.low, m.high), p_text(m.p_value, 3)});
  }
  return one.margins.empty() ? "" : text_table(rows, 1);
}

std::string convergence_text(const Comparison& c) {
  std::vector<NamedConvergence> rows;
  for (const PolicyComparison& one : c.policies) {
    rows.push_back({one.policy_a + ", A", one.convergence_a});
    rows.push_back({one.policy_b + ", B", one.convergence_b});
  }
  std::string rule = flag_rule(c.unconverged_a);
  if (c.unconverged_a != c.unconverged_b) rule += " in A, " + flag_rule(c.unconverged_b) + " in B";
  return convergence_table(rows, rule);
}

const char* flags_text(const Change& change) {
  return change.flagged_a ? change.flagged_b ? "A, B" : "A" : change.flagged_b ? "B" : "";
}

/// With a column "flagged", in which of the two, if any of those that are listed is.
std::string changes_table(const std::vector<Change>& changes, const char* title, const PolicyComparison& one,
                          const Comparison& c, std::size_t most) {
  if (changes.empty()) return "";
  const std::span<const Change> listed = std::span(changes).first(std::min(most, changes.size()));
  const bool flagged =
      std::any_of(listed.begin(), listed.end(), [](const Change& change) { return *flags_text(change) != '\0'; });
  Rows rows = {{"particle", "in A", "in B", "to see it in B"}};
  if (flagged) rows[0].insert(rows[0].begin() + 3, "flagged");
  for (const Change& change : listed) {
    rows.push_back({std::to_string(change.particle), change.in_a, change.in_b,
                    replay_command(c.request.name_b, one.policy_b, change.particle, c.trust_b)});
    if (flagged) rows.back().insert(rows.back().begin() + 3, flags_text(change));
  }
  std::string out = fmt::format("\n{} ({})\n", title, changes.size()) + text_table(rows, rows[0].size());
  const std::size_t left = changes.size() - (rows.size() - 1);
  return left == 0 ? out : out + fmt::format("… and {} more (--top, --csv)\n", left);
}

Json changes_json(const std::vector<Change>& changes) {
  Json out = Json::array();
  for (const Change& one : changes) {
    out.push_back({{"particle", one.particle},
                   {"a", one.in_a},
                   {"b", one.in_b},
                   {"flagged", {{"a", one.flagged_a}, {"b", one.flagged_b}}}});
  }
  return out;
}

Json policy_json(const PolicyComparison& one) {
  Json moves = Json::object(), margins = Json::array();
  for (const auto& [name, counts] : one.moves) {
    for (std::size_t i = 0; i < one.ends.size(); ++i) moves[name][one.ends[i]] = counts[i];
  }
  for (const MarginChange& m : one.margins) {
    margins.push_back({{"requirement", m.requirement},
                       {"unit", m.unit},
                       {"pairs", m.n},
                       {"wider", m.better},
                       {"narrower", m.worse},
                       {"median", m.median},
                       {"quartiles", {m.low, m.high}},
                       {"p_value", m.p_value}});
  }
  return {{"policy_a", one.policy_a},
          {"policy_b", one.policy_b},
          {"a", {{"n", one.n_a}, {"success", one.success_a}, {"convergence", convergence_json(one.convergence_a)}}},
          {"b", {{"n", one.n_b}, {"success", one.success_b}, {"convergence", convergence_json(one.convergence_b)}}},
          {"paired", one.paired},
          {"pairs",
           {{"both", one.pairs.both},
            {"broken", one.pairs.only_a},
            {"fixed", one.pairs.only_b},
            {"neither", one.pairs.neither}}},
          {"difference", std::isnan(one.difference) ? Json() : Json(one.difference)},
          {"interval", {one.interval.low, one.interval.high}},
          {"p_value", one.p_value},
          {"p_holm", one.corrected},
          {"ended_at_other_times", one.uneven},
          {"moves", moves},
          {"fixed", changes_json(one.fixed)},
          {"broken", changes_json(one.broken)},
          {"margins", margins}};
}

}  // namespace

std::string format_comparison(const Comparison& c, std::size_t most) {
  std::string out =
      fmt::format("A: {} ({}){}\nB: {} ({}){}\n", c.request.name_a, c.campaign_a, c.complete_a ? "" : " INCOMPLETE",
                  c.request.name_b, c.campaign_b, c.complete_b ? "" : " INCOMPLETE");
  out += particles_text(c) + changes_text(c.changes) + "\n" + verdict_table(c) + convergence_text(c);
  for (const PolicyComparison& one : c.policies) {
    if (!one.paired) continue;
    out += fmt::format("\n{}: how the {} particles of both end\n", policy_name(one), one.pairs.n()) + moves_table(one);
    if (!one.margins.empty()) out += "\n" + margins_table(one);
    if (!one.margins.empty() && one.uneven > 0) {
      out += fmt::format("Margins: without {} that did not end at the same time.\n",
                         counted(one.uneven, "pair of traces", "pairs of traces"));
    }
    out += changes_table(one.fixed, "Fixed", one, c, most) + changes_table(one.broken, "Broken", one, c, most);
  }
  return out;
}

std::string comparison_json(const Comparison& c) {
  Json policies = Json::array();
  for (const PolicyComparison& one : c.policies) policies.push_back(policy_json(one));
  Json changes = Json::array();
  for (const ScenarioChange& one : c.changes) {
    changes.push_back({{"path", one.path},
                       {"a", one.in_a.empty() ? Json() : Json(one.in_a)},
                       {"b", one.in_b.empty() ? Json() : Json(one.in_b)}});
  }
  const SameParticles& p = c.particles;
  const auto side = [](const std::string& archive, const std::string& campaign, bool complete, double limit) {
    return Json{{"archive", archive}, {"campaign", campaign}, {"complete", complete}, {"unconverged_limit", limit}};
  };
  const Json out = {{"a", side(c.request.name_a, c.campaign_a, c.complete_a, c.unconverged_a)},
                    {"b", side(c.request.name_b, c.campaign_b, c.complete_b, c.unconverged_b)},
                    {"particles",
                     {{"paired", p.others.empty()},
                      {"why_not", p.others},
                      {"compared", p.compared},
                      {"equal", p.common},
                      {"different", p.differ},
                      {"only_a", p.only_a},
                      {"only_b", p.only_b}}},
                    {"scenario_changes", changes},
                    {"policies", policies}};
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string changes_csv(const Comparison& c) {
  std::string out = "policy_a,policy_b,particle,change,in_a,in_b,flagged_a,flagged_b\n";
  for (const PolicyComparison& one : c.policies) {
    for (const auto& [changes, name] : {std::pair{&one.fixed, "fixed"}, std::pair{&one.broken, "broken"}}) {
      for (const Change& change : *changes) {
        out += fmt::format("{},{},{},{},{},{},{:d},{:d}\n", csv_cell(one.policy_a), csv_cell(one.policy_b),
                           change.particle, name, csv_cell(change.in_a), csv_cell(change.in_b), change.flagged_a,
                           change.flagged_b);
      }
    }
  }
  return out;
}

}  // namespace graze
