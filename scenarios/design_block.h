#pragma once
// `design` of a scenario: what of the robot may be changed to keep its limits (Chapter 5). Which numbers, how far,
// which of them move together, which witnesses are limits, and how the task becomes harder.

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/model/fabrication.h"
#include "engine/settings/settings.h"
#include "scenarios/design_totals.h"
#include "scenarios/task.h"

namespace graze {

/// One number of the design. It may stand for several that move together (symmetry, §6.2.2).
struct DesignVariable {
  std::string name;
  std::vector<std::string> paths;  // parameters of the robot, or settings of policies
  std::vector<double> share;       // of each path: its value is that times the variable's
  /// Of a choice from a list, [choice][path], SI: the variable's value is the number of the choice, from 1, and has no
  /// slope. Empty: a number that may have any value within its bounds.
  std::vector<std::vector<double>> choices;
  std::vector<std::string> choice_words;  // of each, a value for each glob: "2.6 N m, 13.1 rad/s"
  bool of_policy = false;
  std::string unit;                          // SI; of a policy's setting: in which it is written back
  double scale = 1;                          // of a policy's setting: SI value of one such unit
  double nominal = 0, lower = 0, upper = 0;  // SI, lower <= nominal <= upper
  double step = 0;                           // SI, of differences

  /// What a path gets at a value of the variable, SI.
  double at(std::size_t path, double value) const;
};

/// What `graze improve` is asked.
struct DesignBlock {
  std::vector<DesignVariable> variables;
  std::vector<FixedTotal> fixed;                            // sums that no step changes
  std::vector<int> limits;                                  // indices of Task::requirements
  bool objective = false;                                   // its margin is a limit, too
  std::string task_path;                                    // of a setting of the scenario; empty: one task
  std::vector<std::string> task_values;                     // YAML, the easiest first
  std::vector<std::string> task_places;                     // where each stands, "trot.yaml:31:7"
  double window = std::numeric_limits<double>::infinity();  // s, from the first violation on; infinite: whole traces
  /// Traces of differences begin with the window, in the state and with the controller's memory that were recorded
  /// there; else as all others.
  bool recorded = false;
  double quantile = 0.1;  // of the margins of particles
};

/// Reads `design`; null if the scenario has none. `scenario`: its root, everything else of which has been read. Throws
/// InputError: a glob that matches nothing, a path of two variables, parts of a symmetry that cannot move together,
/// bounds that leave the robot's own value out, a parameter that is no matter of design, a list of choices without the
/// robot's own.
std::shared_ptr<const DesignBlock> read_design(const Settings& scenario, const ParameterTable& table, const Task& task,
                                               double end);

}  // namespace graze
