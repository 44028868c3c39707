#pragma once
// The direction of a vector of any length, however large or small its numbers are.

#include <cmath>

#include "engine/model/model.h"

namespace graze {

/// `v` with length 1; zero if v is. Its largest number is brought near 1 first, by a power of two, which changes no bit
/// of the result: the squares of 1e200 and of 1e-200 are no numbers that a length could be made of.
inline Vec3 direction(const Vec3& v) {
  const double largest = v.cwiseAbs().maxCoeff();
  if (!(largest > 0) || !std::isfinite(largest)) return Vec3::Zero();
  const int scale = -std::ilogb(largest);
  return Vec3(std::scalbn(v[0], scale), std::scalbn(v[1], scale), std::scalbn(v[2], scale)).normalized();
}

}  // namespace graze
