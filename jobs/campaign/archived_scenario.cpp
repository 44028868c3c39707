#include "jobs/campaign/archived_scenario.h"

#include <fmt/format.h>

#include "simulation/results_epoch.h"

namespace graze {
namespace {

const InputFiles& kept_files(const std::string& archive, const CampaignInfo& info, const std::string& refusal) {
  if (!info.source.inputs.empty()) return info.source.inputs;
  throw InputError(fmt::format("{}: was made by graze {}, which did not keep the scenario's files; {}", archive,
                               info.program_version, refusal));
}

Scenario reload(const std::string& archive, const CampaignInfo& info) {
  Scenario scenario = reload_scenario(info.source);
  if (scenario.sha256 != info.scenario_sha256) {
    throw InputError(fmt::format("{}: the scenario reads as {} now and as {} when it was run", archive, scenario.sha256,
                                 info.scenario_sha256));
  }
  scenario.seed = info.seed;
  return scenario;
}

}  // namespace

void check_results_version(const std::string& archive, const CampaignInfo& info, const std::string& instead) {
  if (info.source.inputs.empty() || info.results_version == results_version()) return;
  throw InputError(
      fmt::format("{}: was made by results version {} (revision {}); this program is {}, whose traces may have other "
                  "bits; {}",
                  archive, info.results_version, info.program_revision, results_version(), instead));
}

void check_effort(double steps, const std::string& what) {
  constexpr double kMostSteps = 1e8;
  if (steps <= kMostSteps) return;
  throw InputError(
      fmt::format("{} {:.3g} physics steps together; at most {:.0e} are simulated anew; nearest right "
                  "answer: choose fewer traces or policies",
                  what, steps, kMostSteps));
}

ArchivedScenario::ArchivedScenario(const std::string& archive, const CampaignInfo& info, const std::string& refusal)
    : inputs_(kept_files(archive, info, refusal), info.source.folder), scenario_(reload(archive, info)) {}

}  // namespace graze
