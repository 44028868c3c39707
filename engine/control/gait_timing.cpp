#include "engine/control/gait_timing.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace graze {

namespace {

// Of a period. Control times are sums of steps: a moment that is meant to fall on a touchdown may lie this much before.
constexpr double kPhaseSlack = 1e-9;

double fraction(double x) { return x - std::floor(x); }

}  // namespace

GaitTiming::GaitTiming(std::vector<double> touchdown, std::vector<double> duty, double period)
    : touchdown_(std::move(touchdown)), duty_(std::move(duty)), period_(period) {
  assert(touchdown_.size() == duty_.size() && period_ > 0);
  for (double& t : touchdown_) t = fraction(t + kPhaseSlack) - kPhaseSlack;
  find_flights();
}

double GaitTiming::phase(double t) const { return fraction(t / period_); }

bool GaitTiming::in_stance(int foot, double phase) const {
  return duty_[foot] >= 1 || fraction(phase - touchdown_[foot] + kPhaseSlack) < duty_[foot];
}

double GaitTiming::until_touchdown(int foot, double phase) const {
  return std::max(fraction(touchdown_[foot] - phase - kPhaseSlack), 0.0) * period_;
}

void GaitTiming::find_flights() {
  // Flight begins at the liftoff of a foot at which no other stands, and ends at the next touchdown of any foot.
  std::vector<std::pair<double, double>> spans;  // takeoff phase, duration as a fraction
  for (int foot = 0; foot < feet(); ++foot) {
    const double takeoff = fraction(touchdown_[foot] + duty_[foot] + kPhaseSlack);
    double ahead = 1;
    bool aloft = true;
    for (int other = 0; other < feet(); ++other) {
      if (in_stance(other, takeoff)) aloft = false;
      ahead = std::min(ahead, fraction(touchdown_[other] - takeoff + kPhaseSlack));
    }
    const auto same = [&](const auto& span) { return std::abs(span.first - takeoff) < 1e-6; };
    if (aloft && ahead > 1e-6 && std::none_of(spans.begin(), spans.end(), same)) spans.emplace_back(takeoff, ahead);
  }
  std::sort(spans.begin(), spans.end());
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const auto& before = spans[(i + spans.size() - 1) % spans.size()];
    const double landing = fraction(before.first + before.second);
    flights_.push_back(
        {landing, fraction(spans[i].first - landing) * period_, spans[i].first, spans[i].second * period_});
  }
}

double GaitTiming::hop_velocity(double phase, double gravity) const {
  phase += 2 * kPhaseSlack;  // takeoffs and landings carry the slack themselves
  for (const Flight& flight : flights_) {
    const double top = 0.5 * gravity * flight.duration;
    const double aloft = fraction(phase - flight.takeoff) * period_;
    if (aloft < flight.duration) return top - gravity * aloft;
    const double stood = fraction(phase - flight.previous_landing) * period_;
    if (stood < flight.stance) {
      const double s = stood / flight.stance;
      return top * (2 * s * s * (3 - 2 * s) - 1);
    }
  }
  return 0;
}

}  // namespace graze
