// Holds the numbers that kernels use for shapes and features against the enumerations they stand for.

#include "engine/contact/collide.h"
#include "engine/contact_record.h"
#include "engine/model/world.h"

namespace graze {

static_assert(kinds::box == ShapeKind::box && kinds::sphere == ShapeKind::sphere &&
              kinds::cylinder == ShapeKind::cylinder && kinds::capsule == ShapeKind::capsule &&
              kinds::mesh == ShapeKind::mesh && kinds::plane == ShapeKind::plane &&
              kinds::heightfield == ShapeKind::heightfield);

constexpr bool same(double number, Feature feature) { return number == static_cast<double>(feature); }
static_assert(same(features::surface, Feature::surface) && same(features::top, Feature::top) &&
              same(features::bottom, Feature::bottom) && same(features::side, Feature::side) &&
              same(features::edge, Feature::edge) && same(features::vertex, Feature::vertex) &&
              same(features::cap, Feature::cap) && same(features::rim, Feature::rim));

}  // namespace graze
