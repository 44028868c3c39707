#include "analysis/culprits.h"

#include <algorithm>
#include <limits>

#include "archive/schema/culprit.h"

namespace graze {

void Culprits::add(const TraceOutcome& trace) {
  if (trace.outcome == Outcome::known_failure) ++traces_[{trace.violated, trace.culprit}];
  if (trace.outcome == Outcome::unknown_failure) ++traces_[{std::numeric_limits<int>::max(), trace.culprit}];
}

std::vector<Culprits::Count> Culprits::counts(const CampaignInfo& info) const {
  std::vector<Count> out;
  std::size_t first = 0;  // of this requirement
  for (const auto& [key, traces] : traces_) {
    const bool known = key.violated < static_cast<int>(info.requirements.size());
    const std::string culprit = culprit_text(known ? key.violated : -1, key.culprit, info);
    if (culprit.empty()) continue;
    const std::string what = known ? info.requirements[static_cast<std::size_t>(key.violated)].name : "objective";
    if (!out.empty() && out.back().what != what) first = out.size();
    out.push_back({what, culprit, traces});
    std::stable_sort(out.begin() + static_cast<std::ptrdiff_t>(first), out.end(),
                     [](const Count& a, const Count& b) { return a.traces > b.traces; });
  }
  return out;
}

}  // namespace graze
