#pragma once
// What mass and inertia a body that moves must have, and the nearest inertia that a rigid body can have.

#include <string>

#include "engine/model/geometry.h"

namespace graze {

/// What is wrong with the mass of a moving body, kg: "mass 0: …". Empty: nothing.
std::string mass_problem(double mass);

/// What is wrong with the inertia of a moving body about its centre of mass, kg m^2: not finite, not positive, or
/// against the triangle inequality. Empty: nothing.
std::string inertia_problem(const Mat3& inertia);

/// Whether an inertia is that of a mere point but for rounding: zeros that have been turned or moved about. `mass` in
/// kg.
bool is_of_point(const Mat3& inertia, double mass);

/// The inertia of a rigid body that is nearest to the symmetric matrix `inertia` in the Frobenius norm. It has the same
/// principal axes; its principal moments are the projection of those given onto the cone of the triangle inequality
/// I_i <= I_j + I_k (which makes them positive, too), less a margin of a millionth of the largest, so that no rounding
/// leads out of it again. Zero if no moment is positive.
Mat3 nearest_physical_inertia(const Mat3& inertia);

}  // namespace graze
