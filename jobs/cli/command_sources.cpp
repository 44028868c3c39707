// graze sources: how far each source of uncertainty alone drives the outcome apart.
#include <spdlog/spdlog.h>

#include <iostream>
#include <memory>

#include "jobs/campaign/source_study.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/shared_options.h"
#include "jobs/cli/simulate.h"

namespace graze {
namespace {

struct SourcesArguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  std::vector<std::string> policies;
  int threads = 0;
  double watchdog = 0;  // s
  bool json = false, quiet = false;
};

int sources(const SourcesArguments& arguments) {
  Scenario scenario = arguments.scenario.load();
  arguments.draw.apply_to(scenario);
  choose_policies(scenario, arguments.policies);
  scenario.recording.telemetry = Telemetry::none;
  if (scenario.space.parameters.empty()) {
    spdlog::warn("{}: nothing is uncertain in it, so that there is no source to compare", scenario.file);
  }
  SourceQuestion question{scenario.particles, scenario.seed, arguments.threads, arguments.watchdog};
  if (!arguments.quiet) {
    question.begins = [](const std::string& source, std::size_t number, std::size_t all) {
      spdlog::info("sources: {} ({} of {})", source, number, all);
    };
  }
  const std::vector<SourceSpread> rows = study_sources(scenario, question);
  std::cout << (arguments.json ? sources_json(scenario.name, scenario.particles, rows)
                               : format_sources(scenario.name, scenario.particles, rows));
  return kDone;
}

}  // namespace

void add_sources(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<SourcesArguments>();
  CLI::App* verb = add_verb(
      app, "sources", "How far each source of uncertainty, alone, drives outcomes apart",
      "  graze sources quadruped_sources\n"
      "  graze sources my.yaml --policy walk -n 1000 --json\n\n"
      "Fabrication, environment, contact, initial state, actuation, sensing, state estimate, lag and disturbances, "
      "each with the\nothers at their nominal values, beside none and all of them. Nothing is written.\n");
  arguments->scenario.add_to(*verb);
  arguments->draw.add_to(*verb);
  add_policies(*verb, arguments->policies);
  add_threads(*verb, arguments->threads);
  add_watchdog(*verb, arguments->watchdog);
  verb->add_flag("--json", arguments->json, "Print as JSON, in SI units");
  verb->add_flag("--quiet", arguments->quiet, "No progress");
  verb->callback([arguments, &action] { action = [arguments] { return sources(*arguments); }; });
}

}  // namespace graze
