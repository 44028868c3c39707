#include "jobs/cli/improve_failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <set>
#include <vector>

#include "analysis/scenario_changes.h"
#include "archive/archive.h"
#include "jobs/campaign/design_robots.h"
#include "jobs/cli/option_values.h"
#include "sampling/design_name.h"

namespace graze {
namespace {

constexpr std::uint64_t kUsualFailures = 32;  // particles that are improved on
constexpr std::size_t kFewFailures = 8;       // a block of lanes

/// What failed most in an archive, and whom.
struct FrequentFailure {
  std::string requirement;
  std::string as_often;                  // another one that is no rarer; empty: none
  std::vector<std::uint32_t> particles;  // ascending
  std::uint64_t failures = 0, traces = 0;
  std::uint64_t seed = 1, drawn = 0;
};

/// Robots, meshes and controllers, by what is in them: the same ones may have been named from another folder.
void check_same_files(const std::string& file, const CampaignInfo& info, const Scenario& scenario) {
  std::set<std::string> there;
  for (const auto& [name, content] : info.source.inputs) there.insert(content);
  for (const auto& [name, content] : scenario.source.inputs) {
    if (!is_part_of_robot(name) || there.contains(content)) continue;
    throw InputError(fmt::format(
        "--from {}: is a campaign with another {}; improve the robot that was run, or run this one", file, name));
  }
}

/// Its particles are those of the scenario, but for `design`, or failures of others would be improved on.
void check_same_scenario(const std::string& file, const CampaignInfo& info, const Scenario& scenario) {
  std::vector<ScenarioChange> changes = scenario_changes(info.scenario_text, scenario.text);
  std::erase_if(changes, [](const ScenarioChange& one) {
    return (one.path + ".").starts_with("design.") || one.path == "sampling.design";
  });
  // --design changes it where no file says so.
  if (info.design != design_name(scenario.design)) {
    const ScenarioChange drawn{"sampling.design", info.design, std::string(design_name(scenario.design))};
    changes.insert(changes.begin(), drawn);
  }
  if (changes.empty()) {
    check_same_files(file, info, scenario);
    return;
  }
  const auto shown = [](const std::string& text) {
    return text.empty() ? std::string("not there") : clipped(text, 60);
  };
  throw InputError(
      fmt::format("--from {}: is a campaign of another scenario: {} is {} there and {} here{}; improve the one that "
                  "was run, or run "
                  "this one",
                  file, changes.front().path, shown(changes.front().in_a), shown(changes.front().in_b),
                  changes.size() > 1 ? fmt::format(", and {} more", changes.size() - 1) : ""));
}

FrequentFailure most_frequent(const std::string& file, const std::string& policy, const Scenario& scenario) {
  const Archive archive(file);
  const CampaignInfo& info = archive.info();
  check_same_scenario(file, info, scenario);
  if (std::find(info.policies.begin(), info.policies.end(), policy) == info.policies.end()) {
    throw InputError(
        fmt::format("--from {}: has no policy '{}'; {}", file, policy, nearest_or_all(policy, info.policies)));
  }
  std::map<int, std::vector<std::uint32_t>> by_requirement;  // -1: the objective
  FrequentFailure out;
  std::uint64_t invalid = 0;
  archive.scan(policy, 0, [&](const TraceRows& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      ++out.traces;
      const Outcome outcome = rows.outcome(i);
      if (outcome == Outcome::known_failure) by_requirement[rows.violated(i)].push_back(rows.particle(i));
      if (outcome == Outcome::unknown_failure) by_requirement[-1].push_back(rows.particle(i));
      invalid += outcome == Outcome::invalid;
    }
  });
  int most = -2;
  for (const auto& [requirement, particles] : by_requirement) {
    if (most == -2 || particles.size() > by_requirement[most].size()) most = requirement;
  }
  if (most == -2) {
    throw InputError(fmt::format("--from {}: no trace of '{}' failed, so there is nothing to improve{}", file, policy,
                                 invalid == 0 ? "" : fmt::format("; {} are invalid, which is no failure", invalid)));
  }
  out.particles = by_requirement[most];
  std::sort(out.particles.begin(), out.particles.end());
  out.failures = out.particles.size();
  const auto name_of = [&](int k) {
    return k < 0 ? std::string("objective") : info.requirements.at(static_cast<std::size_t>(k)).name;
  };
  out.requirement = name_of(most);
  for (const auto& [requirement, particles] : by_requirement) {
    if (requirement != most && particles.size() == out.failures) out.as_often = name_of(requirement);
  }
  out.seed = info.seed;
  out.drawn = info.particles;
  return out;
}

}  // namespace

void begin_at_failures(const std::string& archive, std::uint64_t particles, const Scenario& scenario,
                       ImproveQuestion& question) {
  FrequentFailure found = most_frequent(archive, question.options.policy, scenario);
  const std::uint64_t most = particles > 0 ? particles : kUsualFailures;
  if (found.particles.size() > most) found.particles.resize(most);
  std::cerr << fmt::format(
      "{} of {} traces failed by '{}' first, {}: improving on {} of these{}\n", found.failures, found.traces,
      found.requirement,
      found.as_often.empty() ? "more than by anything else" : fmt::format("and as many by '{}'", found.as_often),
      found.particles.size(),
      found.particles.size() < kFewFailures
          ? "; what helps so few may harm others, and a larger campaign has more of them"
          : "");
  question.options.particles = found.particles;
  question.seed = found.seed;
  question.drawn = found.drawn;
}

}  // namespace graze
