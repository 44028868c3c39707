#pragma once
// Tells a physical step from one that makes energy out of nothing. The balance of a step is exact for a mass matrix
// that stands still (semi-implicit Euler with impulses: dK = sum of impulse times mean velocity), so what may be left
// over is bounded by the motion of the mass matrix, by gravity's lever over the step, and by the speed at which
// overlaps are pushed apart. docs/physics.md derives the bound.

#include <optional>
#include <string>

#include "engine/bullet/tree.h"

namespace graze::bullet {

/// What acted on the bodies in a step.
struct StepInput {
  double h = 0;                // s
  double work = 0;             // J, the most that joint forces can have done: sum of h max(tau v-, tau v+)
  double contact_impulse = 0;  // N s, sum of normal impulses
  double limit_impulse = 0;    // N m s or N s, sum over joint limits and mimic rows
};

class EnergyWatch {
 public:
  EnergyWatch(const Model& model, const Forest& forest);
  /// To be called after each step, when the forest is fresh. Why the step is not physical, or nothing.
  std::optional<std::string> check(const Forest& forest, const StepInput& input);

  struct BodyMotion {
    Vec3 v_com = Vec3::Zero(), omega = Vec3::Zero();  // world
  };
  struct Sums {
    double kinetic = 0, potential = 0;
    double change = 0;           // kinetic energy of the change of velocity, J
    double weighted_speed = 0;   // sum of m |v|, kg m/s
    double weighted_change = 0;  // sum of m |v+ - v-|
    double spin = 0;             // fastest body, rad/s
    int fastest = 0;             // which that is
  };
  /// What a check leaves for the next one.
  struct Audit {
    std::vector<BodyMotion> motion;  // per body, at the last measure
    Sums last;
    double created = 0;       // J, sum of what each step gained beyond its bound
    double peak_kinetic = 0;  // J, at the beginning of any step so far
  };
  const Audit& audit() const { return audit_; }
  /// Goes on from the audit of a watch over the same particle.
  void restore(const Audit& audit) { audit_ = audit; }

 private:
  Sums measure(const Forest& forest);

  const Model& model_;
  Audit audit_;
  double mass_ = 0;  // kg, of all bodies
};

}  // namespace graze::bullet
