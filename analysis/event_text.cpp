#include "analysis/event_text.h"

#include <fmt/format.h>

namespace graze {
namespace {

/// The part, with its feature where its shape has named ones.
std::string part(const std::string& name, Feature feature) {
  return feature == Feature::surface ? name : fmt::format("{} ({})", name, feature_name(feature));
}

const char* contact_verb(EventKind kind) {
  switch (kind) {
    case EventKind::contact_begin:
      return "touches";
    case EventKind::contact_end:
      return "leaves";
    case EventKind::stick_to_slip:
      return "begins to slip on";
    case EventKind::slip_to_stick:
      return "stops slipping and sticks to";
    case EventKind::stick_to_roll:
      return "begins to roll on";
    case EventKind::roll_to_stick:
      return "stops rolling and sticks to";
    case EventKind::slip_to_roll:
      return "stops slipping and rolls on";
    case EventKind::roll_to_slip:
      return "stops rolling and slips on";
    case EventKind::limit_begin:
    case EventKind::limit_end:
      break;
  }
  return "";
}

}  // namespace

std::string event_text(const Event& event, const CampaignInfo& info) {
  const bool begins = event.kind == EventKind::limit_begin;
  if (begins || event.kind == EventKind::limit_end) {
    return fmt::format("{} {} its {} joint limit", info.bodies.at(event.a), begins ? "reaches" : "leaves",
                       event.b < 0 ? "lower" : "upper");
  }
  return fmt::format("{} {} {}", part(info.colliders.at(event.a), event.feature_a), contact_verb(event.kind),
                     part(info.colliders.at(event.b), event.feature_b));
}

}  // namespace graze
