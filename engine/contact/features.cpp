#include "engine/contact/features.h"

#include <array>
#include <cmath>
#include <limits>

#include "engine/lanes/scalar.h"

namespace graze {
namespace {

Feature box_feature(const Vec3& size, const Vec3& p, double tolerance) {
  int faces = 0, axis = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double from_face = std::abs(0.5 * size[k] - std::abs(p[k]));
    if (from_face <= tolerance) ++faces;
    if (from_face < least) {
      least = from_face;
      axis = k;
    }
  }
  if (faces >= 3) return Feature::vertex;
  if (faces == 2) return Feature::edge;
  if (axis != 2) return Feature::side;
  return p.z() > 0 ? Feature::top : Feature::bottom;
}

Feature cylinder_feature(const Vec3& size, const Vec3& p, double tolerance) {
  const double from_side = std::abs(pinned::hypot(p.x(), p.y()) - size.x());
  const double from_cap = std::abs(std::abs(p.z()) - 0.5 * size.y());
  if (from_side <= tolerance && from_cap <= tolerance) return Feature::rim;
  return from_cap < from_side ? Feature::cap : Feature::side;
}

}  // namespace

std::string_view feature_name(Feature feature) {
  static constexpr std::array<std::string_view, 8> names = {"surface", "top",    "bottom", "side",
                                                            "edge",    "vertex", "cap",    "rim"};
  return names[static_cast<std::size_t>(feature)];
}

Feature feature_of(const Shape& shape, const Vec3& p_G, double tolerance) {
  if (shape.kind == ShapeKind::box) return box_feature(shape.size, p_G, tolerance);
  if (shape.kind == ShapeKind::cylinder) return cylinder_feature(shape.size, p_G, tolerance);
  return Feature::surface;
}

}  // namespace graze
