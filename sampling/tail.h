#pragma once
// The normal distribution beyond z = 30, where probabilities (< 5e-198) soon leave the range of a double and only
// ratios of them are left. Serves truncated normals that lie far from their mean.

namespace graze {

/// From here on (in standard deviations) the functions below hold to full precision.
inline constexpr double kFarTail = 30.0;

/// Q(z + d) / Q(z) for the upper tail Q, z >= kFarTail, d >= 0.
double tail_ratio(double z, double d);

/// The d >= 0 with Q(z + d) / Q(z) = ratio, z >= kFarTail, 0 < ratio <= 1.
double tail_quantile(double z, double ratio);

}  // namespace graze
