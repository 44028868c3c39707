#pragma once
// The motion that LINKS is driven through: diagonal legs swing together, twice a second; the foot is lifted by the knee
// while the hip brings it forward. Eight slightly different robots.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/model/fabrication.h"
#include "sampling/stream.h"

namespace graze::bench {

inline constexpr double kStep = 1e-3;  // s

/// A joint's servo: tau = stiffness times error - rate times speed, at most 7.3 N m, and `damping` implicitly as the
/// joint's own.
struct Gains {
  double stiffness;  // N m/rad
  double rate;       // N m s/rad, explicit; shins are too light for more than 0.02 at 1 ms
  double damping;    // N m s/rad, implicit
};
inline constexpr Gains kImplicit{8, 0, 0.2}, kExplicit{4, 0.02, 0};

/// Particle `id`: masses, friction and posture differ by some per cent.
inline Particle trotting_particle(const World& world, std::uint32_t id, const Gains& gains = kImplicit) {
  Particle particle;
  particle.id = id;
  particle.model = compile(world);
  particle.initial = initial_state(world, particle.model);
  const auto spread = [&](const std::string& name) { return 2 * uniform(1, id, name_hash(name), 0) - 1; };
  for (Body& body : particle.model.bodies) {
    const double factor = 1 + 0.05 * spread(body.name);
    body.mass *= factor;
    body.inertia *= factor;
    body.damping = gains.damping;
  }
  for (ColliderPair& pair : particle.model.pairs) pair.friction *= 1 + 0.2 * spread("friction");
  for (int body : particle.model.actuated) {
    const Body& moved = particle.model.bodies[body];
    particle.initial.q[moved.q] += 0.02 * spread(moved.joint);
  }
  return particle;
}

/// Servos of all joints.
class Servos {
 public:
  explicit Servos(const World& world, const Gains& gains = kImplicit) : gains_(gains) {
    const Model model = compile(world);
    const State initial = initial_state(world, model);
    for (int index : model.actuated) {
      const Body& body = model.bodies[index];
      const double rest = initial.q[body.q];
      servos_.push_back({body.q, body.v, rest, body.joint.ends_with("Y_2") ? 0.1 : 0,
                         body.joint.ends_with("Y_3") ? std::copysign(0.25, rest) : 0,
                         body.joint.starts_with("LF") || body.joint.starts_with("RH")});
    }
  }

  /// Torques [actuator][lane] at time t, s, from q and v [row][lane].
  void torques(double t, const double* q, const double* v, int lanes, double* tau) const {
    const double phase = 2 * std::numbers::pi * 2 * t, s = std::sin(phase), c = std::cos(phase);
    for (std::size_t k = 0; k < servos_.size(); ++k) {
      const Servo& servo = servos_[k];
      const double sign = servo.first ? 1 : -1;
      const double target = servo.rest + servo.swing * sign * c + servo.lift * std::max(0.0, sign * s);
      const double *angle = q + servo.q * lanes, *rate = v + servo.v * lanes;
      for (int lane = 0; lane < lanes; ++lane) {
        const double torque = gains_.stiffness * (target - angle[lane]) - gains_.rate * rate[lane];
        tau[k * lanes + lane] = std::min(std::max(torque, -7.3), 7.3);
      }
    }
  }

 private:
  struct Servo {
    int q, v;                  // rows
    double rest, swing, lift;  // rad
    bool first;                // of the diagonal pairs of legs
  };
  Gains gains_;
  std::vector<Servo> servos_;
};

}  // namespace graze::bench
