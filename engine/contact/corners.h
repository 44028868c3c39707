#pragma once
// The corners of a hull, also one coordinate after another, so that the furthest is found many at a time.

#include <algorithm>
#include <array>
#include <vector>

#include "engine/model/geometry.h"

namespace graze {

class Corners {
 public:
  Corners() = default;
  explicit Corners(const std::vector<Vec3>& points) : points_(points) { arrange(); }

  void assign(const std::vector<Vec3>& points) {
    points_ = points;
    arrange();
  }
  const std::vector<Vec3>& points() const { return points_; }
  auto begin() const { return points_.begin(); }
  auto end() const { return points_.end(); }
  std::size_t size() const { return points_.size(); }
  const Vec3& operator[](std::size_t k) const { return points_[k]; }

  /// The first of those that lie furthest along n, any length.
  const Vec3& furthest(const Vec3& n) const;

 private:
  static constexpr std::size_t kSide = 8;  // looked at side by side
  void arrange();

  std::vector<Vec3> points_;
  std::size_t padded_ = 0;    // a multiple of kSide; the first point fills up
  std::vector<double> rows_;  // x of all, y of all, z of all
};

}  // namespace graze
