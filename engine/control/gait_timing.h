#pragma once
// Gait timing (§9.2.3): when each foot is planned to stand and to swing, and when none stands (flight).

#include <vector>

namespace graze {

/// Fractions of the gait's period; a foot stands from touchdown for `duty`, then swings from liftoff = touchdown + duty
/// (mod 1) for 1 - duty.
class GaitTiming {
 public:
  /// `touchdown` in [0, 1), `duty` in (0, 1], one per foot; `period` in s.
  GaitTiming(std::vector<double> touchdown, std::vector<double> duty, double period);

  int feet() const { return static_cast<int>(touchdown_.size()); }
  double period() const { return period_; }
  double stance_duration(int foot) const { return duty_[foot] * period_; }       // s
  double swing_duration(int foot) const { return (1 - duty_[foot]) * period_; }  // s

  /// Progress through the cycle at t, in [0, 1).
  double phase(double t) const;
  bool in_stance(int foot, double phase) const;
  /// Seconds until the foot's next planned touchdown, in [0, period).
  double until_touchdown(int foot, double phase) const;

  /// An interval without any planned stance, and the stance before it.
  struct Flight {
    double previous_landing;  // phase; where the stance before this flight began
    double stance;            // s from there to takeoff
    double takeoff;           // phase
    double duration;          // s
  };
  /// Flights in order of takeoff; empty for a walk.
  const std::vector<Flight>& flights() const { return flights_; }

  /// Vertical velocity of the base (m/s) that throws it over the flights: from -g T/2 on landing to +g T/2 at takeoff
  /// along a smooth step, T the duration of the flight ahead; falling freely in flight. Zero for a walk.
  double hop_velocity(double phase, double gravity) const;

 private:
  void find_flights();

  std::vector<double> touchdown_, duty_;
  double period_;
  std::vector<Flight> flights_;
};

}  // namespace graze
