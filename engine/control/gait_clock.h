#pragma once
// Gait timing on lanes (§9.2.3): T is double or a Pack, a clock per lane.

#include "engine/control/gait_parameters.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

// Of a period. Control times are sums of steps: a moment that is meant to fall on a touchdown may lie this much before.
inline constexpr double kPhaseSlack = 1e-9;

/// x - floor(x), |x| < 2^51.
template <class T>
inline T fraction(const T& x) {
  const T nearest = round_to_integer(x);
  return x - select(nearest > x, nearest - T(1.0), nearest);
}

inline double stance_duration(const GaitTiming& timing, int foot) { return timing.duty[foot] * timing.period; }  // s
inline double swing_duration(const GaitTiming& timing, int foot) {
  return (1 - timing.duty[foot]) * timing.period;  // s
}

/// Progress through the cycle at t, in [0, 1).
template <class T>
inline T phase_at(const GaitTiming& timing, const T& t) {
  return fraction(t / T(timing.period));
}

template <class T>
inline mask_of<T> in_stance(const GaitTiming& timing, int foot, const T& phase) {
  const T since = fraction(phase - T(timing.touchdown[foot]) + T(kPhaseSlack));
  return since < T(timing.duty[foot] >= 1 ? 2.0 : timing.duty[foot]);
}

/// Seconds until the foot's next planned touchdown, in [0, period).
template <class T>
inline T until_touchdown(const GaitTiming& timing, int foot, const T& phase) {
  return max(fraction(T(timing.touchdown[foot]) - phase - T(kPhaseSlack)), T(0.0)) * T(timing.period);
}

/// Vertical velocity of the base (m/s) that throws it over the flights: from -g T/2 on landing to +g T/2 at takeoff
/// along a smooth step, T the duration of the flight ahead; falling freely in flight. Zero for a walk.
template <class T>
inline T hop_velocity(const GaitTiming& timing, const T& phase, double gravity) {
  const T late = phase + T(2 * kPhaseSlack);  // takeoffs and landings carry the slack themselves
  T out = T(0.0);
  for (int k = timing.flight_count - 1; k >= 0; --k) {  // the first that fits has the last word
    const GaitTiming::Flight& flight = timing.flights[k];
    const double top = 0.5 * gravity * flight.duration;
    const T stood = fraction(late - T(flight.previous_landing)) * T(timing.period);
    const T s = stood / T(flight.stance);
    out = select(stood < T(flight.stance), T(top) * (T(2.0) * s * s * (T(3.0) - T(2.0) * s) - T(1.0)), out);
    const T aloft = fraction(late - T(flight.takeoff)) * T(timing.period);
    out = select(aloft < T(flight.duration), T(top) - T(gravity) * aloft, out);
  }
  return out;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
