// graze VERB …: reads the command line, runs the verb, turns errors into one clear message and an exit code.
#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <exception>
#include <iostream>

#include "archive/archive.h"
#include "archive/shell_word.h"
#include "engine/lanes/isa.h"
#include "graze_version.h"
#include "jobs/commands.h"

namespace graze {
namespace {

std::string join(int argc, char** argv) {
  std::string line = "graze";
  for (int i = 1; i < argc; ++i) line += " " + shell_word(argv[i]);
  return line;
}

/// A word in the verb's place that is no verb: names the nearest one, which the option parser would not.
void check_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands({})) verbs.push_back(verb->get_name());
  if (std::find(verbs.begin(), verbs.end(), argv[1]) != verbs.end()) return;
  const std::string near = nearest(argv[1], verbs);
  throw InputError(fmt::format("'{}' is not a verb{}; verbs: {}", argv[1],
                               near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near), fmt::join(verbs, ", ")));
}

int parse_and_run(int argc, char** argv) {
  CLI::App app("Graze finds out in simulation how a robot fails before the robot does.", "graze");
  app.set_version_flag("--version", fmt::format("graze {} ({}), physics: {}\n{}", GRAZE_VERSION, GRAZE_REVISION,
                                                fmt::join(physics_names(), ", "), isa_report()));
  app.require_subcommand(1);
  app.footer("\ngraze VERB --help tells more, with examples. Documentation: docs/ beside the source.");
  Action action;
  add_check(app, action);
  add_sample(app, action);
  add_run(app, action, join(argc, argv));
  add_resume(app, action);
  add_status(app, action);
  add_score(app, action);
  add_replay(app, action);
  add_pack(app, action);
  add_submit(app, action);
  check_verb(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? kDone : kInvalidInput;
  }
  const int code = action();
  if (!std::cout.flush()) throw MachineError("standard output: cannot be written");
  return code;
}

/// A stream that was closed would give its number to the next file that is opened, and what is printed would go there.
void open_standard_streams() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(number, F_GETFD) != -1) continue;
    if (open(number == STDOUT_FILENO ? "/dev/full" : "/dev/null", O_RDWR) != number) std::_Exit(kMachineFailed);
  }
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  using namespace graze;
  open_standard_streams();
  spdlog::set_default_logger(spdlog::stderr_color_mt("graze"));
  spdlog::set_pattern("%n: %v");
  try {
    return parse_and_run(argc, argv);
  } catch (...) {
    return report_error(std::current_exception());
  }
}
