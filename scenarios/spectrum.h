#pragma once
// `spectrum` of a heightfield: ground that is drawn (engine/model/spectrum.h).

#include <string>

#include "engine/model/world.h"
#include "engine/settings/description.h"
#include "scenarios/springs.h"

namespace graze {

const Description& spectrum_description();

/// The nominal ground of a heightfield of that extent (m). `spectrum`: the map of that key.
Shape read_spectrum(const Settings& spectrum, double length_x, double length_y);

/// Hands what is written in it as a distribution to `number`. `shape` is what read_spectrum() has returned, `path` the
/// object's, "environment.hills".
void read_spectrum_spreads(const Settings& spectrum, const std::string& path, const Shape& shape,
                           const ReadNumber& number);

}  // namespace graze
