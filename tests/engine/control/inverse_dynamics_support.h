#pragma once
// What the tests of the tracker `inverse_dynamics` share.

#include "tests/engine/control/closed_loop.h"

namespace graze {

/// A robot under a policy on the lane engine, all with one step.
struct LaneLoop : ClosedLoop {
  LaneLoop(const Scene& nominal, const std::string& policy, double h = 1e-3)
      : ClosedLoop(nominal, policy, h, "lanes") {}
};

inline constexpr double kKp = 5e4, kKd = 100;  // facts c.6: acceleration gains of the published joint controller
/// Unless it says otherwise, contacts take up within a step what moves against them, as in the engine, and what all
/// dissipate most decides before torques do.
inline std::string tracker(const std::string& more = "") {
  const auto told = [&](const char* key) { return more.find(key) != std::string::npos; };
  return "inverse_dynamics: {kp: 5e4, kd: 100" + more + (told("horizon") ? "" : ", horizon: 1 ms") +
         (told("regularization") || told("none") || told("sensed") ? "" : ", regularization: 1e-6") + "}";
}
inline std::string hold(const std::string& control) { return "{hold: {}, control: {" + control + "}}"; }
inline std::string trot(const std::string& control) {
  return "{gait: {velocity: [0.2, 0, 0], duration: 0.3 s, duty: 60 %, touchdown: '[25, 75, 75, 25] %', step_height: "
         "1.5 "
         "cm, stance: {length: 120 %, width: 200 %, height: 90 %}}, control: {" +
         control + "}}";
}

/// LINKS whose motors are strong enough for anything, with contacts of the convex model.
inline World strong_links(double friction = 1.0) {
  World world = links_world();
  for (Joint& joint : world.robot.joints) joint.effort = joint.velocity = 1e9;
  world.contact.model = "complementarity_free";
  world.contact.friction = friction;
  return world;
}

/// LINKS, heavier by `mass`, on ground of `friction`, with a hind foot longer by 3 mm.
inline Particle other_robot(double mass, double friction, std::uint32_t id) {
  World world = links_world();
  for (Link& link : world.robot.links) link.inertia = link.inertia.scaled(mass);
  world.contact.friction = friction;
  for (Joint& joint : world.robot.joints) {
    if (joint.child == "LH_FOOT") joint.X_PJ.translation() *= 1.03;
  }
  Particle out = Scene(world).particle(id);
  return out;
}

}  // namespace graze
