#include "archive/schema/kept.h"

#include <cmath>

namespace graze {

bool cut_short(Outcome outcome, double end_time, const CampaignInfo& info) {
  // A damaged or foreign end that is no number counts as cut.
  return outcome == Outcome::known_failure && !(std::round(end_time / info.step) >= std::round(info.end / info.step));
}

const char* kept_name(Kept kept) { return kept == Kept::yes ? "yes" : kept == Kept::no ? "no" : "undecided"; }

Kept kept_by(const CampaignInfo::RequirementRow& measure, double margin, Outcome outcome, double end_time,
             const CampaignInfo& info) {
  if (!(margin >= 0)) return Kept::no;
  const bool cut = cut_short(outcome, end_time, info);
  if (!measure.window.opens({info.step, cut ? end_time : info.end})) return Kept::undecided;
  // The step that did not come any more, at its time as simulations have it.
  const double next = (std::round(end_time / info.step) + 1) * info.step;
  return !cut || next > measure.window.to ? Kept::yes : Kept::undecided;
}

}  // namespace graze
