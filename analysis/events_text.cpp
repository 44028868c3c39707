// Events as text for people and as JSON for scripts.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/cause_numbers.h"
#include "analysis/events.h"
#include "analysis/events_words.h"
#include "analysis/failures.h"
#include "analysis/number_words.h"
#include "analysis/text_table.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

/// What one policy's numbers are told with.
class Teller : public EventWords {
 public:
  Teller(const CampaignEvents& events, Detail detail) : EventWords(events.info, detail), info_(events.info) {}

  /// "S 3, clears-curb 12, objective 1"
  std::string outcomes(const OutcomeCounts& counts) const {
    std::string out = fmt::format("S {}", counts.success);
    for (std::size_t r = 0; r < counts.violated.size(); ++r) {
      if (counts.violated[r] > 0) out += fmt::format(", {} {}", info_.requirements[r].name, counts.violated[r]);
    }
    return counts.unknown > 0 ? out + fmt::format(", objective {}", counts.unknown) : out;
  }

  Json outcomes_json(const OutcomeCounts& counts) const {
    const Interval interval = counts.interval();
    Json known = Json::object();
    for (std::size_t r = 0; r < counts.violated.size(); ++r) known[info_.requirements[r].name] = counts.violated[r];
    return {{"n", counts.n},
            {"success", counts.success},
            {"violated", known},
            {"unknown", counts.unknown},
            {"rate", counts.n > 0 ? Json(counts.rate()) : Json()},
            {"interval", {interval.low, interval.high}}};
  }

  Json words_json(const std::vector<std::uint32_t>& words) const {
    Json out = Json::array();
    for (const std::uint32_t one : words) out.push_back(word(one));
    return out;
  }

 private:
  const CampaignInfo& info_;
};

std::string rate_text(const OutcomeCounts& counts) {
  if (counts.n == 0) return "-";
  const Interval interval = counts.interval();
  return fmt::format("{:.3f} ({:.3f} .. {:.3f})", counts.rate(), interval.low, interval.high);
}

std::string range_text(const Quantiles& x, double scale) {
  if (std::isnan(x.median)) return "-";
  return fmt::format("{:.4g} ({:.4g} .. {:.4g})", scale * x.median, scale * x.low, scale * x.high);
}

/// Which parameters decide which way traces go; branches that nothing explains share a line.
std::string causes_text(const PolicyEvents& policy, std::size_t at, const Teller& tell, const CampaignEvents& events) {
  if (policy.causes.empty()) return fmt::format("no causes: {}\n", events.no_causes);
  std::string out, nothing;
  for (const BifurcationCauses& one : policy.causes[at]) {
    const Causes& causes = one.causes;
    const std::string branch =
        fmt::format("{} ({} of {})", tell.branch(policy.tree.nodes[at].branches[one.branch]), causes.ones, causes.rows);
    if (causes.explained() || causes.effects.empty()) {
      out += fmt::format("{}: {}\n", branch, verdict_text(causes, events.parameters));
    } else {
      nothing += (nothing.empty() ? "" : "; ") + branch;
    }
  }
  return nothing.empty() ? out : out + fmt::format("no parameter explains it: {}\n", nothing);
}

std::string indented(const std::string& lines, const std::string& indent) {
  std::string out;
  for (std::size_t begin = 0; begin < lines.size();) {
    const std::size_t end = std::min(lines.find('\n', begin), lines.size() - 1);
    out += indent + lines.substr(begin, end - begin + 1);
    begin = end + 1;
  }
  return out;
}

/// Traces of the branch above (of all) whose thread had other contacts before, and which stand at no branch of the
/// node.
std::uint64_t elsewhere(const EventTree& tree, const EventNode& node) {
  const OutcomeCounts& above = node.parent < 0 ? tree.all
                                               : tree.nodes[static_cast<std::size_t>(node.parent)]
                                                     .branches[static_cast<std::size_t>(node.parent_branch)]
                                                     .outcomes;
  std::uint64_t here = 0;
  for (const EventBranch& branch : node.branches) here += branch.outcomes.n;
  return above.n - std::min<std::uint64_t>(above.n, here);
}

/// `tell` the tree's words, `told` those of sequences.
std::string node_text(const PolicyEvents& policy, std::size_t at, const Teller& tell, const Teller& told,
                      const CampaignEvents& events) {
  const EventNode& node = policy.tree.nodes[at];
  const std::string indent(2 + 4 * static_cast<std::size_t>(node.depth), ' ');
  std::string out = indent + fmt::format("{} ({}; tells {:.0f} % about the outcome)\n", tell.place(policy.tree, at),
                                         p_equation(node.p_value), 100 * node.information);
  const bool hard = std::any_of(node.branches.begin(), node.branches.end(),
                                [](const EventBranch& branch) { return branch.impulse.median >= 10; });
  Rows rows = {
      {"next contact", "traces", "success, 95 % interval", "s, median (5 .. 95 %)", hard ? "N s" : "mN s", "outcomes"}};
  for (const EventBranch& branch : node.branches) {
    rows.push_back({tell.branch(branch), std::to_string(branch.outcomes.n), rate_text(branch.outcomes),
                    range_text(branch.time, 1), range_text(branch.impulse, hard ? 1 : 1e3),
                    tell.outcomes(branch.outcomes)});
  }
  if (const std::uint64_t rest = elsewhere(policy.tree, node); rest > 0) {
    rows.push_back({"(another way before)", std::to_string(rest), "-", "-", "-", ""});
  }
  out += indented(text_table(rows, 1) + causes_text(policy, at, tell, events), indent + "  ");
  for (std::size_t b = 0; b < node.branches.size(); ++b) {
    const PolicyEvents::Around& around = policy.around[at][b];
    if (node.branches[b].kind == EventBranch::Kind::cut || around.n == 0) continue;
    out += indent + fmt::format("  {}: {} of {} have, from {:.2f} to {:.2f} s: {}\n", tell.branch(node.branches[b]),
                                around.alike, around.n, around.from, around.to, told.sequence(around.words));
  }
  for (const PolicyEvents::NearMiss& one : policy.near_misses) {
    if (one.node != at) continue;
    const std::uint32_t pair = parts_only(node.branches[one.branch].word);
    out += indent + fmt::format("  {} in other branches: least gap {} mm, told by '{}' of {} of {}\n",
                                word_text(pair, Detail::parts, events.info), range_text(one.gap, 1e3), one.witness,
                                one.n, counted(one.other, "trace", "traces"));
  }
  return out;
}

std::string tree_text(const PolicyEvents& policy, const CampaignEvents& events, const Teller& told) {
  const Teller tell(events, std::max(events.request.rules.detail, Detail::features));
  const EventTree& tree = policy.tree;
  const double error_rate = events.request.tree.error_rate;
  if (tree.tested == 0) {
    return fmt::format("No contact could be tested: none parts the traces into groups of {} or more.\n",
                       events.request.tree.fewest);
  }
  const std::string nodes = counted(tree.tested, "node", "nodes");
  if (tree.nodes.empty()) {
    return fmt::format("No contact decides how a trace ends ({} tested, error rate {:g}).\n", nodes, error_rate);
  }
  std::string out = fmt::format("Where behaviour divides ({} tested, error rate {:g})\n", nodes, error_rate);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) out += node_text(policy, i, tell, told, events);
  return out;
}

std::string sequences_text(const PolicyEvents& policy, const Teller& tell, std::size_t most) {
  Rows rows = {{"traces", "success, 95 % interval", "example", "sequence"}};
  for (std::size_t i = 0; i < std::min(most, policy.sequences.size()); ++i) {
    const SequenceCount& one = policy.sequences[i];
    rows.push_back({std::to_string(one.outcomes.n), rate_text(one.outcomes), std::to_string(one.example),
                    tell.sequence(one.words)});
  }
  std::string out = fmt::format(
      "\nSequences, {}\n{}", counted(policy.sequences.size(), "different one", "different ones"), text_table(rows, 4));
  if (policy.cycles.empty()) return out;
  rows = {{"from", "to", "traces", "alike", "share", "different", "most frequent"}};
  for (const CycleCount& one : policy.cycles) {
    rows.push_back({fmt::format("{:.3f} s", one.from), fmt::format("{:.3f} s", one.to), std::to_string(one.n),
                    std::to_string(one.alike),
                    fmt::format("{:.0f} %", 100.0 * static_cast<double>(one.alike) / static_cast<double>(one.n)),
                    std::to_string(one.distinct), tell.sequence(one.words)});
  }
  return out + "\nBy cycle\n" + text_table(rows, 7);
}

constexpr const char* kNoveltyNames[] = {"new contact", "new sequence", "new feature", "both outcomes"};

std::string novelties_text(const PolicyEvents& policy, const CampaignEvents& events, std::size_t most) {
  Detail detail = std::max(events.request.rules.detail, Detail::features);
  const Teller fine(events, detail), coarse(events, Detail::parts);
  const std::string against =
      policy.nominal ? fmt::format("the nominal trace ({} at {:.3f} s)", outcome_name(policy.nominal->first),
                                   policy.nominal->second)
      : events.request.reference.empty()
          ? fmt::format("the {}", counted(policy.reference, "success", "successes"))
          : fmt::format("the {} of {}", counted(policy.reference, "trace", "traces"), events.request.reference);
  if (policy.reference == 0) return "\nNo success to tell novelties against (--reference names other traces).\n";
  if (policy.novelties.empty()) return fmt::format("\nNothing new against {}.\n", against);
  Rows rows = {{"what", "contact", "traces", "success, 95 % interval", "first", "particle"}};
  std::size_t listed[4] = {}, left = 0;
  for (const Novelty& one : policy.novelties) {
    if (++listed[static_cast<int>(one.kind)] > most) {
      ++left;
      continue;
    }
    const bool parts = one.kind == Novelty::Kind::event || one.kind == Novelty::Kind::outcomes;
    rows.push_back({kNoveltyNames[static_cast<int>(one.kind)],
                    one.kind == Novelty::Kind::sequence ? "(all contacts)" : (parts ? coarse : fine).word(one.word),
                    std::to_string(one.outcomes.n), rate_text(one.outcomes),
                    std::isnan(one.first) ? "-" : fmt::format("{:.3f} s", one.first), std::to_string(one.example)});
  }
  std::string out = fmt::format("\nNew against {}\n{}", against, text_table(rows, 2));
  return left == 0 ? out : out + fmt::format("… and {} more (--top)\n", left);
}

Json quantiles_json(const Quantiles& x) {
  if (std::isnan(x.median)) return nullptr;
  return {{"p5", x.low}, {"median", x.median}, {"p95", x.high}};
}

/// `tell` the tree's words, `told` those of sequences.
Json node_json(const PolicyEvents& policy, std::size_t at, const Teller& tell, const Teller& told,
               const CampaignEvents& events) {
  const EventNode& node = policy.tree.nodes[at];
  Json branches = Json::array();
  constexpr const char* kKinds[] = {"contact", "nothing", "others", "cut"};
  for (std::size_t b = 0; b < node.branches.size(); ++b) {
    const EventBranch& branch = node.branches[b];
    const PolicyEvents::Around& around = policy.around[at][b];
    branches.push_back({{"kind", kKinds[static_cast<int>(branch.kind)]},
                        {"label", tell.branch(branch)},
                        {"outcomes", tell.outcomes_json(branch.outcomes)},
                        {"time", quantiles_json(branch.time)},
                        {"impulse", quantiles_json(branch.impulse)},
                        {"node", branch.node < 0 ? Json() : Json(branch.node)},
                        {"around",
                         {{"from", around.from},
                          {"to", around.to},
                          {"traces", around.alike},
                          {"sequence", told.words_json(around.words)}}}});
  }
  Json causes = Json::array();
  for (std::size_t q = 0; !policy.causes.empty() && q < policy.causes[at].size(); ++q) {
    const BifurcationCauses& one = policy.causes[at][q];
    causes.push_back({{"branch", one.branch}});
    causes.back().update(causes_json(one.causes, events.parameters));
  }
  return {{"part", events.info.colliders[static_cast<std::size_t>(node.part)]},
          {"with", node.with < 0 ? Json() : Json(events.info.colliders[static_cast<std::size_t>(node.with)])},
          {"past", tell.words_json(node.past)},
          {"time", node.time},
          {"p_value", node.p_value},
          {"information", node.information},
          {"depth", node.depth},
          {"parent", node.parent < 0 ? Json() : Json(node.parent)},
          {"parent_branch", node.parent_branch < 0 ? Json() : Json(node.parent_branch)},
          {"branches", branches},
          {"causes", causes}};
}

Json policy_json(const PolicyEvents& policy, const CampaignEvents& events) {
  const Teller tell(events, events.request.rules.detail), coarse(events, Detail::parts);
  const Teller fine(events, std::max(events.request.rules.detail, Detail::features));
  Json out = {{"policy", policy.policy}, {"outcomes", tell.outcomes_json(policy.tree.all)}};
  Json nodes = Json::array(), sequences = Json::array(), cycles = Json::array(), novel = Json::array();
  for (std::size_t i = 0; i < policy.tree.nodes.size(); ++i) nodes.push_back(node_json(policy, i, fine, tell, events));
  for (const SequenceCount& one : policy.sequences) {
    sequences.push_back({{"outcomes", tell.outcomes_json(one.outcomes)},
                         {"example", one.example},
                         {"sequence", tell.words_json(one.words)}});
  }
  for (const CycleCount& one : policy.cycles) {
    cycles.push_back({{"from", one.from},
                      {"to", one.to},
                      {"n", one.n},
                      {"alike", one.alike},
                      {"different", one.distinct},
                      {"sequence", tell.words_json(one.words)}});
  }
  for (const Novelty& one : policy.novelties) {
    const bool parts = one.kind == Novelty::Kind::event || one.kind == Novelty::Kind::outcomes;
    novel.push_back(
        {{"what", kNoveltyNames[static_cast<int>(one.kind)]},
         {"contact", one.kind == Novelty::Kind::sequence ? Json() : Json((parts ? coarse : fine).word(one.word))},
         {"outcomes", tell.outcomes_json(one.outcomes)},
         {"first", one.first},
         {"particle", one.example}});
  }
  out["tested"] = policy.tree.tested;
  out["by_kinds_of_failures"] = policy.tree.kinds;
  out["bifurcations"] = nodes;
  Json near = Json::array();
  for (const PolicyEvents::NearMiss& one : policy.near_misses) {
    near.push_back({{"bifurcation", one.node},
                    {"branch", one.branch},
                    {"witness", one.witness},
                    {"traces", one.n},
                    {"of", one.other},
                    {"gap", quantiles_json(one.gap)}});
  }
  out["near_misses"] = near;
  out["sequences"] = sequences;
  if (events.request.cycle > 0) out["cycles"] = cycles;
  out["reference_traces"] = policy.reference;
  if (policy.nominal) {
    out["nominal"] = {{"outcome", outcome_name(policy.nominal->first)}, {"end", policy.nominal->second}};
  }
  out["novelties"] = novel;
  return out;
}

}  // namespace

std::string format_events(const CampaignEvents& events, std::size_t most) {
  std::string out = events.complete ? "" : "INCOMPLETE: of the traces that are there.\n";
  const Teller tell(events, events.request.rules.detail);
  for (const PolicyEvents& policy : events.policies) {
    if (!out.empty()) out += "\n";
    const OutcomeCounts& all = policy.tree.all;
    out += fmt::format("{}: {}, success {}\n", policy.policy, counted(all.n, "valid trace", "valid traces"),
                       rate_text(all));
    out += tree_text(policy, events, tell) + sequences_text(policy, tell, most) + novelties_text(policy, events, most);
  }
  return out;
}

std::string events_json(const CampaignEvents& events) {
  constexpr const char* kDetails[] = {"parts", "features", "modes"};
  const EventsRequest& request = events.request;
  Json policies = Json::array();
  for (const PolicyEvents& policy : events.policies) policies.push_back(policy_json(policy, events));
  const Json out = {{"archive", events.archive},
                    {"campaign", events.campaign},
                    {"complete", events.complete},
                    {"detail", kDetails[static_cast<int>(request.rules.detail)]},
                    {"simultaneous", request.rules.simultaneous},
                    {"light", request.rules.light},
                    {"from", request.rules.from},
                    {"to", std::isinf(request.rules.to) ? Json() : Json(request.rules.to)},
                    {"error_rate", request.tree.error_rate},
                    {"reference", request.nominal             ? "nominal"
                                  : request.reference.empty() ? "success"
                                                              : request.reference},
                    {"no_causes", events.no_causes.empty() ? Json() : Json(events.no_causes)},
                    {"policies", policies}};
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace graze
