#pragma once
// `disturbances` of a scenario -> World::disturbances.

#include "engine/model/model.h"
#include "engine/settings/settings.h"
#include "sampling/design.h"
#include "scenarios/springs.h"

namespace graze {

/// Reads every disturbance; `number` reads a number or a distribution. Throws InputError.
void read_disturbances(const Settings& scenario, World& world, const ReadNumber& number);

/// After compile(): links that are none, or do not move, are refused.
void check_disturbances(const Settings& scenario, const Model& model, const World& world);

/// Warns of disturbances that do not come, or not wholly, within `end` s of steps of `step` s, and of masses, impulses
/// and places that hardly are meant. `extent`: robot_extent().
void doubt_disturbances(const Settings& scenario, const ParameterSpace& space, const World& world, const Model& model,
                        const Vec3& extent, double end, double step);

/// "push of BODY0 by uniform(min=0.2, max=1.6) N s towards azimuth 0 rad at 1 s": values, or what is drawn for them.
std::string disturbance_text(const Disturbance& one, const ParameterSpace& space);

}  // namespace graze
