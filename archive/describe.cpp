// describe_campaign(): what an archive says about its scenario and program.
#include <ctime>

#include "archive/archive.h"
#include "archive/culprit.h"
#include "archive/results_epoch.h"
#include "graze_version.h"
#include "sampling/design_name.h"

namespace graze {
namespace {

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

/// Columns of q and v in the order of Model: a floating body's pose and velocity under its name ("base" for the
/// robot's), one column per joint under the joint's.
void name_states(const Model& model, CampaignInfo& info) {
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.type != JointType::floating) {
      info.q_names.push_back(body.joint);
      info.v_names.push_back(body.joint);
      continue;
    }
    const std::string name = i == 0 && model.floating_base ? "base" : body.name;
    for (const char* part : {".qw", ".qx", ".qy", ".qz", ".x", ".y", ".z"}) info.q_names.push_back(name + part);
    for (const char* part : {".wx", ".wy", ".wz", ".vx", ".vy", ".vz"}) info.v_names.push_back(name + part);
  }
}

CampaignInfo::ParameterRow row_of(const UncertainParameter& parameter) {
  const std::string text = parameter.distribution_text;
  return {parameter.name,
          parameter.unit,
          text.empty() ? parameter.persistent.describe() : text,
          parameter.jitter ? parameter.jitter->describe() : "",
          parameter.nominal,
          parameter.labels};
}

}  // namespace

std::string results_version() { return "epoch " + std::to_string(kResultsEpoch); }

CampaignInfo describe_campaign(const Scenario& scenario, std::uint64_t particles, const std::string& command_line) {
  CampaignInfo info;
  info.scenario_name = scenario.name;
  info.scenario_text = scenario.text;
  info.scenario_sha256 = scenario.sha256;
  info.command_line = command_line;
  info.start_time = now_utc();
  info.program_version = GRAZE_VERSION;
  info.program_revision = GRAZE_REVISION;
  info.results_version = results_version();
  info.build = build_facts();
  info.source = scenario.source;
  info.physics = scenario.physics;
  info.design = design_name(scenario.design);
  info.seed = scenario.seed;
  info.particles = particles;
  info.step = scenario.timing.step;
  info.control = scenario.timing.control;
  info.end = scenario.timing.end;
  for (const UncertainParameter& parameter : scenario.space.parameters) info.parameters.push_back(row_of(parameter));
  for (const Requirement& requirement : scenario.task.requirements) {
    info.requirements.push_back({requirement.name, requirement.description, requirement.unit, requirement.measure,
                                 part_kind_name(requirement.witness->parts()), requirement.window});
  }
  for (const Objective* leaf : leaves(scenario.task.objective)) {
    info.leaves.push_back({"", leaf->description, leaf->unit, false, part_kind_name(leaf->witness->parts())});
  }
  info.objective = scenario.task.objective.name;
  for (const PolicySpec& policy : scenario.policies) info.policies.push_back(policy.name);
  for (const Collider& collider : scenario.model.colliders) info.colliders.push_back(collider.name);
  for (const Body& body : scenario.model.bodies) info.bodies.push_back(body.name);
  for (const Frame& frame : scenario.model.frames) info.links.push_back(frame.name);
  name_states(scenario.model, info);
  for (const int body : scenario.model.actuated) info.actuator_names.push_back(scenario.model.bodies[body].joint);
  return info;
}

}  // namespace graze
