#include "jobs/cli/run_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "analysis/sequential.h"
#include "archive/directory/campaign_directory.h"
#include "archive/files/files.h"
#include "archive/files/shell_word.h"
#include "archive/schema/info.h"
#include "engine/settings/inputs.h"
#include "jobs/campaign/describe_campaign.h"
#include "jobs/campaign/stopping_rule.h"
#include "jobs/cli/shared_options.h"
#include "jobs/cli/simulate.h"
#include "jobs/cli/size_estimate.h"
#include "jobs/workers/controllers.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// Where the campaign is written, and the file that it is packed into if the output ends in .h5.
struct Destination {
  fs::path directory;
  std::optional<fs::path> packed;
};

/// Refuses a file whose campaign would be made in a directory that is there: --force is about the file alone.
void check_is_free(const fs::path& directory, const fs::path& file) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(directory, error)) || fs::is_empty(directory, error)) return;
  if (fs::is_directory(directory, error) && only_begun(directory)) return;  // a run was killed before it was described
  const std::string there = shell_path(directory.string());
  throw InputError(
      fmt::format("--output {0}: is made in {1}, which is there already: a campaign of its own, or what a run that was "
                  "stopped has left; --force does not replace it. Choose another --output, or go on with it: 'graze "
                  "resume {2}' and 'graze pack {2} -o {3}'",
                  file.string(), directory.string(), there, shell_path(file.string())));
}

/// "curb.graze"; of --part 2/4, which has been read, "curb.2of4.graze", so that no part takes another's place.
std::string default_directory(const std::string& part, const Scenario& scenario) {
  std::string name = scenario.file == kStandardInput ? "scenario" : fs::path(scenario.file).stem().string();
  if (const std::size_t slash = part.find('/'); slash != std::string::npos) {
    name += fmt::format(".{}of{}", std::stoull(part), std::stoull(part.substr(slash + 1)));  // 01/4 is 1/4
  }
  return name + ".graze";
}

Destination destination(const RunArguments& arguments, const Scenario& scenario) {
  if (arguments.output.empty()) return {default_directory(arguments.part, scenario), std::nullopt};
  const fs::path output = arguments.output;
  check_campaign_output(output);
  if (ending_of(output) != ".h5") return {output, std::nullopt};
  check_new_file(output, arguments.force, {});
  const fs::path directory = fs::path(output).replace_extension(".graze");
  check_is_free(directory, output);
  return {directory, output};
}

/// Checks the questions of --until against the scenario; returns what the archive keeps of them.
UntilInfo ask(const RunArguments& arguments, Scenario& scenario) {
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
ParticleRange part_of(const RunArguments& arguments, std::uint64_t particles) {
  if (arguments.part.empty()) return {};
  const char* const begin = arguments.part.data();
  const char* const end = begin + arguments.part.size();
  std::uint64_t number = 0, parts = 0;
  const auto first = std::from_chars(begin, end, number);
  const bool slash = first.ec == std::errc{} && first.ptr != end && *first.ptr == '/';
  if (!slash || std::from_chars(first.ptr + 1, end, parts).ptr != end || number < 1 || number > parts) {
    throw InputError(fmt::format(
        "--part {}: is not NUMBER/PARTS, from 1/PARTS to PARTS/PARTS; nearest right answer: {}/{}", arguments.part,
        std::clamp<std::uint64_t>(number, 1, std::max<std::uint64_t>(parts, 1)), parts == 0 ? 2 : parts));
  }
  if (parts > particles) {
    throw InputError(fmt::format("--part {}: there are only {} particles", arguments.part, particles));
  }
  if (!arguments.until.empty()) throw InputError("--until: a part knows nothing of the others; leave out --part");
  if (ending_of(arguments.output) == ".h5") {
    throw InputError("--part: parts are directories until 'graze pack' makes one file of all; give -o DIRECTORY");
  }
  const auto edge = [&](std::uint64_t i) { return particles / parts * i + std::min(i, particles % parts); };
  return {edge(number - 1), edge(number)};
}

}  // namespace

void check_campaign_output(const fs::path& output) {
  check_ending(output, "a campaign is a directory, or one HDF5 file", {".graze", ".h5"});
}

void RunArguments::add_to(CLI::App& verb) {
  scenario.add_to(verb);
  draw.add_to(verb);
  record.add_to(verb);
  add_threads(verb, threads);
  add_watchdog(verb, watchdog);
  add_policies(verb, policies);
  verb.add_option("--until", until,
                  "Stop as soon as this is answered: '[POLICY:] p >= RATE', 'p < RATE' or 'ci < WIDTH' (may be "
                  "repeated: all of them); -n is then the most particles (default 1,000,000)")
      ->type_name("QUESTION")
      ->allow_extra_args(false);
  verb.add_option("--confidence", confidence, "Of the answers to --until (default: 95%)")->type_name("FRACTION");
  verb.add_option(
          "--part", part,
          "Only one part of the particles, e.g. 2/4, into a directory of its own (default: SCENARIO.2of4.graze; graze "
          "pack joins parts)")
      ->type_name("NUMBER/PARTS");
  verb.add_option("-o,--output", output,
                  "Campaign directory, or a file ending in .h5 to be packed into (default: SCENARIO.graze)");
  verb.add_flag("--force", force, "Replace an existing archive");
  verb.add_flag("--ignore-space", ignore_space, "Start even if the archive will not fit on the disk");
  verb.add_flag("--json", json, "Print the table as JSON");
  verb.add_flag("--quiet", quiet, "No progress");
}

RunRequest prepare_run(const RunArguments& arguments, const std::string& command_line) {
  RunRequest out;
  ScenarioArguments source = arguments.scenario;
  arguments.record.apply_to(source);
  out.scenario = source.load();
  arguments.draw.apply_to(out.scenario);
  choose_policies(out.scenario, arguments.policies);
  try_controllers(out.scenario);
  const UntilInfo until = ask(arguments, out.scenario);
  out.options.particles = out.scenario.particles;
  out.options.part = part_of(arguments, out.options.particles);
  out.options.seed = out.scenario.seed;
  out.options.threads = arguments.threads;
  out.options.watchdog = arguments.watchdog;
  const Destination to = destination(arguments, out.scenario);
  out.directory = to.directory;
  out.packed = to.packed;
  out.info = describe_campaign(out.scenario, out.options.particles, command_line);
  out.info.until = until;
  out.info.part = out.options.part;
  check_policy_names(out.info.policies);
  if (!until.questions.empty()) check_stopping_rule(out.info);
  return out;
}

void check_space(const RunArguments& arguments, const RunRequest& request, const fs::path& directory, bool packed) {
  // --until stops long before the most particles that it may take.
  if (arguments.ignore_space || !request.info.until.questions.empty()) return;
  check_space(estimate_size(request.scenario, request.options.part), directory, packed);
}

}  // namespace graze
