#include "jobs/cli/commands.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <limits>
#include <new>

#include "archive/archive.h"
#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/override_doubts.h"
#include "jobs/cli/shared_options.h"
#include "jobs/cli/shipped.h"
#include "jobs/workers/controllers.h"

namespace graze {
void ScenarioArguments::add_to(CLI::App& verb) {
  verb.add_option("scenario", file, "Scenario file (YAML), or the name of a shipped one; - for standard input")
      ->required();
  verb.add_option("--set", set, "Override a value of the scenario: PATH=VALUE, e.g. time.end='2 s' (may be repeated)")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false);
  verb.add_flag("--ignore-missing-meshes", ignore_missing_meshes,
                "Go on without collision meshes whose file is not there");
  verb.add_flag("--repair", repair, "Mend what can be mended in the robot's URDF: short for --set robot.repair=true");
  add_trust(verb);
}

std::vector<Override> ScenarioArguments::overrides() const {
  constexpr std::size_t kShown = 80;  // bytes of what was given in a message
  std::vector<Override> out;
  if (repair) out.push_back({"robot.repair", "true"});
  for (const std::string& assignment : set) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(
          fmt::format("--set {}: not of the form PATH=VALUE, e.g. --set time.end='2 s'", clipped(assignment, kShown)));
    }
    if (assignment.find_first_not_of(" \t", equals + 1) == std::string::npos) {
      throw InputError(fmt::format("--set {0}: the value is empty; --set {0}~ takes what the scenario says there away",
                                   clipped(assignment.substr(0, equals), kShown) + "="));
    }
    out.push_back({assignment.substr(0, equals), assignment.substr(equals + 1)});
  }
  return out;
}

Scenario ScenarioArguments::load() const {
  ScenarioOptions options;
  options.ignore_missing_meshes = ignore_missing_meshes;
  options.overrides = overrides();
  refuse_robot_file(file);
  Scenario scenario = load_scenario(scenario_file(file), options);
  warn(scenario.warnings);
  doubt_overrides(options.overrides, scenario);
  prepare_controllers_here(scenario);
  return scenario;
}

std::string ScenarioArguments::options_without(const std::string& path) const {
  std::string out;
  for (const std::string& one : set) {
    if (!one.starts_with(path + "=")) out += " --set " + shell_word(one);
  }
  if (ignore_missing_meshes) out += " --ignore-missing-meshes";
  if (repair) out += " --repair";
  return out;
}

std::vector<std::filesystem::path> files_of(const Scenario& scenario) {
  std::vector<std::filesystem::path> out = {scenario.file};
  for (const auto& [name, content] : scenario.source.inputs) out.emplace_back(name);
  return out;
}

void RecordArguments::add_to(CLI::App& verb) {
  add_choice(verb, "--telemetry", telemetry, {"none", "failures", "last", "all"},
             "Frames to keep; last: of the last seconds before a failure");
  add_whole(verb, "--every", every, 1, 1'000'000'000, "Physics steps between frames");
  verb.add_option("--last", last, "With --telemetry last (implied): how long before a failure, e.g. '0.5 s'")
      ->type_name("TIME");
}

void RecordArguments::apply_to(ScenarioArguments& scenario) const {
  if (!last.empty() && !telemetry.empty() && telemetry != "last") {
    throw InputError(fmt::format("--last {}: is for --telemetry last, not {}", last, telemetry));
  }
  const std::string which = last.empty() ? telemetry : "last";
  if (which.empty() && every == 0) return;
  if (!which.empty()) scenario.set.push_back("record.telemetry=" + which);
  if (every > 0) scenario.set.push_back(fmt::format("record.every={}", every));
  if (!last.empty()) scenario.set.push_back("record.last=" + last);
}

void DrawArguments::add_to(CLI::App& verb) {
  add_whole(verb, "-n,--particles", particles, 1, kParticleLimit, "How many particles (default: the scenario's)");
  add_whole(verb, "--seed", seed, 0, std::numeric_limits<std::uint64_t>::max(), "Root seed (default: the scenario's)");
}

void DrawArguments::apply_to(Scenario& scenario) const {
  if (particles > 0) scenario.particles = particles;
  if (seed) scenario.seed = *seed;
}

void add_threads(CLI::App& verb, int& threads) {
  add_whole(verb, "--threads", threads, 0, 4096, "Threads; 0: all of this machine's")->default_str("0");
}

std::vector<std::string> chosen_names(const std::vector<std::string>& policies,
                                      const std::vector<std::string>& patterns, const std::string& where,
                                      const std::string& option) {
  if (patterns.empty()) return policies;
  for (const std::string& pattern : patterns) {
    const auto chosen = [&](const std::string& name) { return matches(pattern, name); };
    if (std::any_of(policies.begin(), policies.end(), chosen)) continue;
    throw InputError(fmt::format("{} {}: no policy of that name in {}; {}", option, pattern, where,
                                 nearest_or_all(pattern, policies)));
  }
  std::vector<std::string> out;
  for (const std::string& name : policies) {
    const auto chooses = [&](const std::string& pattern) { return matches(pattern, name); };
    if (std::any_of(patterns.begin(), patterns.end(), chooses)) out.push_back(name);
  }
  return out;
}

CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& description,
                   const std::string& examples) {
  CLI::App* verb = app.add_subcommand(name, description);
  verb->footer("\nExamples:\n" + examples);
  return verb;
}

}  // namespace graze
