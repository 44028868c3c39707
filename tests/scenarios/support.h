#pragma once
// Scenarios of the tests' own robot, a box on a leg (robots/hopper.urdf).

#include <functional>
#include <string>

#include "scenarios/scenario.h"
#include "tests/message_of.h"

namespace graze::testing {

inline const std::string kFolder = std::string(GRAZE_SOURCE_DIR) + "/tests/scenarios/";

/// A whole scenario with more top-level keys behind it.
inline std::string hopper(const std::string& more) {
  return R"(graze: 1
robot: {urdf: robots/hopper.urdf}
environment: {ground: {plane: z}, block: {box: [1, 1, 1], position: [3, 0, 0]}}
time: {end: 1 s, step: 1 ms}
policies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}
)" + more;
}

/// Named as if it stood in this folder, so that it finds the robot; messages begin with "<folder>test.yaml:".
inline Scenario read(const std::string& text) { return parse_scenario(text, kFolder + "test.yaml"); }

}  // namespace graze::testing
