#include "jobs/campaign/describe_campaign.h"

#include <ctime>

#include "archive/schema/culprit.h"
#include "graze_version.h"
#include "sampling/design_name.h"
#include "simulation/results_epoch.h"

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

CampaignInfo describe_campaign(const Scenario& scenario, std::uint64_t particles, const std::string& command_line) {
  CampaignInfo info;
  static_cast<TraceNames&>(info) = trace_names(scenario.model);
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
  info.unconverged = scenario.unconverged;
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
  return info;
}

}  // namespace graze
