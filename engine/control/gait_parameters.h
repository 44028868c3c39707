#pragma once
// Table 17 as kernels see it: numbers of a gait. What follows from the robot is
// the same for all lanes or each lane's own (lane_number.h), the rest the same for all. Level frame: origin of the
// base, axes of the base at its nominal attitude (upright), x forward, z up. Read by gait_settings.h.

#include "engine/control/leg_ik.h"

namespace graze {

inline constexpr int kMaxFeet = 8;

/// When each foot is planned to stand and to swing (§9.2.3), as fractions of the gait's period: a foot stands from
/// touchdown for `duty`, then swings from liftoff = touchdown + duty (mod 1) for 1 - duty. Made by make_timing.
struct GaitTiming {
  int feet = 0;
  double touchdown[kMaxFeet] = {}, duty[kMaxFeet] = {};
  double period = 1;  // s

  /// An interval without any planned stance, and the stance before it.
  struct Flight {
    double previous_landing;  // phase; where the stance before this flight began
    double stance;            // s from there to takeoff
    double takeoff;           // phase
    double duration;          // s
  };
  int flight_count = 0;           // 0 for a walk
  Flight flights[kMaxFeet] = {};  // in order of takeoff
};

/// Pushes of standing feet that right the base (base_stabilizer.h).
struct BaseStabilizer {
  bool on = false;
  double kp = 0, kd = 0;       // N m/rad and N m s/rad, of roll and pitch
  double roll = 0, pitch = 0;  // rad, as commanded
};

/// What all robots of one gait have alike.
struct GaitRules {
  GaitTiming timing;
  double step_height = 0.02;                     // m
  double overshoot = 0;                          // of the horizontal step, see swing_path
  double redirect = 0.75;                        // fraction of a swing within which a new command moves its goal
  double settle = 0;                             // s, before the gait begins: the base moves to its commanded height
  bool global_up = true;                         // steps rise along the world's z, not the base's
  bool recovery = true;                          // the modes reach and support; without: timing alone decides
  double max_speed = 1.0;                        // m/s, of a foot at touchdown
  double gravity = 9.81;                         // m/s^2, for flights
  double R_GB[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // commanded attitude of the base in the level frame
  BaseStabilizer stabilizer;
};

template <class Number>
struct GaitParametersOf : GaitRules {
  Number contact_force{};           // N, above which a foot carries
  Number origin[kMaxFeet][3] = {};  // where each foot stands at mid-stance, level frame, m
  Number hip[kMaxFeet][3] = {};     // centre of its reach, base frame, m
  Number reach[kMaxFeet] = {};      // m
};
using GaitParameters = GaitParametersOf<double>;

}  // namespace graze
