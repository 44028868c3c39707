#include "jobs/commands.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <iostream>
#include <new>

#include "archive/archive.h"

namespace graze {
namespace {

ExitCode fail(ExitCode code, const std::string& message) {
  std::cerr << "graze: " << message << std::endl;
  return code;
}

}  // namespace

ExitCode report_error(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const InputError& input) {
    return fail(kInvalidInput, input.what());
  } catch (const MachineError& machine) {
    return fail(kMachineFailed, machine.what());
  } catch (const std::bad_alloc&) {
    return fail(kMachineFailed, "out of memory");
  } catch (const std::exception& other) {
    return fail(kMachineFailed, fmt::format("internal error: {}", other.what()));
  }
}

void ScenarioArguments::add_to(CLI::App& verb) {
  verb.add_option("scenario", file, "Scenario file (YAML)")->required();
  verb.add_option("--set", set, "Override a value of the scenario: PATH=VALUE, e.g. time.end='2 s' (may be repeated)")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false);
  verb.add_flag("--ignore-missing-meshes", ignore_missing_meshes,
                "Go on without collision meshes whose file is not there");
}

Scenario ScenarioArguments::load() const {
  ScenarioOptions options;
  options.ignore_missing_meshes = ignore_missing_meshes;
  for (const std::string& assignment : set) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(fmt::format("--set {}: not of the form PATH=VALUE, e.g. --set time.end='2 s'", assignment));
    }
    options.overrides.push_back({assignment.substr(0, equals), assignment.substr(equals + 1)});
  }
  Scenario scenario = load_scenario(file, options);
  for (const std::string& warning : scenario.warnings) spdlog::warn("{}", warning);
  return scenario;
}

void DrawArguments::add_to(CLI::App& verb) {
  verb.add_option("-n,--particles", particles, "How many particles (default: the scenario's)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 32));
  verb.add_option("--seed", seed, "Root seed (default: the scenario's)");
}

void DrawArguments::apply_to(Scenario& scenario) const {
  if (particles > 0) scenario.particles = particles;
  if (seed) scenario.seed = *seed;
}

CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& description,
                   const std::string& examples) {
  CLI::App* verb = app.add_subcommand(name, description);
  verb->footer("\nExamples:\n" + examples);
  return verb;
}

}  // namespace graze
