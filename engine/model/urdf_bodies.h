#pragma once
// The bodies that a URDF's links make, with what is fixed to them: each that moves must have mass and inertia.

#include "engine/model/urdf.h"
#include "engine/model/urdf_outline.h"

namespace graze {

/// Replaces a link's <inertial> by this one: mass, kg, centre of mass, m, and inertia about it, kg m^2, in the axes of
/// the link.
void write_inertial(tinyxml2::XMLElement& link, double mass, const Vec3& com, const Mat3& inertia);

/// Writes the six entries of an <inertia>.
void write_inertia(tinyxml2::XMLElement& element, const Mat3& inertia);

/// A link without <inertial> weighs nothing if links that are fixed to it do by their own: many files give the mass of
/// the base to a link behind a fixed joint, since KDL takes no root with an inertia. What its shapes would weigh is
/// taken from it, with a warning, unless these links weigh less than a hundredth of that, such as a camera. `robot`
/// has the links and joints of the outline, in its order.
void leave_mass_to_fixed_links(Robot& robot, const UrdfOutline& outline, UrdfProblems& problems);

/// Tells the bodies of `robot` that move without mass or inertia, and repairs them in the document:
///   no mass: that of the collision shapes of its links at options.density, or else of the boxes about their visual
///     shapes; of too little or none, a ball of a thousandth of the robot's mass, at least of 1 g;
///   no inertia: that of a homogeneous body of its mass in the form of these shapes, or else (and where they
///     are mere contact points, of less than a hundredth of its mass) a ball;
///   an inertia that is singular (an ideal rod): a millionth of its trace is added to each moment.
/// Warns of links whose mass comes from shapes because they have no <inertial>.
void check_bodies(const Robot& robot, const UrdfOutline& outline, const UrdfOptions& options, UrdfProblems& problems);

}  // namespace graze
