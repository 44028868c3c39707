#pragma once
// `disturbances` of a scenario -> World::disturbances.

#include "engine/model/model.h"
#include "engine/settings/settings.h"
#include "scenarios/springs.h"

namespace graze {

/// Reads every disturbance; `number` reads a number or a distribution. Throws InputError.
void read_disturbances(const Settings& scenario, World& world, const ReadNumber& number);

/// After compile(): links that are none, or do not move, are refused; what comes after the end of a trace is warned of.
void check_disturbances(const Settings& scenario, const Model& model, const World& world, double end);

}  // namespace graze
