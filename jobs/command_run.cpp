// graze run: simulates a campaign, writes its archive, prints its table.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>

#include "archive/archive.h"
#include "jobs/commands.h"
#include "jobs/simulate.h"
#include "jobs/size_estimate.h"

namespace graze {
namespace {

struct Arguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  RecordArguments record;
  int threads = 0;
  double watchdog = 0;  // s
  std::vector<std::string> policies;
  std::vector<std::string> until;
  std::string confidence, part;
  std::string output;
  bool ignore_space = false, force = false, json = false, quiet = false;
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

/// Checks the questions of --until against the scenario; gives what the archive keeps of them.
UntilInfo ask(const Arguments& arguments, Scenario& scenario) {
  UntilInfo out;
  if (arguments.until.empty()) {
    if (!arguments.confidence.empty()) throw InputError("--confidence is that of the answers to --until; give both");
    return out;
  }
  std::vector<Question> questions;
  for (const std::string& text : arguments.until) questions.push_back(parse_question(text, "--until"));
  std::vector<std::string> policies;
  for (const PolicySpec& policy : scenario.policies) policies.push_back(policy.name);
  check_selectors(questions, policies);
  if (scenario.design == Design::latin_hypercube) {
    throw InputError(
        "--until: a Latin hypercube is one for the number of particles that was asked for, its first particles are "
        "none; use --set sampling.design=random (or sobol)");
  }
  for (const Question& question : questions) out.questions.push_back(question.text);
  if (!arguments.confidence.empty()) out.confidence = parse_fraction(arguments.confidence, "--confidence");
  if (arguments.draw.particles == 0) scenario.particles = kMostParticles;
  out.most = scenario.particles;
  return out;
}

/// `2/4`: the second of four parts of the particles.
ParticleRange part_of(const Arguments& arguments, std::uint64_t particles) {
  if (arguments.part.empty()) return {};
  const char* const begin = arguments.part.data();
  const char* const end = begin + arguments.part.size();
  std::uint64_t number = 0, parts = 0;
  const auto first = std::from_chars(begin, end, number);
  const bool slash = first.ec == std::errc{} && first.ptr != end && *first.ptr == '/';
  if (!slash || std::from_chars(first.ptr + 1, end, parts).ptr != end || number < 1 || number > parts) {
    throw InputError(
        fmt::format("--part {}: is not NUMBER/PARTS, from 1/PARTS to PARTS/PARTS; nearest right answer: 1/{}",
                    arguments.part, std::max<std::uint64_t>(parts, 2)));
  }
  if (parts > particles) {
    throw InputError(fmt::format("--part {}: there are only {} particles", arguments.part, particles));
  }
  if (!arguments.until.empty()) throw InputError("--until: a part knows nothing of the others; leave out --part");
  if (arguments.output.ends_with(".h5")) {
    throw InputError("--part: parts are directories until 'graze pack' makes one file of all; give -o DIRECTORY");
  }
  const auto edge = [&](std::uint64_t i) { return particles / parts * i + std::min(i, particles % parts); };
  return {edge(number - 1), edge(number)};
}

int run(const Arguments& arguments) {
  const std::unique_ptr<Crew> crew = make_crew();
  if (crew->rank() > 0) return assist(*crew, arguments.threads);
  Start start(*crew);
  ScenarioArguments source = arguments.scenario;
  arguments.record.apply_to(source);
  Scenario scenario = source.load();
  arguments.draw.apply_to(scenario);
  choose_policies(scenario, arguments.policies);
  const UntilInfo until = ask(arguments, scenario);
  CampaignOptions options;
  options.particles = scenario.particles;
  options.part = part_of(arguments, options.particles);
  options.seed = scenario.seed;
  options.threads = arguments.threads;
  options.watchdog = arguments.watchdog;
  const Destination out = destination(arguments, scenario);
  CampaignInfo info = describe_campaign(scenario, options.particles, arguments.command_line);
  info.until = until;
  info.part = options.part;
  // --until stops long before the most particles that it may take.
  if (!arguments.ignore_space && until.questions.empty()) {
    check_space(estimate_size(scenario), out.directory, out.packed.has_value());
  }
  CampaignWriter writer(out.directory, info, arguments.force);
  Printing printing{arguments.json, arguments.quiet, out.packed ? out.packed->string() : ""};
  if (out.packed) {
    printing.completed = [&] {
      pack(out.directory, *out.packed, arguments.force);
      std::filesystem::remove_all(out.directory);
    };
  }
  const ExitCode code = simulate_into(writer, scenario, options, info, printing, start);
  if (!arguments.quiet) spdlog::info("archive: {}", (out.packed ? *out.packed : out.directory).string());
  return code;
}

}  // namespace

void add_run(CLI::App& app, Action& action, const std::string& command_line) {
  auto arguments = std::make_shared<Arguments>();
  arguments->command_line = command_line;
  CLI::App* verb = add_verb(app, "run", "Simulate a campaign, write its archive, print its table",
                            "  graze run data/scenarios/quadruped_curb.yaml -n 100\n"
                            "  graze run my.yaml -n 1000 --threads 8 --seed 7 -o out/first.graze\n"
                            "  graze run my.yaml --policy 'step/4cm' --set time.end='2 s' -o one.h5\n"
                            "  graze run my.yaml --until 'p >= 0.95' -n 5000       # exit 0 holds, 1 refuted, 4 open\n"
                            "  graze run my.yaml --until 'ci < 2 %' --until 'step/4cm: p >= 0.9' --confidence 99%\n"
                            "  graze run my.yaml --last '0.5 s' --every 1     # telemetry before failures\n");
  arguments->scenario.add_to(*verb);
  arguments->draw.add_to(*verb);
  arguments->record.add_to(*verb);
  verb->add_option("--threads", arguments->threads, "Threads; 0: all of this machine's")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  add_watchdog(*verb, arguments->watchdog);
  verb->add_option("--policy", arguments->policies, "Only these policies (globs; may be repeated)")
      ->allow_extra_args(false);
  verb->add_option("--until", arguments->until,
                   "Stop as soon as this is answered: '[POLICY:] p >= RATE', 'p < RATE' or 'ci < WIDTH' (may be "
                   "repeated: all of them); -n is then the most particles (default 1,000,000)")
      ->type_name("QUESTION")
      ->allow_extra_args(false);
  verb->add_option("--confidence", arguments->confidence, "Of the answers to --until (default: 95%)")
      ->type_name("FRACTION");
  verb->add_option("--part", arguments->part,
                   "Only one part of the particles, e.g. 2/4, into a directory of its own (graze pack joins parts)")
      ->type_name("NUMBER/PARTS");
  verb->add_option("-o,--output", arguments->output,
                   "Campaign directory, or a file ending in .h5 to be packed into (default: SCENARIO.graze)");
  verb->add_flag("--force", arguments->force, "Replace an existing archive");
  verb->add_flag("--ignore-space", arguments->ignore_space, "Start even if the archive will not fit on the disk");
  verb->add_flag("--json", arguments->json, "Print the table as JSON");
  verb->add_flag("--quiet", arguments->quiet, "No progress");
  verb->callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace graze
