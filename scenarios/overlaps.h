#pragma once
// Parts that begin in each other.

#include <string>
#include <vector>

#include "engine/clearance/clearance.h"
#include "engine/model/model.h"
#include "engine/settings/settings.h"

namespace graze {

/// The lane of a beginning.
inline constexpr int kBeginningLane = 0;
/// A block in whose first lane a model is in a state. Accelerations and contacts are not set.
BlockState beginning(const Model& model, const State& state);

/// Gaps of all parts with all; terrain is looked at up to 1 mm above it.
Clearance clearance_of_all_parts(const Model& model);

/// "foot and ground by 12 mm, …": the first of some.
std::string overlaps_text(const Model& model, const std::vector<Clearance::Overlap>& overlaps);
/// "[[foot, base], [thigh, base]]", as `contact.ignore` has it.
std::string ignore_text(const Model& model, const std::vector<Clearance::Overlap>& overlaps);

/// What the nominal model says of pairs that never touch, put into the world's contact settings, so that it holds for
/// every particle: neighbours across bodies that are next to nothing (no shape, and less than a thousandth of the mass:
/// how URDFs write joints of several degrees of freedom), and, if `robot.ignore_initial_overlaps` is true, links that
/// are in each other in the nominal initial state, of which it warns. Returns whether there are any, so that the model
/// has to be compiled again.
bool keep_apart(const Settings& root, const Model& model, World& world);

}  // namespace graze
