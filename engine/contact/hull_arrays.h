#pragma once
// Hulls as kernels take them.

#include <algorithm>
#include <vector>

#include "engine/contact/manifold.h"
#include "engine/model/hull.h"

namespace graze {

/// The corners of a hull in a frame at its centre, before Shape::size.
class HullArrays {
 public:
  /// Of a shape that has none.
  HullArrays() = default;
  explicit HullArrays(const Hull& hull) : centre_(hull.centre) {
    count_ = static_cast<int>(hull.corners.size());
    for (int i = 0; i < 3; ++i) {
      for (const Vec3& corner : hull.corners) at_[i].push_back(corner[i] - hull.centre[i]);
      while (at_[i].size() % HullView::kSide != 0) at_[i].push_back(at_[i].front());
    }
    for (int k = 0; k < count(); ++k) radius_ = std::max(radius_, corner(k).norm());
  }
  /// Holds as long as this does, wherever it is moved to.
  HullView view() const { return {count(), at_[0].data(), at_[1].data(), at_[2].data(), radius_}; }
  int count() const { return count_; }
  /// The pose of the frame at the centre, where the mesh's own frame stands at X and its size is `size`.
  Pose placed(const Pose& X, const Vec3& size) const {
    if (at_[0].empty()) return X;
    Pose out = X;
    out.translation() = X * centre_.cwiseProduct(size);
    return out;
  }
  Vec3 corner(int k) const { return {at_[0][k], at_[1][k], at_[2][k]}; }

 private:
  Vec3 centre_ = Vec3::Zero();
  int count_ = 0;
  std::vector<double> at_[3];  // the first corner fills up
  double radius_ = 0;
};

}  // namespace graze
