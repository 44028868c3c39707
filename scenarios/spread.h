#pragma once
// How an uncertain number is written -> distributions: `5 mm`, `{normal: {std: 5 %}}`, `{uniform: [0.8, 1.2]}`,
// `{jitter: {normal: {std: 0.3 ms}}}`. One distribution per line of docs/scenario.md.

#include <optional>

#include "engine/model/fabrication.h"
#include "engine/settings/settings.h"
#include "sampling/distribution.h"

namespace graze {

/// What a scenario says of one parameter.
struct Spread {
  Distribution persistent = Distribution::constant(0);
  std::optional<Distribution> jitter;
  std::vector<std::string> labels;      // of a choice
  std::optional<double> noise_density;  // jitter that is white noise of this density, SI unit / sqrt(Hz)
};

/// True if `value` is written as a distribution rather than as a number.
bool is_spread(const Settings& value);

/// Where a distribution stands: under `uncertain`, beside a nominal value, or in the world in the place of one, which
/// it then gives.
enum class Standing { beside_nominal, as_nominal };

/// Reads a number or a distribution for `parameter`, whose nominal value is the default mean and what "5 %" is of; of
/// one that stands `as_nominal`, it is of the mean that is written. Refuses what the parameter cannot be. Throws
/// InputError.
Spread read_spread(const Settings& value, const Parameter& parameter, Standing standing = Standing::beside_nominal);

/// Refuses a distribution that can leave the parameter's bounds, by the very smallest and largest value it can give.
void check_bounds(const Settings& value, const Parameter& parameter, const Distribution& distribution);

/// A greater coefficient of friction is doubted, with these words.
inline constexpr double kMostFriction = 5;
std::string friction_doubt(double friction);

/// `{std: 0.01 rad}` of a conical axis error: tilt normal about 0, heading uniform on the circle.
double read_cone(const Settings& value);

}  // namespace graze
