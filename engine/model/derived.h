#pragma once
// What fabrication makes of a world, in numbers that one can measure on a robot: masses, centres of mass, inertias,
// lengths, where joints and links are. To look at; nothing is computed from it.

#include <string>
#include <vector>

#include "engine/model/world.h"

namespace graze {

struct Derived {
  std::string name, unit;  // SI; "1": none
  double value;
};

/// Of a (perturbed) world, the same names in the same order for all particles of a scenario:
///   robot.mass; robot.com.{x,y,z} (at the start, world axes, from the base's origin)
///   link.<link>.mass, .com.{x,y,z} (link frame), .inertia.{xx,yy,zz,xy,xz,yz} (about the centre of mass, link axes),
///   .length, .radius, .size.{x,y,z} (of its primary shape, what that has), .position.{x,y,z} (its origin at the start,
///   world)
///   joint.<joint>.origin.{x,y,z} (in the parent link's frame), .axis.{x,y,z} (joint frame), .zero, .damping, .friction
///   object.<object>.position.{x,y,z} (at the start), .radius and .length (of what is round) or .size.{x,y,z} (as in
///   Shape), .spectrum.rms (of ground that has one), .mass (movable ones)
std::vector<Derived> derived_numbers(const World& world);

}  // namespace graze
