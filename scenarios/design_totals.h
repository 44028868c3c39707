#pragma once
// `design.fixed`: sums of design variables that no step may change, as the length of a leg or the robot's mass (§5.2).

#include <string>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {

struct DesignVariable;

/// A sum over all the numbers that some variables stand for. No variable is in two of them.
struct FixedTotal {
  std::vector<int> variables;   // indices of DesignBlock::variables, ascending, two at least
  std::vector<double> weights;  // of each: how much the sum grows with its value; none is 0
};

/// Value of a total at a design, SI.
double total_at(const FixedTotal& total, const std::vector<double>& design);
/// "front_thigh + front_shin"
std::string total_name(const FixedTotal& total, const std::vector<DesignVariable>& variables);

/// Reads `design.fixed`. Throws InputError: a glob that matches no variable, a sum of one, variables of two sums, sums
/// of lengths and masses.
std::vector<FixedTotal> read_totals(const Settings& fixed, const std::vector<DesignVariable>& variables);

}  // namespace graze
