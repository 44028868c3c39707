#include "archive/schema/culprit.h"

namespace graze {

std::string part_kind_name(PartKind kind) {
  switch (kind) {
    case PartKind::link:
      return "links";
    case PartKind::joint:
      return "joints";
    case PartKind::pair:
      return "pairs";
    case PartKind::none:
      break;
  }
  return "";
}

std::uint64_t part_count(const std::string& parts, const CampaignInfo& info) {
  if (parts == "links") return info.links.size();
  if (parts == "joints") return info.actuator_names.size();
  return parts == "pairs" ? info.colliders.size() * info.colliders.size() : 0;
}

std::string part_name(const std::string& parts, int part, const CampaignInfo& info) {
  if (part < 0 || static_cast<std::uint64_t>(part) >= part_count(parts, info)) return "";
  const auto index = static_cast<std::size_t>(part);
  if (parts == "links") return info.links[index];
  if (parts == "joints") return info.actuator_names[index];
  const std::size_t colliders = info.colliders.size();
  return info.colliders[index / colliders] + " and " + info.colliders[index % colliders];
}

std::string culprit_text(int violated, Culprit culprit, const CampaignInfo& info) {
  if (violated >= 0) {
    const auto i = static_cast<std::size_t>(violated);
    return i < info.requirements.size() ? part_name(info.requirements[i].parts, culprit.part, info) : "";
  }
  if (culprit.leaf < 0 || static_cast<std::size_t>(culprit.leaf) >= info.leaves.size()) return "";
  const CampaignInfo::RequirementRow& leaf = info.leaves[static_cast<std::size_t>(culprit.leaf)];
  const std::string name = part_name(leaf.parts, culprit.part, info);
  if (info.leaves.size() == 1 && !name.empty()) return name;
  return name.empty() ? leaf.description : leaf.description + ": " + name;
}

}  // namespace graze
