// Events as CSV.
#include <fmt/format.h>

#include <cmath>

#include "analysis/cause_numbers.h"
#include "analysis/events.h"
#include "analysis/events_words.h"
#include "archive/files/csv.h"

namespace graze {
namespace {

/// With as many digits as give the same bits when they are read again; what is not known is an empty cell.
Detail tree_detail(const CampaignEvents& events) { return std::max(events.request.rules.detail, Detail::features); }

/// "policy, bifurcation, branch" of a line.
std::string place(const PolicyEvents& policy, std::size_t node, std::size_t branch, const EventWords& words) {
  return fmt::format("{},{},{}", csv_cell(policy.policy), csv_cell(words.place(policy.tree, node)),
                     csv_cell(words.branch(policy.tree.nodes[node].branches[branch])));
}

/// What explains a branch, in words; of two branches both have the answer of the one that was asked about.
std::string verdict(const PolicyEvents& policy, std::size_t node, std::size_t branch, const CampaignEvents& events) {
  if (policy.tree.nodes[node].branches[branch].kind == EventBranch::Kind::cut) return "";
  if (policy.causes.empty()) return "no causes: " + events.no_causes;
  const std::vector<BifurcationCauses>& asked = policy.causes[node];
  for (const BifurcationCauses& one : asked) {
    if (one.branch == branch) return verdict_text(one.causes, events.parameters);
  }
  const EventBranch& other = policy.tree.nodes[node].branches[asked.at(0).branch];
  return fmt::format("{}: {}", EventWords(events.info, tree_detail(events)).branch(other),
                     verdict_text(asked.at(0).causes, events.parameters));
}

}  // namespace

std::string sequences_csv(const CampaignEvents& events) {
  const EventWords words(events.info, events.request.rules.detail);
  std::string out = "policy,traces,success,unknown,rate,low,high,example,sequence\n";
  for (const PolicyEvents& policy : events.policies) {
    for (const SequenceCount& one : policy.sequences) {
      const Interval interval = one.outcomes.interval();
      out += fmt::format("{},{},{},{},{},{},{},{},{}\n", csv_cell(policy.policy), one.outcomes.n, one.outcomes.success,
                         one.outcomes.unknown, one.outcomes.rate(), interval.low, interval.high, one.example,
                         csv_cell(words.sequence(one.words, one.words.size())));
    }
  }
  return out;
}

std::string branches_csv(const CampaignEvents& events) {
  const EventWords words(events.info, tree_detail(events));
  std::string out =
      "policy,bifurcation,branch,node,parent,time,p_value,information,traces,success,unknown,rate,low,high,branch_time,"
      "impulse,causes\n";
  for (const PolicyEvents& policy : events.policies) {
    for (std::size_t n = 0; n < policy.tree.nodes.size(); ++n) {
      const EventNode& node = policy.tree.nodes[n];
      for (std::size_t b = 0; b < node.branches.size(); ++b) {
        const EventBranch& branch = node.branches[b];
        const Interval interval = branch.outcomes.interval();
        out +=
            fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", place(policy, n, b, words), n,
                        node.parent < 0 ? "" : std::to_string(node.parent), node.time, node.p_value, node.information,
                        branch.outcomes.n, branch.outcomes.success, branch.outcomes.unknown,
                        csv_number(branch.outcomes.rate()), interval.low, interval.high, csv_number(branch.time.median),
                        csv_number(branch.impulse.median), csv_cell(verdict(policy, n, b, events)));
      }
    }
  }
  return out;
}

std::string causes_csv(const CampaignEvents& events) {
  const EventWords words(events.info, tree_detail(events));
  std::string out = "policy,bifurcation,branch";
  for (const std::string& name : cause_columns()) out += "," + name;
  out += "\n";
  for (const PolicyEvents& policy : events.policies) {
    for (std::size_t n = 0; n < policy.causes.size(); ++n) {
      for (const BifurcationCauses& one : policy.causes[n]) {
        for (const ParameterEffect& effect : one.causes.effects) {
          out += place(policy, n, one.branch, words);
          for (const std::string& cell : cause_cells(effect, events.parameters)) out += "," + csv_cell(cell);
          out += "\n";
        }
      }
    }
  }
  return out;
}

}  // namespace graze
