#include "engine/control/gait_timing.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "engine/control/gait_clock.h"

namespace graze {

namespace {

void find_flights(GaitTiming& timing) {
  // Flight begins at the liftoff of a foot at which no other stands, and ends at the next touchdown of any foot.
  std::vector<std::pair<double, double>> spans;  // takeoff phase, duration as a fraction
  for (int foot = 0; foot < timing.feet; ++foot) {
    const double takeoff = fraction(timing.touchdown[foot] + timing.duty[foot] + kPhaseSlack);
    double ahead = 1;
    bool aloft = true;
    for (int other = 0; other < timing.feet; ++other) {
      if (in_stance(timing, other, takeoff)) aloft = false;
      ahead = std::min(ahead, fraction(timing.touchdown[other] - takeoff + kPhaseSlack));
    }
    const auto same = [&](const auto& span) { return std::abs(span.first - takeoff) < 1e-6; };
    if (aloft && ahead > 1e-6 && std::none_of(spans.begin(), spans.end(), same)) spans.emplace_back(takeoff, ahead);
  }
  std::sort(spans.begin(), spans.end());
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const auto& before = spans[(i + spans.size() - 1) % spans.size()];
    const double landing = fraction(before.first + before.second);
    timing.flights[timing.flight_count++] = {landing, fraction(spans[i].first - landing) * timing.period,
                                             spans[i].first, spans[i].second * timing.period};
  }
}

}  // namespace

GaitTiming make_timing(std::span<const double> touchdown, std::span<const double> duty, double period) {
  assert(touchdown.size() == duty.size() && touchdown.size() <= kMaxFeet && period > 0);
  GaitTiming timing;
  timing.feet = static_cast<int>(touchdown.size());
  timing.period = period;
  for (int i = 0; i < timing.feet; ++i) {
    timing.touchdown[i] = fraction(touchdown[i] + kPhaseSlack) - kPhaseSlack;
    timing.duty[i] = duty[i];
  }
  find_flights(timing);
  return timing;
}

}  // namespace graze
