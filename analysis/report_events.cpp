#include "analysis/report_events.h"

#include <fmt/format.h>

#include <algorithm>

#include "analysis/events_words.h"
#include "analysis/failures.h"
#include "analysis/report_survival.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostNovelties = 30;  // rows of a policy's table

std::uint64_t known(const OutcomeCounts& counts) {
  std::uint64_t sum = 0;
  for (const std::uint64_t one : counts.violated) sum += one;
  return sum;
}

Json tree_node(std::string label, const OutcomeCounts& counts, double time) {
  return {{"label", std::move(label)},
          {"n", counts.n},
          {"outcomes", {{"S", counts.success}, {"K", known(counts)}, {"U", counts.unknown}}},
          {"time", std::isnan(time) ? Json() : Json(time)},
          {"children", Json::array()}};
}

/// Branches of a bifurcation, each with the bifurcations below it.
Json branches(const PolicyEvents& policy, std::size_t at, const EventWords& words) {
  Json out = Json::array();
  const EventNode& node = policy.tree.nodes[at];
  for (const EventBranch& branch : node.branches) {
    std::string label = words.branch(branch);
    if (branch.node >= 0) {
      label += fmt::format(", then {}", words.node(policy.tree.nodes[static_cast<std::size_t>(branch.node)]));
    }
    Json one = tree_node(std::move(label), branch.outcomes, branch.time.median);
    if (branch.node >= 0) one["children"] = branches(policy, static_cast<std::size_t>(branch.node), words);
    out.push_back(std::move(one));
  }
  return out;
}

Json tree_widget(const CampaignEvents& events) {
  const EventWords words(events.info, std::max(events.request.rules.detail, Detail::features));
  Json roots = Json::array();
  for (const PolicyEvents& policy : events.policies) {
    const bool divides = !policy.tree.nodes.empty();
    const std::string what = divides ? words.node(policy.tree.nodes.front()) : "no contact decides how it ends";
    Json root = tree_node(policy.policy + ": " + what, policy.tree.all,
                          divides ? policy.tree.nodes.front().time : std::nan(""));
    if (divides) root["children"] = branches(policy, 0, words);
    roots.push_back(std::move(root));
  }
  return {{"type", "tree"}, {"title", "Where behaviour divides"}, {"root", roots}};
}

Json cell(const Quantiles& x, double scale) { return std::isnan(x.median) ? Json() : Json(scale * x.median); }

Json branch_table(const CampaignEvents& events) {
  const EventWords words(events.info, std::max(events.request.rules.detail, Detail::features));
  Json rows = Json::array();
  for (const PolicyEvents& policy : events.policies) {
    for (const EventNode& node : policy.tree.nodes) {
      for (const EventBranch& branch : node.branches) {
        const Interval interval = branch.outcomes.interval();
        rows.push_back({policy.policy, words.node(node), words.branch(branch), branch.outcomes.n,
                        branch.outcomes.rate(), fmt::format("{:.3f} … {:.3f}", interval.low, interval.high),
                        cell(branch.time, 1), cell(branch.impulse, 1e3), p_cell(node.p_value)});
      }
    }
  }
  return {{"type", "table"},
          {"title", "Branches"},
          {"columns",
           {"Policy",
            "Bifurcation",
            "Next contact",
            "Traces",
            {{"name", "Success"}, {"digits", 3}},
            {{"name", "95 % interval"}, {"align", "right"}},
            {{"name", "Time"}, {"unit", "s"}},
            {{"name", "Impulse"}, {"unit", "mN s"}},
            {{"name", "p"}, {"align", "right"}}}},
          {"rows", rows},
          {"note", "Medians over the traces of a branch; p after Holm's correction over all nodes that were tested."}};
}

/// What explains which way traces go; null: there is no bifurcation.
Json causes_table(const CampaignEvents& events) {
  const EventWords words(events.info, std::max(events.request.rules.detail, Detail::features));
  Json rows = Json::array();
  for (const PolicyEvents& policy : events.policies) {
    for (std::size_t n = 0; n < policy.causes.size(); ++n) {
      for (const BifurcationCauses& one : policy.causes[n]) {
        rows.push_back({policy.policy, words.place(policy.tree, n),
                        words.branch(policy.tree.nodes[n].branches[one.branch]), one.causes.ones, one.causes.rows,
                        verdict_text(one.causes, events.parameters)});
      }
    }
  }
  if (rows.empty()) return nullptr;
  return {{"type", "table"},
          {"title", "What decides which way"},
          {"columns", {"Policy", "Bifurcation", "Next contact", "Traces", "Of", "Parameters"}},
          {"rows", rows},
          {"note", "p after Holm's correction over all parameters and branches of the policy's bifurcations."}};
}

Json novelty_table(const CampaignEvents& events) {
  constexpr const char* kKinds[] = {"new contact", "new sequence", "new feature", "both outcomes"};
  const EventWords fine(events.info, std::max(events.request.rules.detail, Detail::features));
  const EventWords coarse(events.info, Detail::parts);
  Json rows = Json::array();
  for (const PolicyEvents& policy : events.policies) {
    for (std::size_t i = 0; i < std::min(kMostNovelties, policy.novelties.size()); ++i) {
      const Novelty& one = policy.novelties[i];
      const bool parts = one.kind == Novelty::Kind::event || one.kind == Novelty::Kind::outcomes;
      rows.push_back({policy.policy, kKinds[static_cast<int>(one.kind)],
                      one.kind == Novelty::Kind::sequence ? "(all contacts)" : (parts ? coarse : fine).word(one.word),
                      one.outcomes.n, one.outcomes.rate(), short_number(one.first), one.example});
    }
  }
  return {{"type", "table"},
          {"title", "New against the successes"},
          {"columns",
           {"Policy",
            "What",
            "Contact",
            "Traces",
            {{"name", "Success"}, {"digits", 3}},
            {{"name", "First"}, {"unit", "s"}},
            "Particle"}},
          {"rows", rows}};
}

}  // namespace

Json events_section(const CampaignEvents& events) {
  Json widgets = {tree_widget(events), branch_table(events)};
  if (Json causes = causes_table(events); !causes.is_null()) widgets.push_back(std::move(causes));
  widgets.push_back(novelty_table(events));
  return {
      {"id", "events"},
      {"title", "Events"},
      {"text", fmt::format("Contacts at which what happens next has to do with how a trace ends; found where there is "
                           "none with a probability of at most {:g} %.",
                           100 * events.request.tree.error_rate)},
      {"widgets", widgets}};
}

Json unknown_section(const std::vector<UnknownFailures>& all, const std::string& archive) {
  Json kinds = Json::array(), proposals = Json::array();
  for (const UnknownFailures& one : all) {
    for (std::size_t i = 0; i < one.kinds.size(); ++i) {
      const FailureKind& kind = one.kinds[i];
      std::string traits;
      for (const Trait& trait : kind.traits) {
        const std::string unit = trait.unit.empty() || trait.unit == "1" ? "" : " " + trait.unit;
        traits += fmt::format("{}{} {:.4g}{} ({:.4g})", traits.empty() ? "" : "; ", trait.name, trait.here, unit,
                              trait.successes);
      }
      kinds.push_back(
          {one.policy, i + 1, kind.traces, traits, replay_command(archive, one.policy, kind.typical, one.trust)});
      for (const ProposedWitness& witness : kind.witnesses) {
        proposals.push_back({one.policy, i + 1, witness.yaml, fmt::format("{} of {}", witness.caught, witness.of),
                             fmt::format("{} of {}", witness.alarms, witness.successes),
                             witness.in_objective ? Json("judges it already") : Json()});
      }
    }
  }
  if (kinds.empty()) return nullptr;
  return {{"id", "unknown"},
          {"title", "Unknown failures"},
          {"text", "Traces that violated nothing and missed the objective, by what they did."},
          {"widgets",
           {{{"type", "table"},
             {"title", "Kinds"},
             {"columns",
              {"Policy",
               "Kind",
               "Traces",
               {{"name", "Medians (of the successes)"}, {"class", "wrap wide"}},
               {{"name", "A typical one"}, {"class", "wrap"}}}},
             {"rows", kinds}},
            {{"type", "table"},
             {"title", "Requirements that would have caught them"},
             {"columns",
              {"Policy",
               "Kind",
               {{"name", "Requirement"}, {"class", "wrap wide"}},
               "Caught",
               "False alarms",
               "The objective"}},
             {"rows", proposals},
             {"note",
              "Chosen on even particles, counted on odd ones. What the objective judges already says nothing new."}}}}};
}

}  // namespace graze
