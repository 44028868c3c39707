#pragma once
// Closed-form contact points: plane against sphere, capsule, cylinder, box and hull; sphere against sphere and box.
// Each call looks at one configuration only, so that a contact's points do not depend on how it came about.

#include <vector>

#include "engine/bullet/shapes.h"

namespace graze::bullet {

/// A point of the first solid and the nearest one of the second, world; normal from the second to the first.
struct Touch {
  btVector3 first, second, normal;
  double distance;  // negative: overlap
};

/// Whether touches() knows these two shapes, in this order.
bool analytic(ShapeKind first, ShapeKind second);
/// Appends the touches nearer than `reach`, at most four that span the contact.
void touches(const Solid& first, const Solid& second, double reach, std::vector<Touch>& out);

}  // namespace graze::bullet
