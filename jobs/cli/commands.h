#pragma once
// The verbs of the command line. Each adds its own subcommand, with help and examples, and runs when it was given.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "jobs/campaign/exit_code.h"
#include "scenarios/scenario.h"

namespace graze {

/// A verb that has been given: does its work and returns the exit code.
using Action = std::function<int()>;

void add_check(CLI::App& app, Action& action);
void add_steps(CLI::App& app, Action& action);
void add_sources(CLI::App& app, Action& action);
void add_predict(CLI::App& app, Action& action);
void add_drive(CLI::App& app, Action& action);
void add_sample(CLI::App& app, Action& action);
void add_sweep(CLI::App& app, Action& action, const std::string& command_line);
void add_run(CLI::App& app, Action& action, const std::string& command_line);
void add_resume(CLI::App& app, Action& action);
void add_improve(CLI::App& app, Action& action);
void add_status(CLI::App& app, Action& action);
void add_verify(CLI::App& app, Action& action);
void add_replay(CLI::App& app, Action& action);
void add_score(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_unknown(CLI::App& app, Action& action);
void add_events(CLI::App& app, Action& action);
void add_report(CLI::App& app, Action& action);
void add_view(CLI::App& app, Action& action);
void add_plot(CLI::App& app, Action& action);
void add_explain(CLI::App& app, Action& action);
void add_new(CLI::App& app, Action& action);
void add_pack(CLI::App& app, Action& action);
void add_examples(CLI::App& app, Action& action);
void add_completion(CLI::App& app, Action& action);
void add_doctor(CLI::App& app, Action& action);
void add_submit(CLI::App& app, Action& action);

/// Options that every verb that reads a scenario has.
struct ScenarioArguments {
  std::string file;
  std::vector<std::string> set;  // path=value
  bool ignore_missing_meshes = false, repair = false;

  void add_to(CLI::App& verb);
  /// What --set says. Throws InputError.
  std::vector<Override> overrides() const;
  /// Reads the scenario; prints its warnings on stderr.
  Scenario load() const;
  /// The options as words of a shell, each behind a blank, but what is set of `path`.
  std::string options_without(const std::string& path) const;
};

/// The files that a scenario is made of, which no output may replace.
std::vector<std::filesystem::path> files_of(const Scenario& scenario);

/// What is recorded of a trace, in place of what the scenario says: short for --set record.….
struct RecordArguments {
  std::string telemetry, last;
  std::uint64_t every = 0;  // 0: as the scenario says

  void add_to(CLI::App& verb);
  /// Adds its overrides; --last means --telemetry last.
  void apply_to(ScenarioArguments& scenario) const;
};

/// Options of the verbs that draw particles.
struct DrawArguments {
  std::uint64_t particles = 0;  // 0: as many as the scenario says
  std::optional<std::uint64_t> seed;

  void add_to(CLI::App& verb);
  /// Puts what was given in place of the scenario's own number and seed.
  void apply_to(Scenario& scenario) const;
};

/// Adds --threads to a verb.
void add_threads(CLI::App& verb, int& threads);

/// The policies that the globs of an option choose, in their own order; all if there are no globs. Throws InputError
/// with the nearest name if one of them chooses none; `where` is what should have it.
std::vector<std::string> chosen_names(const std::vector<std::string>& policies,
                                      const std::vector<std::string>& patterns, const std::string& where,
                                      const std::string& option = "--policy");

/// A verb with its description and, below its options, examples.
CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& description, const std::string& examples);

}  // namespace graze
