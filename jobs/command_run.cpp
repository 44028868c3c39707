// graze run: simulates a campaign, writes its archive, prints its table.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>

#include "archive/archive.h"
#include "jobs/commands.h"
#include "jobs/simulate.h"

namespace graze {
namespace {

struct Arguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  int threads = 0;
  std::vector<std::string> policies;
  std::string output;
  bool force = false, json = false, quiet = false;
  std::string command_line;
};

/// Where the campaign is written, and the file that it is packed into if the output ends in .h5.
struct Destination {
  std::filesystem::path directory;
  std::optional<std::filesystem::path> packed;
};

Destination destination(const Arguments& arguments, const Scenario& scenario) {
  namespace fs = std::filesystem;
  if (arguments.output.empty()) return {fs::path(scenario.file).stem().string() + ".graze", std::nullopt};
  const fs::path output = arguments.output;
  if (output.extension() != ".h5") return {output, std::nullopt};
  if (fs::exists(output) && !arguments.force) {
    throw InputError(fmt::format("{}: exists already; choose another --output or give --force", output.string()));
  }
  return {fs::path(output).replace_extension(".graze"), output};
}

int run(const Arguments& arguments) {
  Scenario scenario = arguments.scenario.load();
  arguments.draw.apply_to(scenario);
  choose_policies(scenario, arguments.policies);
  CampaignOptions options;
  options.particles = scenario.particles;
  options.seed = scenario.seed;
  options.threads = arguments.threads;
  const Destination out = destination(arguments, scenario);
  CampaignWriter writer(out.directory, describe_campaign(scenario, options.particles, arguments.command_line),
                        arguments.force);
  simulate_into(writer, scenario, options, {arguments.json, arguments.quiet});
  if (out.packed) {
    pack(out.directory, *out.packed, arguments.force);
    std::filesystem::remove_all(out.directory);
  }
  if (!arguments.quiet) spdlog::info("archive: {}", (out.packed ? *out.packed : out.directory).string());
  return kDone;
}

}  // namespace

void add_run(CLI::App& app, Action& action, const std::string& command_line) {
  auto arguments = std::make_shared<Arguments>();
  arguments->command_line = command_line;
  CLI::App* verb = add_verb(app, "run", "Simulate a campaign, write its archive, print its table",
                            "  graze run data/scenarios/quadruped_curb.yaml -n 100\n"
                            "  graze run my.yaml -n 1000 --threads 8 --seed 7 -o out/first.graze\n"
                            "  graze run my.yaml --policy 'step/4cm' --set time.end='2 s' -o one.h5\n");
  arguments->scenario.add_to(*verb);
  arguments->draw.add_to(*verb);
  verb->add_option("--threads", arguments->threads, "Threads; 0: all of this machine's")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  verb->add_option("--policy", arguments->policies, "Only these policies (globs; may be repeated)")
      ->allow_extra_args(false);
  verb->add_option("-o,--output", arguments->output,
                   "Campaign directory, or a file ending in .h5 to be packed into (default: SCENARIO.graze)");
  verb->add_flag("--force", arguments->force, "Replace an existing archive");
  verb->add_flag("--json", arguments->json, "Print the table as JSON");
  verb->add_flag("--quiet", arguments->quiet, "No progress");
  verb->callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace graze
