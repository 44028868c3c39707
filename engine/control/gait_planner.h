#pragma once
// The gait planner (Chapter 9, Algorithm 7): desired position and velocity of every foot in the base frame, from the
// clock, the commanded velocity of the base, and what is sensed of the feet. One lane at a time; holds no state of its
// own but the parameters.

#include <array>
#include <span>

#include "engine/control/base_command.h"
#include "engine/control/gait_timing.h"
#include "engine/control/swing_spline.h"

namespace graze {

inline constexpr int kMaxFeet = 8;

/// Table 17. Level frame: origin of the base, axes of the base at its nominal attitude (upright), x forward, z up.
struct GaitParameters {
  GaitTiming timing{{}, {}, 1.0};
  double step_height = 0.02;             // m
  double overshoot = 0;                  // of the horizontal step, see swing_knots
  double redirect = 0.75;                // fraction of a swing within which a new command moves its goal
  double settle = 0;                     // s, before the gait begins: the base moves to its commanded height
  bool global_up = true;                 // steps rise along the world's z, not the base's
  bool recovery = true;                  // the modes reach and support; without: timing alone decides
  double max_speed = 1.0;                // m/s, of a foot at touchdown
  double contact_force = 0;              // N, above which a foot carries
  double gravity = 9.81;                 // m/s^2, for flights
  Mat3 R_GB = Mat3::Identity();          // commanded attitude of the base in the level frame
  std::array<Vec3, kMaxFeet> origin{};   // where each foot stands at mid-stance, level frame, m
  std::array<Vec3, kMaxFeet> hip{};      // centre of its reach, base frame, m
  std::array<double, kMaxFeet> reach{};  // m
};

enum class FootMode { stance, swing, reach, support };

/// Memory and output of one foot.
struct FootPlan {
  FootMode mode = FootMode::stance;
  Vec3 x = Vec3::Zero(), xd = Vec3::Zero();  // desired, base frame
  SwingSpline path;                          // while mode == swing
  BaseCommand planned_for;                   // the command that `path` was made for
};

/// What the planner is told at a control step.
struct GaitInput {
  double t = 0, dt = 0;                  // s since the start; since the last call (0 at first)
  BaseCommand command;                   // level frame
  std::array<Vec3, kMaxFeet> x{};        // sensed feet, base frame, m
  std::array<double, kMaxFeet> force{};  // normal force on each foot, N
  Vec3 up_B = Vec3::UnitZ();             // the world's z in the base frame, as sensed
};

class GaitPlanner {
 public:
  explicit GaitPlanner(GaitParameters parameters) : p_(std::move(parameters)) {}
  const GaitParameters& parameters() const { return p_; }

  /// All feet in stance where they are, ready to settle.
  void start(const GaitInput& input, std::span<FootPlan> feet) const;
  /// One control step. Until t = settle all feet stand; the gait's clock begins there.
  void plan(const GaitInput& input, std::span<FootPlan> feet) const;

  /// Where a foot shall touch down: where its origin will be at mid-stance, seen from the base at touchdown (Figure
  /// 72). Base frame.
  Vec3 touchdown(int foot, const BaseCommand& command) const;
  /// Velocity of a standing foot that moves the base at `command`: -J_{foot,base} command (§9.2.4). Base frame.
  Vec3 stance_velocity(const Vec3& x, const BaseCommand& command) const;

 private:
  void walk(const GaitInput& input, std::span<FootPlan> feet) const;
  void switch_modes(const GaitInput& input, double phase, std::span<FootPlan> feet) const;
  void stand(const GaitInput& input, const BaseCommand& command, int foot, FootPlan& plan) const;
  void lift_off(const GaitInput& input, double phase, std::span<FootPlan> feet) const;
  void swing(const GaitInput& input, int foot, FootPlan& plan) const;
  SwingSpline path(const GaitInput& input, int foot, const Vec3& x, const Vec3& xd, double t0, double duration) const;
  Vec3 within_reach(int foot, const Vec3& x) const;

  GaitParameters p_;
};

}  // namespace graze
