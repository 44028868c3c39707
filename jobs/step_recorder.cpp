#include "jobs/step_recorder.h"

#include <fmt/format.h>

namespace graze {
namespace {

struct Units {
  std::string position, speed, torque;
};

Units units_of(const Body& body) {
  return body.type == JointType::prismatic ? Units{"m", "m/s", "N"} : Units{"rad", "rad/s", "N m"};
}

std::vector<NamedColumn> position_columns(const Model& model, const CampaignInfo& info) {
  std::vector<std::string> units;
  for (const Body& body : model.bodies) {
    if (body.type == JointType::floating) {
      units.insert(units.end(), {"1", "1", "1", "1", "m", "m", "m"});
    } else {
      units.push_back(units_of(body).position);
    }
  }
  std::vector<NamedColumn> out;
  for (std::size_t i = 0; i < units.size(); ++i) out.push_back({info.q_names.at(i), units[i]});
  return out;
}

std::vector<NamedColumn> velocity_columns(const Model& model, const CampaignInfo& info) {
  std::vector<std::string> units;
  for (const Body& body : model.bodies) {
    if (body.type == JointType::floating) {
      units.insert(units.end(), {"rad/s", "rad/s", "rad/s", "m/s", "m/s", "m/s"});
    } else {
      units.push_back(units_of(body).speed);
    }
  }
  std::vector<NamedColumn> out;
  for (std::size_t i = 0; i < units.size(); ++i) out.push_back({info.v_names.at(i), units[i]});
  return out;
}

/// One column per actuator; `unit` gives it of the actuator's joint.
template <class Unit>
std::vector<NamedColumn> actuator_columns(const Model& model, const CampaignInfo& info, const Unit& unit) {
  std::vector<NamedColumn> out;
  for (std::size_t k = 0; k < model.actuated.size(); ++k) {
    out.push_back({info.actuator_names.at(k), unit(units_of(model.bodies[model.actuated[k]]))});
  }
  return out;
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

/// In the order in which StepRecorder::see() fills them.
std::vector<FrameTable> tables(const Scenario& scenario, const CampaignInfo& info) {
  const Model& model = scenario.model;
  const auto actuators = [&](const auto& unit) { return actuator_columns(model, info, unit); };
  return {{"q", position_columns(model, info)},
          {"v", velocity_columns(model, info)},
          {"tau", actuators([](const Units& u) { return u.torque; })},
          {"command/tau", actuators([](const Units& u) { return u.torque; })},
          {"command/q", actuators([](const Units& u) { return u.position; })},
          {"command/v", actuators([](const Units& u) { return u.speed; })},
          {"command/kp", actuators([](const Units& u) { return u.torque + "/" + u.position; })},
          {"command/kd", actuators([](const Units& u) { return u.torque + " s/" + u.position; })},
          {"command/ki", actuators([](const Units& u) { return u.torque + "/(" + u.position + " s)"; })},
          {"command/prescribed", actuators([](const Units&) { return std::string("1"); })},
          {"requirements", requirement_columns(scenario.task)},
          {"objective", objective_columns(scenario.task)}};
}

}  // namespace

StepRecorder::StepRecorder(const Scenario& scenario, const CampaignInfo& info) { log_.tables = tables(scenario, info); }

void StepRecorder::see(const StepView& step) {
  const ActuatorCommand& command = step.command;
  log_.time.push_back(step.time);
  table_ = 0;
  append(step.physics.state().q, step.lane);
  append(step.physics.state().v, step.lane);
  append(step.tau, step.lane);
  for (const BlockArray* part :
       {&command.tau, &command.q, &command.v, &command.kp, &command.kd, &command.ki, &command.prescribed}) {
    step.step == 0 ? append_zeros(part->rows()) : append(*part, step.lane);
  }
  append(step.requirements, step.lane);
  append(step.objective, step.lane);
  append_contacts(step);
}

void StepRecorder::append(const BlockArray& array, int lane) {
  std::vector<double>& values = log_.tables[table_++].values;
  for (int i = 0; i < array.rows(); ++i) values.push_back(array(i, lane));
}

void StepRecorder::append_zeros(int rows) {
  std::vector<double>& values = log_.tables[table_++].values;
  values.insert(values.end(), static_cast<std::size_t>(rows), 0.0);
}

void StepRecorder::append_contacts(const StepView& step) {
  for (const ContactPoint& point : step.physics.contact_points()) {
    if (!point.lanes[step.lane] || !point.touching()[step.lane]) continue;
    log_.contacts.push_back(point.contact(step.lane));
    log_.contact_frame.push_back(static_cast<std::uint32_t>(log_.time.size() - 1));
  }
}

}  // namespace graze
