#include "analysis/report_families.h"

#include <algorithm>
#include <optional>

#include "engine/settings/tree.h"
#include "engine/settings/units.h"

namespace graze {
namespace {

std::vector<std::string> split(const std::string& name) {
  std::vector<std::string> out(1);
  for (const char c : name) {
    if (c == '/') {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return out;
}

/// Names of policies have '_' where units have '/'.
std::string unit_of_label(std::string_view written) {
  std::string out(written);
  if (is_unit(out)) return out;
  std::replace(out.begin(), out.end(), '_', '/');
  return out;
}

/// "1cm" -> 1, "cm"; "3rad_s" -> 3, "rad/s".
void read_axis(PolicyFamily& family, std::size_t k) {
  PolicyFamily::Axis& axis = family.axes[k];
  std::optional<std::string> unit;
  for (PolicyFamily::Member& member : family.members) {
    const std::optional<WrittenNumber> number = split_number(member.labels[k]);
    const std::string own = number ? unit_of_label(number->unit) : "";
    const bool fits = number && (!unit || *unit == own) && (own.empty() || is_unit(own));
    axis.numeric = axis.numeric && fits;
    if (!fits) continue;
    unit = own;
    member.values[k] = number->value;
  }
  if (axis.numeric && unit) axis.unit = *unit;
  if (axis.numeric) return;
  std::vector<std::string> labels;
  for (PolicyFamily::Member& member : family.members) {
    const auto at = std::find(labels.begin(), labels.end(), member.labels[k]);
    member.values[k] = static_cast<double>(at - labels.begin());
    if (at == labels.end()) labels.push_back(member.labels[k]);
  }
}

/// The policies that `name` was expanded to over these keys.
PolicyFamily family_of(const std::string& name, const std::vector<std::string>& keys,
                       const std::vector<std::string>& policies) {
  PolicyFamily out{name, {}, {}};
  for (const std::string& key : keys) out.axes.push_back({key, "", true});
  for (const std::string& policy : policies) {
    std::vector<std::string> words = split(policy);
    if (words[0] != name || words.size() != keys.size() + 1) continue;
    words.erase(words.begin());
    out.members.push_back({policy, words, std::vector<double>(keys.size())});
  }
  for (std::size_t k = 0; k < keys.size(); ++k) read_axis(out, k);
  return out;
}

}  // namespace

std::vector<PolicyFamily> policy_families(const CampaignInfo& info, const std::vector<std::string>& policies) {
  std::vector<PolicyFamily> out;
  try {
    const NodePtr root = parse_yaml(info.scenario_text, "scenario");
    const NodePtr* all = root->find("policies");
    if (all == nullptr) return {};
    for (const SettingsNode::Entry& entry : (*all)->map) {
      const NodePtr* over = entry.value->find("over");
      if (over == nullptr) continue;
      std::vector<std::string> keys;
      for (const SettingsNode::Entry& one : (*over)->map) keys.push_back(one.key);
      PolicyFamily family = family_of(entry.key, keys, policies);
      if (!keys.empty() && family.members.size() > 1) out.push_back(std::move(family));
    }
  } catch (const InputError&) {
    return {};
  }
  return out;
}

}  // namespace graze
