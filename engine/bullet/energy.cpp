#include "engine/bullet/energy.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "engine/bullet/contacts.h"
#include "engine/bullet/joint_rows.h"

namespace graze::bullet {
namespace {

/// Rounding of the sums, relative to the energies in them.
constexpr double kRounding = 1e-10;
/// Factor of the mass matrix's rate of change over the fastest body's spin: 1 for a single body, more for a chain whose
/// joint speeds add up; chosen so that random tumbling chains are never accused (tests).
constexpr double kMassMotion = 4;
/// Of the energy of a jolt no more than this may come from the motion of the mass matrix.
constexpr double kLargestShare = 0.5;
/// What a trace may gain in all beyond what its steps are allowed, before it counts as unphysical: what lifts
/// everything by this height (m), and this share of the largest kinetic energy so far. Overlaps that are pushed apart
/// while bodies are wedged create millijoules now and then; a trace that blows up passes both at once. Ours.
constexpr double kCreatedLift = 0.01;
constexpr double kCreatedShare = 0.05;
/// Bullet turns a body by at most this angle per step; beyond it the state no longer means what it says.
constexpr double kLargestTurn = std::numbers::pi / 4;

}  // namespace

EnergyWatch::EnergyWatch(const Model& model, const Forest& forest) : model_(model) {
  audit_.motion.resize(model.bodies.size());
  for (const Body& body : model.bodies) mass_ += body.mass;
  audit_.last = measure(forest);
}

EnergyWatch::Sums EnergyWatch::measure(const Forest& forest) {
  Sums sums;
  for (int i = 0; i < static_cast<int>(audit_.motion.size()); ++i) {
    const Body& body = model_.bodies[i];
    const Pose& X = forest.pose(i);
    const Vec3 lever = X.linear() * body.com;
    const BodyMotion now{forest.twist(i).at(lever), forest.twist(i).angular};
    const Vec3 dv = now.v_com - audit_.motion[i].v_com;
    const Vec3 omega_B = X.linear().transpose() * now.omega;
    const Vec3 change_B = X.linear().transpose() * (now.omega - audit_.motion[i].omega);
    sums.kinetic += 0.5 * (body.mass * now.v_com.squaredNorm() + omega_B.dot(body.inertia * omega_B));
    sums.change += 0.5 * (body.mass * dv.squaredNorm() + change_B.dot(body.inertia * change_B));
    sums.potential -= body.mass * model_.gravity.dot(X.translation() + lever);
    sums.weighted_speed += body.mass * now.v_com.norm();
    sums.weighted_change += body.mass * dv.norm();
    if (const double spin = now.omega.norm(); spin > sums.spin) sums.spin = spin, sums.fastest = i;
    audit_.motion[i] = now;
  }
  return sums;
}

std::optional<std::string> EnergyWatch::check(const Forest& forest, const StepInput& input) {
  if (!forest.q().allFinite() || !forest.v().allFinite()) return "state is not finite";
  const Sums before = audit_.last, now = audit_.last = measure(forest);
  const double h = input.h, g = model_.gravity.norm();
  if (h * now.spin > kLargestTurn) {
    return fmt::format("body '{}' turns at {:.4g} rad/s, more than an eighth of a turn per step",
                       model_.bodies[static_cast<std::size_t>(now.fastest)].name, now.spin);
  }
  const double turn = h * std::max(before.spin, now.spin), spun = kMassMotion * h * before.spin;
  const double jolt = std::sqrt(before.kinetic * now.change) + now.change;
  const double allowed = spun * spun * before.kinetic                                 // mass matrix moves, free motion
                         + std::min(2 * kMassMotion * turn, kLargestShare) * jolt     // … and under impulses
                         + h * g * (now.weighted_change + turn * now.weighted_speed)  // gravity's lever
                         + (kRecovery + kSolverSlack) * input.contact_impulse +
                         (kLimitRecovery + kSolverSlack) * input.limit_impulse +
                         kRounding * (before.kinetic + now.kinetic + std::abs(now.potential));
  const double rise = now.kinetic + now.potential - before.kinetic - before.potential - input.work;
  audit_.created += std::max(0.0, rise - allowed);
  audit_.peak_kinetic = std::max(audit_.peak_kinetic, before.kinetic);
  const double tolerated = kCreatedLift * g * mass_ + kCreatedShare * audit_.peak_kinetic;
  if (audit_.created <= tolerated) return std::nullopt;
  return fmt::format("{:.4g} J came out of nothing (tolerated: {:.4g} J), {:.4g} J of it in this step", audit_.created,
                     tolerated, std::max(0.0, rise - allowed));
}

}  // namespace graze::bullet
