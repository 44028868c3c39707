#include "engine/control/gait_planner.h"

#include <algorithm>

namespace graze {

namespace {

// A support phase can eat into the swing that follows. With less than this fraction of the planned swing left, the foot
// stays where it is until its next planned stance: shorter swings would ask for more than four times the planned speed.
constexpr double kShortestSwing = 0.25;

}  // namespace

Vec3 GaitPlanner::within_reach(int foot, const Vec3& x) const {
  const Vec3 from_hip = x - p_.hip[foot];
  const double distance = from_hip.norm();
  return distance > p_.reach[foot] ? Vec3(p_.hip[foot] + p_.reach[foot] / distance * from_hip) : x;
}

Vec3 GaitPlanner::stance_velocity(const Vec3& x, const BaseCommand& command) const {
  const Vec3 x_G = p_.R_GB * x;
  return -(p_.R_GB.transpose() * (command.v + command.w.cross(x_G)));
}

Vec3 GaitPlanner::touchdown(int foot, const BaseCommand& command) const {
  const PlanarPose middle = predict(command, 0.5 * p_.timing.stance_duration(foot));
  return within_reach(foot, p_.R_GB.transpose() * middle.transform(p_.origin[foot]));
}

void GaitPlanner::start(const GaitInput& input, std::span<FootPlan> feet) const {
  for (std::size_t i = 0; i < feet.size(); ++i) {
    feet[i] = FootPlan{};
    feet[i].x = input.x[i];
    if (p_.settle <= 0) continue;
    // A smooth step (3 s^2 - 2 s^3, at thirds 7/27 and 20/27) to the commanded height; feet stay where they stand.
    Vec3 level = p_.R_GB * input.x[i];
    level.z() = p_.origin[i].z();
    const Vec3 way = p_.R_GB.transpose() * level - input.x[i];
    feet[i].path =
        SwingSpline({input.x[i], input.x[i] + 7.0 / 27 * way, input.x[i] + 20.0 / 27 * way, input.x[i] + way},
                    Vec3::Zero(), Vec3::Zero(), 0, p_.settle);
  }
}

void GaitPlanner::plan(const GaitInput& input, std::span<FootPlan> feet) const {
  if (input.t >= p_.settle) {
    GaitInput since_settled = input;
    since_settled.t -= p_.settle;
    walk(since_settled, feet);
    return;
  }
  for (FootPlan& foot : feet) {
    const SwingSpline::Sample sample = foot.path.at(input.t);
    foot.x = sample.x;
    foot.xd = sample.xd;
  }
}

void GaitPlanner::walk(const GaitInput& input, std::span<FootPlan> feet) const {
  const double phase = p_.timing.phase(input.t);
  BaseCommand command = input.command;
  command.v.z() += p_.timing.hop_velocity(phase, p_.gravity);
  switch_modes(input, phase, feet);
  for (std::size_t i = 0; i < feet.size(); ++i) {
    if (feet[i].mode != FootMode::swing) stand(input, command, static_cast<int>(i), feet[i]);
  }
  lift_off(input, phase, feet);
  for (std::size_t i = 0; i < feet.size(); ++i) {
    if (feet[i].mode == FootMode::swing) swing(input, static_cast<int>(i), feet[i]);
  }
}

void GaitPlanner::switch_modes(const GaitInput& input, double phase, std::span<FootPlan> feet) const {
  for (std::size_t i = 0; i < feet.size(); ++i) {
    FootMode& mode = feet[i].mode;
    const bool stance_planned = p_.timing.in_stance(static_cast<int>(i), phase);
    if (mode == FootMode::swing && stance_planned) {
      feet[i].x = feet[i].path.at(input.t).x;
      mode = FootMode::reach;
    }
    if (mode == FootMode::support && stance_planned) mode = FootMode::stance;
    if (mode == FootMode::reach && (!p_.recovery || input.force[i] > p_.contact_force)) mode = FootMode::stance;
    if (mode != FootMode::swing && !stance_planned) mode = FootMode::support;
  }
}

void GaitPlanner::stand(const GaitInput& input, const BaseCommand& command, int foot, FootPlan& plan) const {
  plan.xd = stance_velocity(input.x[foot], command);
  if (plan.mode == FootMode::reach) plan.xd -= plan.xd.norm() * Vec3::UnitZ();
  plan.x = within_reach(foot, plan.x + input.dt * plan.xd);
}

void GaitPlanner::lift_off(const GaitInput& input, double phase, std::span<FootPlan> feet) const {
  const bool any_reaching =
      std::any_of(feet.begin(), feet.end(), [](const FootPlan& foot) { return foot.mode == FootMode::reach; });
  for (std::size_t i = 0; i < feet.size(); ++i) {
    if (feet[i].mode != FootMode::support) continue;
    const int foot = static_cast<int>(i);
    const bool overreached = (input.x[i] - p_.hip[i]).norm() > p_.reach[i];
    const double left = p_.timing.until_touchdown(foot, phase);
    if ((any_reaching && !overreached) || left < kShortestSwing * p_.timing.swing_duration(foot)) continue;
    feet[i].mode = FootMode::swing;
    feet[i].path = path(input, foot, feet[i].x, feet[i].xd, input.t, left);
    feet[i].planned_for = input.command;
  }
}

SwingSpline GaitPlanner::path(const GaitInput& input, int foot, const Vec3& x, const Vec3& xd, double t0,
                              double duration) const {
  const Vec3 goal = touchdown(foot, input.command);
  Vec3 end_velocity = stance_velocity(goal, input.command);
  end_velocity *= std::min(1.0, p_.max_speed / std::max(end_velocity.norm(), 1e-12));
  const Vec3 up = p_.step_height * (p_.global_up ? input.up_B : Vec3::UnitZ());
  return SwingSpline(swing_knots(x, goal, up, p_.overshoot), xd, end_velocity, t0, duration);
}

void GaitPlanner::swing(const GaitInput& input, int foot, FootPlan& plan) const {
  const SwingSpline& old = plan.path;
  const bool early = input.t - old.start_time() <= p_.redirect * old.duration();
  if (early && !(plan.planned_for == input.command)) {
    plan.path = path(input, foot, old.start(), old.start_velocity(), old.start_time(), old.duration());
    plan.planned_for = input.command;
  }
  const SwingSpline::Sample sample = plan.path.at(input.t);
  plan.x = sample.x;
  plan.xd = sample.xd;
}

}  // namespace graze
