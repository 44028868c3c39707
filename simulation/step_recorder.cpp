#include "simulation/step_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "engine/model/measures.h"
#include "engine/model/placement.h"

namespace graze {
namespace {

struct Units {
  std::string position, speed, torque;
};

Units units_of(const Body& body) {
  return body.type == JointType::prismatic ? Units{"m", "m/s", "N"} : Units{"rad", "rad/s", "N m"};
}

std::vector<NamedColumn> position_columns(const Model& model, const TraceNames& names) {
  std::vector<std::string> units;
  for (const Body& body : model.bodies) {
    if (body.type == JointType::floating) {
      units.insert(units.end(), {"1", "1", "1", "1", "m", "m", "m"});
    } else {
      units.push_back(units_of(body).position);
    }
  }
  std::vector<NamedColumn> out;
  for (std::size_t i = 0; i < units.size(); ++i) out.push_back({names.q_names.at(i), units[i]});
  return out;
}

std::vector<NamedColumn> velocity_columns(const Model& model, const TraceNames& names) {
  std::vector<std::string> units;
  for (const Body& body : model.bodies) {
    if (body.type == JointType::floating) {
      units.insert(units.end(), {"rad/s", "rad/s", "rad/s", "m/s", "m/s", "m/s"});
    } else {
      units.push_back(units_of(body).speed);
    }
  }
  std::vector<NamedColumn> out;
  for (std::size_t i = 0; i < units.size(); ++i) out.push_back({names.v_names.at(i), units[i]});
  return out;
}

/// One column per actuator; `unit` returns the unit for the actuator's joint.
template <class Unit>
std::vector<NamedColumn> actuator_columns(const Model& model, const TraceNames& names, const Unit& unit) {
  std::vector<NamedColumn> out;
  for (std::size_t k = 0; k < model.actuated.size(); ++k) {
    out.push_back({names.actuator_names.at(k), unit(units_of(model.bodies[model.actuated[k]]))});
  }
  return out;
}

/// Whether the robot's sensors feel the force on a frame: movable objects have none.
bool is_sensed(const Model& model, const Frame& frame) {
  return std::none_of(model.colliders.begin(), model.colliders.end(),
                      [&](const Collider& collider) { return collider.is_object && collider.link == frame.name; });
}

std::vector<NamedColumn> requirement_columns(const Task& task) {
  std::vector<NamedColumn> out;
  for (const Requirement& one : task.requirements) out.push_back({one.name, one.unit});
  return out;
}

std::vector<NamedColumn> objective_columns(const Task& task) {
  std::vector<NamedColumn> out;
  for (const Objective* leaf : leaves(task.objective)) out.push_back({leaf->description, leaf->unit});
  return out;
}

std::vector<NamedColumn> vector_columns(const std::vector<std::string>& names, const std::string& unit) {
  std::vector<NamedColumn> out;
  for (const std::string& name : names) out.push_back({name, unit});
  return out;
}

/// x, y, z of each effector.
std::vector<NamedColumn> effector_columns(const Model& model, const std::vector<int>& effectors,
                                          const std::string& unit) {
  std::vector<NamedColumn> out;
  for (const int frame : effectors) {
    for (const char* axis : {".x", ".y", ".z"}) out.push_back({model.frames[frame].name + axis, unit});
  }
  return out;
}

/// The groups of an Observation, in the order in which append_observation() fills them.
void add_observation(const std::string& prefix, const Scenario& scenario, const TraceNames& names,
                     std::vector<FrameTable>& out) {
  const Model& model = scenario.model;
  const auto actuators = [&](const auto& unit) { return actuator_columns(model, names, unit); };
  const std::vector<std::string> xyz = {"x", "y", "z"}, rpy = {"roll", "pitch", "yaw"};
  std::vector<NamedColumn> links;
  for (const Frame& frame : model.frames) {
    if (is_sensed(model, frame)) links.push_back({frame.name, "N"});
  }
  out.push_back({prefix + "joint_position", actuators([](const Units& u) { return u.position; })});
  out.push_back({prefix + "joint_velocity", actuators([](const Units& u) { return u.speed; })});
  out.push_back({prefix + "joint_acceleration", actuators([](const Units& u) { return u.position + "/s^2"; })});
  out.push_back({prefix + "joint_torque", actuators([](const Units& u) { return u.torque; })});
  out.push_back({prefix + "base_position", vector_columns(xyz, "m")});
  out.push_back({prefix + "base_rpy", vector_columns(rpy, "rad")});
  out.push_back({prefix + "base_velocity", vector_columns(xyz, "m/s")});
  out.push_back({prefix + "base_rate", vector_columns(xyz, "rad/s")});
  out.push_back({prefix + "imu_linear", vector_columns(xyz, "m/s^2")});
  out.push_back({prefix + "imu_angular", vector_columns(xyz, "rad/s^2")});
  out.push_back({prefix + "link_force", links});
}

/// Targets that the tracker follows, in the order of append_targets().
void add_targets(const std::string& prefix, const Scenario& scenario, const TraceNames& names,
                 const Controller& controller, std::vector<FrameTable>& out) {
  const Model& model = scenario.model;
  const auto actuators = [&](const auto& unit) { return actuator_columns(model, names, unit); };
  out.push_back({prefix + "tau", actuators([](const Units& u) { return u.torque; })});
  if (controller.kind() == TargetKind::joint) {
    out.push_back({prefix + "q", actuators([](const Units& u) { return u.position; })});
    out.push_back({prefix + "v", actuators([](const Units& u) { return u.speed; })});
  } else {
    const std::vector<int> effectors = controller.policy().effectors();
    out.push_back({prefix + "x", effector_columns(model, effectors, "m")});
    out.push_back({prefix + "xd", effector_columns(model, effectors, "m/s")});
  }
}

/// In the order in which StepRecorder::see() fills them.
std::vector<FrameTable> tables(const Scenario& scenario, const TraceNames& names, const Controller& controller) {
  const Model& model = scenario.model;
  const auto actuators = [&](const auto& unit) { return actuator_columns(model, names, unit); };
  const StateColumns state = state_columns(scenario, names);
  std::vector<FrameTable> out = {
      {"q", state.q},
      {"v", state.v},
      {"tau", state.tau},
      {"command/tau", actuators([](const Units& u) { return u.torque; })},
      {"command/q", actuators([](const Units& u) { return u.position; })},
      {"command/v", actuators([](const Units& u) { return u.speed; })},
      {"command/kp", actuators([](const Units& u) { return u.torque + "/" + u.position; })},
      {"command/kd", actuators([](const Units& u) { return u.torque + " s/" + u.position; })},
      {"command/ki", actuators([](const Units& u) { return u.torque + "/(" + u.position + " s)"; })},
      {"command/prescribed", actuators([](const Units&) { return std::string("1"); })},
      {"requirements", state.requirements},
      {"objective", state.objective},
      {"centre_of_mass", vector_columns({"x", "y", "z"}, "m")},
      {"control", {{"sensed_at", "s"}, {"lag", "s"}}}};
  std::vector<NamedColumn> inside;
  for (const auto& [name, unit] : controller.policy().inside()) inside.push_back({name, unit});
  out.push_back({"policy", inside});
  inside.clear();
  for (const auto& [name, unit] : controller.tracker().inside()) inside.push_back({name, unit});
  if (!inside.empty()) out.push_back({"tracker", inside});
  add_observation("sensed/", scenario, names, out);
  add_observation("truth/", scenario, names, out);
  add_targets("targets/", scenario, names, controller, out);
  add_targets("targets_in_force/", scenario, names, controller, out);
  out.push_back({"effectors/x", effector_columns(model, controller.policy().effectors(), "m")});
  return out;
}

}  // namespace

StateColumns state_columns(const Scenario& scenario, const TraceNames& names) {
  const Model& model = scenario.model;
  return {position_columns(model, names), velocity_columns(model, names),
          actuator_columns(model, names, [](const Units& u) { return u.torque; }), requirement_columns(scenario.task),
          objective_columns(scenario.task)};
}

double StepRecorder::frame_bytes(const Scenario& scenario, const TraceNames& names, const Controller& controller) {
  std::size_t numbers = 1;  // the time
  for (const FrameTable& table : tables(scenario, names, controller)) numbers += table.columns.size();
  return static_cast<double>(numbers * sizeof(double));
}

void StepRecorder::begin(const Controller& controller) {
  log_.tables = tables(scenario_, names_, controller);
  frame_bytes_ = frame_bytes(scenario_, names_, controller);
  if (static_cast<double>(expected_) * frame_bytes_ > most_) return;
  log_.time.reserve(expected_);
  for (FrameTable& table : log_.tables) table.values.reserve(expected_ * table.columns.size());
}

bool StepRecorder::see(const StepView& step) {
  if (full_) return false;
  if (step.step % every_ != 0) return true;
  if (log_.tables.empty()) begin(step.controller);
  const double contacts = static_cast<double>(log_.contacts.size()) * (sizeof(Contact) + sizeof(std::uint32_t));
  full_ = static_cast<double>(log_.time.size() + 1) * frame_bytes_ + contacts > most_;
  if (full_) return false;
  const ActuatorCommand& command = step.command;
  log_.time.push_back(step.time);
  table_ = 0;
  append(step.physics.state().q, step.lane);
  append(step.physics.state().v, step.lane);
  append(step.tau, step.lane);
  for (const BlockArray* part :
       {&command.tau, &command.q, &command.v, &command.kp, &command.kd, &command.ki, &command.prescribed}) {
    step.step == step.first ? append_same(part->rows(), 0) : append(*part, step.lane);
  }
  append(step.requirements, step.lane);
  append(step.objective, step.lane);
  append_centre_of_mass(step);
  append_control(step);
  append_contacts(step);
  return true;
}

void StepRecorder::append(const BlockArray& array, int lane) {
  std::vector<double>& values = log_.tables[table_++].values;
  for (int i = 0; i < array.rows(); ++i) values.push_back(array(i, lane));
}

void StepRecorder::append(const double* values, std::size_t count) {
  std::vector<double>& column = log_.tables[table_++].values;
  column.insert(column.end(), values, values + count);
}

void StepRecorder::append_same(int rows, double value) {
  std::vector<double>& values = log_.tables[table_++].values;
  values.insert(values.end(), static_cast<std::size_t>(rows), value);
}

/// Of the particle's own robot in the world, without movable objects; of one that does not move NaN.
void StepRecorder::append_centre_of_mass(const StepView& step) {
  double mass = 0;
  Vec3 moment = Vec3::Zero();
  for (std::size_t i = 0; i < step.model.bodies.size(); ++i) {
    if (!is_of_robot(step.model, i)) continue;
    const Body& body = step.model.bodies[i];
    mass += body.mass;
    moment += body.mass * (step.physics.state().pose(static_cast<int>(i), step.lane) * body.com);
  }
  const Vec3 p_W = moment / mass;
  append(p_W.data(), 3);
}

/// What the controller saw and wanted at the last control step; NaN before there was one.
void StepRecorder::append_control(const StepView& step) {
  const std::size_t last = log_.tables.size() - 1;  // the effectors, which are true at any time
  if (step.step == step.first) {
    while (table_ < last) {
      append_same(static_cast<int>(log_.tables[table_].columns.size()), std::numeric_limits<double>::quiet_NaN());
    }
  } else {
    const Controller& controller = step.controller;
    const double when[] = {step.sensed.time[static_cast<std::size_t>(step.lane)], controller.lag(step.lane)};
    append(when, 2);
    std::vector<double> inside(log_.tables[table_].columns.size());
    controller.policy().look_inside(step.lane, inside.data());
    append(inside.data(), inside.size());
    inside.resize(controller.tracker().inside().size());
    controller.tracker().look_inside(step.lane, inside.data());
    if (!inside.empty()) append(inside.data(), inside.size());
    append_observation(step, step.sensed);
    append_observation(step, step.truth);
    append_targets(step, controller.targets());
    append_targets(step, controller.targets_in_force());
  }
  append_effectors(step);
}

void StepRecorder::append_observation(const StepView& step, const Observation& observation) {
  const Observation& o = observation;
  for (const BlockArray* group :
       {&o.joint_position, &o.joint_velocity, &o.joint_acceleration, &o.joint_torque, &o.base_position, &o.base_rpy,
        &o.base_velocity, &o.base_rate, &o.imu_linear, &o.imu_angular}) {
    append(*group, step.lane);
  }
  const std::vector<Frame>& frames = scenario_.model.frames;
  std::vector<double> forces;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (is_sensed(scenario_.model, frames[i])) forces.push_back(o.link_force(static_cast<int>(i), step.lane));
  }
  append(forces.data(), forces.size());
}

void StepRecorder::append_targets(const StepView& step, const Targets& targets) {
  const bool joint = step.controller.kind() == TargetKind::joint;
  append(targets.tau, step.lane);
  append(joint ? targets.q : targets.x, step.lane);
  append(joint ? targets.v : targets.xd, step.lane);
}

/// Where the particle's own effectors are now, in the frame that targets are given in.
void StepRecorder::append_effectors(const StepView& step) {
  const BlockState& state = step.physics.state();
  const auto pose = [&](int body) { return body < 0 ? Pose(Pose::Identity()) : state.pose(body, step.lane); };
  const Pose X_BW = (step.model.floating_base ? pose(0) : fixed_base_pose(step.model)).inverse();
  std::vector<double> out;
  for (const int frame : step.controller.policy().effectors()) {
    const Frame& one = step.model.frames[frame];
    const Vec3 p_B = X_BW * (pose(one.body) * one.X_BF).translation();
    out.insert(out.end(), p_B.data(), p_B.data() + 3);
  }
  append(out.data(), out.size());
}

void StepRecorder::append_contacts(const StepView& step) {
  for (const ContactPoint& point : step.physics.contact_points()) {
    if (!point.lanes[step.lane] || !point.touching()[step.lane]) continue;
    log_.contacts.push_back(point.contact(step.lane));
    log_.contact_frame.push_back(static_cast<std::uint32_t>(log_.time.size() - 1));
  }
}

}  // namespace graze
