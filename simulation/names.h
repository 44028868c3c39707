#pragma once
// What the columns and indices of trace records mean, in the names of the robot's parts.

#include <string>
#include <vector>

namespace graze {

struct Model;

struct TraceNames {
  std::vector<std::string> colliders;                         // by index in events
  std::vector<std::string> bodies;                            // by index in joint-limit events
  std::vector<std::string> links;                             // frames, by index in culprits
  std::vector<std::string> q_names, v_names, actuator_names;  // columns of states and telemetry: "base.qw", "LF_X_1"
};

/// A floating body's pose and velocity stand under its name ("base" for the robot's), a joint's under the joint's.
TraceNames trace_names(const Model& model);

}  // namespace graze
