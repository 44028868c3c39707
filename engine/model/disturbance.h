#pragma once
// What is done to the robot from outside during a trace: pushes, and masses that are put on links. A World describes
// them by the names of links; a particle has them with its own numbers, resolved to bodies.

#include <string>

#include "engine/model/geometry.h"

namespace graze {

/// Bounds beyond which nothing is a robot's any more, as that of links' masses: kg, and N or N s.
inline constexpr double kMostPayload = 1e9, kMostPush = 1e12;

/// `disturbances` of a scenario. Lengths in m, angles in rad, times in s.
struct Disturbance {
  enum class Kind { push, payload };
  std::string name;
  Kind kind = Kind::push;
  std::string link;           // or movable object
  Vec3 point = Vec3::Zero();  // where, in the link's frame, m
  double at = 0;              // s, when it begins

  // Pushes. The direction is (cos e cos a, cos e sin a, sin e) in world axes, a: azimuth, e: elevation.
  bool is_force = false;  // `strength` is a force, N; else an impulse, N s
  double strength = 0;
  double azimuth = 0, elevation = 0;  // rad
  double duration = 0;                // s, over which it is even; 0: within one step (impulses alone)

  // Payloads: a point mass that comes with the velocity of its place, and stays.
  double mass = 0;  // kg
};

/// A disturbance of one particle.
struct BodyDisturbance {
  Disturbance::Kind kind = Disturbance::Kind::push;
  int body = 0;
  Vec3 p_B = Vec3::Zero();        // its point in the body frame, m
  Vec3 impulse_W = Vec3::Zero();  // of a push, all of it, world axes, N s
  double at = 0, duration = 0;    // s
  double mass = 0;                // kg
};

}  // namespace graze
