#include "engine/contact/corners.h"

namespace graze {

void Corners::arrange() {
  padded_ = (points_.size() + kSide - 1) / kSide * kSide;
  rows_.resize(3 * padded_);
  for (std::size_t k = 0; k < padded_; ++k) {
    const Vec3& p = points_[k < points_.size() ? k : 0];
    for (std::size_t i = 0; i < 3; ++i) rows_[i * padded_ + k] = p[static_cast<Eigen::Index>(i)];
  }
}

const Vec3& Corners::furthest(const Vec3& n) const {
  using Side = Eigen::Array<double, kSide, 1>;
  const auto side = [&](std::size_t row, std::size_t k) {
    return Eigen::Map<const Side>(rows_.data() + row * padded_ + k);
  };
  double most = -1e300;
  std::size_t first = 0;
  Side best = Side::Zero();
  for (std::size_t k = 0; k < padded_; k += kSide) {
    const Side along = side(0, k) * n.x() + side(1, k) * n.y() + side(2, k) * n.z();
    const double here = along.maxCoeff();
    if (!(here > most)) continue;
    most = here;
    first = k;
    best = along;
  }
  for (std::size_t k = 0; k < kSide; ++k) {
    if (best[static_cast<Eigen::Index>(k)] == most) return points_[first + k];
  }
  return points_.front();  // n is no direction
}

}  // namespace graze
