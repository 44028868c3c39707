#pragma once
// The list of a world's addressable numbers, each with the function that sets it. ParameterTable shows the numbers,
// Fabricator uses the functions.

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/model/fabrication.h"
#include "engine/model/perturbation.h"

namespace graze {

/// Error of one joint's axis, rad.
struct AxisChange {
  double tilt = 0, heading = 0;
};

/// A particle in the making: a copy of the nominal world, and what is to be done to its links, joints and objects once
/// all values are known (so that their order does not matter).
struct Draft {
  World world;
  std::vector<LinkChange> links;      // as World::robot.links
  std::vector<AxisChange> axes;       // as World::robot.joints
  std::vector<ObjectChange> objects;  // as World::objects
  std::vector<double> sensor_bias;    // as channel_names()
};

struct AddressedParameter {
  Parameter parameter;
  std::function<void(Draft&, double)> set;
};

/// All numbers of a world in the order of ParameterTable.
std::vector<AddressedParameter> list_parameters(const World& world);

/// The first two of the paths that cannot both be set, the mass and the density of one thing, by their indices.
std::optional<std::pair<std::size_t, std::size_t>> mass_and_density(const std::vector<std::string>& paths);
/// Why not.
std::string mass_and_density_text(const std::string& mass, const std::string& density);

/// The bias of each channel, in the order of channel_names(): what the world says, else 0.
std::vector<double> nominal_bias(const World& world);

}  // namespace graze
