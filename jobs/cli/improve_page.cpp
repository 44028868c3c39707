#include "jobs/cli/improve_page.h"

#include <fmt/format.h>

#include <set>
#include <tuple>

#include "analysis/compare.h"
#include "archive/archive.h"
#include "engine/settings/inputs.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/workers/controllers.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBeforeCampaign = "before.graze";
constexpr const char* kImprovedCampaign = "improved.graze";

/// Contents alone: the same files may have been named from another folder.
std::multiset<std::string> contents(const InputFiles& files) {
  std::multiset<std::string> out;
  for (const auto& [name, content] : files) out.insert(content);
  return out;
}

/// Whether an archive is a whole campaign of the scenario as its files are now, robots included.
bool is_whole_campaign(const fs::path& archive, const fs::path& scenario) {
  std::error_code error;
  if (!fs::exists(archive, error)) return false;
  const Archive opened(archive.string());
  return opened.complete() &&
         contents(opened.info().source.inputs) == contents(load_scenario(scenario.string()).source.inputs);
}

Scenario session_scenario(const fs::path& file, const ImproveQuestion& question) {
  Scenario out = load_scenario(file.string());
  out.seed = question.seed;
  prepare_controllers_here(out);
  return out;
}

}  // namespace

DesignPair trace_pair(const fs::path& folder, const ImproveQuestion& question) {
  return {trace_design(session_scenario(folder / kBeforeScenario, question), question.options.policy),
          trace_design(session_scenario(folder / kImprovedScenario, question), question.options.policy)};
}

std::optional<PolicyComparison> kept_verdict(const fs::path& folder) {
  if (!is_whole_campaign(folder / kBeforeCampaign, folder / kBeforeScenario) ||
      !is_whole_campaign(folder / kImprovedCampaign, folder / kImprovedScenario)) {
    return std::nullopt;
  }
  return session_verdict(folder);
}

PolicyComparison session_verdict(const fs::path& folder) {
  CompareRequest request;
  request.name_a = (folder / kBeforeCampaign).string(), request.name_b = (folder / kImprovedCampaign).string();
  return compare_campaigns(Archive(request.name_a), Archive(request.name_b), request).policies.front();
}

bool is_session(const fs::path& folder) { return input_exists((folder / kImproveFile).string()); }

Redesign read_redesign(const fs::path& folder) {
  const fs::path before = folder / kBeforeScenario, improved = folder / kImprovedScenario;
  if (!input_exists(before.string()) || !input_exists(improved.string())) {
    throw InputError(fmt::format(
        "{}: is a session of graze improve that has not come to an end; the same graze improve command goes on",
        folder.string()));
  }
  Redesign out;
  out.scenario = load_scenario(before.string());
  if (!out.scenario.redesign_problem.empty()) throw InputError(out.scenario.redesign_problem);
  if (!out.scenario.redesign) throw InputError(fmt::format("{}: has no 'design' any longer", before.string()));
  ImproveSession session = read_session(folder, out.scenario);
  out.question = std::move(session.question), out.state = std::move(session.state);
  std::tie(out.level, out.improved) = best_design(out.state);
  const Timing& timing = out.scenario.timing;
  check_effort(2 * timing.end / timing.step, "two robots have");
  out.verdict = kept_verdict(folder);
  out.traces = trace_pair(folder, out.question);
  return out;
}

}  // namespace graze
