#pragma once
// Numbers that are read as they stand, and that only a forgotten unit explains. Each rule holds the number against the
// robot or the trace, lets pass whatever could be meant, and says what probably was: a warning, with its place. Those
// that a large number could break in earnest look at numbers without a unit alone, so that a written unit settles it.

#include "engine/model/parameters.h"
#include "engine/settings/settings.h"
#include "scenarios/scenario.h"
#include "scenarios/task.h"

namespace graze {

/// `robot.initial.clearance`: a fall of more than twice the robot's largest extent. `extent`: robot_extent().
void doubt_clearance(const Settings& scenario, const Vec3& extent);

/// A robot that may fall in a world with something to stand on, and has no shape to stand by.
void doubt_support(const Settings& scenario, const World& world);

/// `robot.initial` and movable objects: bare numbers that put the robot many of its sizes above all that it could stand
/// on, or an object as far from the robot. `initial`: the state of `model` that they give.
void doubt_places(const Settings& scenario, const World& world, const Model& model, const State& initial);

/// `task`: neither a requirement nor an objective, so that nothing can fail.
void doubt_task(const Settings& scenario, const Task& task);

/// `gravity`: a vector that points up.
void doubt_gravity(const Settings& scenario);

/// Whether a policy waits longer than any trace lasts: with its gait, or for what is sensed of contacts.
void doubt_waits(const Settings& policy, double end);

/// Whether `control.lag`, typically `typical` s, outlasts every trace, so that no command would ever arrive. `written`:
/// the number or distribution, if one entry is known to be it.
void doubt_lag(const Settings& scenario, const std::optional<Settings>& written, double typical, double end);

/// `record.last`: more than twice the whole trace.
void doubt_last(const Settings& scenario, const Timing& timing);

/// The width of a distribution of the error of an angle, of a centre of mass or of the place where the base begins or
/// an object is. `value`: the map that holds it, of `parameter`; `extent`: as above; `distance`: of an object's place
/// from the origin, m.
void doubt_width(const Settings& value, const Parameter& parameter, const Vec3& extent, double distance);
/// The same of `cone: {std}`.
void doubt_cone(const Settings& std);

/// A movable object of this mass and volume, kg and m^3: lighter than air, or denser than any metal. `shape`: its size
/// as written.
void doubt_mass(const Settings& mass, const Settings& shape, double kilograms, double volume);

/// More robots than this, and an object was hardly meant to be as heavy.
constexpr double kHeaviest = 100;

/// A movable object of this density and volume, kg/m^3 and m^3, that weighs more than kHeaviest robots of `robot` kg.
/// `shape`: its size as written; a size with a unit is believed.
void doubt_weight(const Settings& shape, double density, double volume, double robot);

/// `contact_impulse: {below, during}` in traces of at most `end` s.
void doubt_impulse(const Settings& settings, const Model& nominal, double end);

/// Whether a parameter is the mass, density or centre of mass of a link that is welded to the world, which changes
/// nothing.
bool is_welded_mass(const std::string& path, const Model& nominal);

/// Of entries of `uncertain` that name nothing but the masses of links that are welded to the world.
void doubt_welded(const Settings& scenario, const ParameterTable& table, const Model& nominal);

/// `contact.solver: newton` of a model that is too large for it. `physics`: the back end.
void doubt_solver(const Settings& scenario, const Model& nominal, const std::string& physics);

/// "; did you mean 30 cm?" for a bound of a place, `{above, below}` in `range`, that the robot misses at the start by
/// many times its size `size`, by this (negative) margin. `reach`: how far it may have come, m, when it is judged.
/// Empty: it is near enough, or no unit explains it.
std::string length_meant(const Settings& range, double margin, double size, double reach = 0);

}  // namespace graze
