#pragma once
// How the numbers of a contact point lie in memory, for kernels and everybody else.

namespace graze {

/// Speed of a contact point over a round surface from which on it rolls, m/s (our choice).
inline constexpr double kRollSpeed = 1e-3;

/// Numbers of a contact point, each a row of W lanes.
enum ContactRow : int {
  kPoint = 0,           // 3, world, m
  kNormal = 3,          // 3, unit, from b to a
  kGap = 6,             // m, at the beginning of the step
  kImpulse = 7,         // 3, on a, N s
  kNormalImpulse = 10,  // N s, >= 0
  kMode = 11,           // ContactMode
  kFeatureA = 12,       // Feature
  kFeatureB = 13,
  kAge = 14,  // s from the first touch within the step to its end
  kContactRows = 15
};

}  // namespace graze
