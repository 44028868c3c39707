// graze VERB …: reads the command line, runs the verb, turns errors into one clear message and an exit code.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string_view>

#include "archive/archive.h"
#include "archive/files/shell_word.h"
#include "engine/lanes/isa.h"
#include "engine/physics.h"
#include "engine/settings/child_end.h"
#include "engine/settings/inputs.h"
#include "graze_version.h"
#include "jobs/campaign/crash.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/help_format.h"
#include "jobs/cli/hidden_words.h"
#include "jobs/cli/option_words.h"
#include "jobs/cli/shipped.h"
#include "jobs/cli/terminal.h"
#include "jobs/cli/wrapped_text.h"
#include "jobs/workers/worker_main.h"

namespace graze {
namespace {

std::string join(int argc, char** argv) {
  std::string line = "graze";
  for (int i = 1; i < argc; ++i) line += " " + shell_word(argv[i]);
  return line;
}

int flushed(int code) {
  errno = 0;
  if (std::cout.flush()) return code;
  // Where an earlier write has failed nothing is tried again, and the reason is not known any more; EBADF: it was
  // closed.
  throw MachineError(errno == 0 || errno == EBADF
                         ? "standard output: cannot be written"
                         : fmt::format("standard output: cannot be written: {}", std::strerror(errno)));
}

/// Every verb, in the order in which the help lists them; `command` is what was typed, which a campaign records.
void add_verbs(CLI::App& app, Action& action, const std::string& command) {
  add_new(app, action);
  add_check(app, action);
  add_steps(app, action);
  add_sources(app, action);
  add_predict(app, action);
  add_drive(app, action);
  add_sample(app, action);
  add_run(app, action, command);
  add_resume(app, action);
  add_sweep(app, action, command);
  add_improve(app, action);
  add_status(app, action);
  add_verify(app, action);
  add_score(app, action);
  add_compare(app, action);
  add_events(app, action);
  add_unknown(app, action);
  add_explain(app, action);
  add_replay(app, action);
  add_report(app, action);
  add_view(app, action);
  add_plot(app, action);
  add_pack(app, action);
  add_submit(app, action);
  add_examples(app, action);
  add_doctor(app, action);
  add_completion(app, action);
}

int parse_and_run(int argc, char** argv) {
  CLI::App app("Graze finds out in simulation how a robot fails before the robot does.", "graze");
  app.set_version_flag("--version", [] {  // not before it is asked for: GRAZE_ISA may be wrong
    return fmt::format("graze {} ({}), physics: {}\n{}", GRAZE_VERSION, GRAZE_REVISION,
                       fmt::join(physics_names(), ", "), isa_report());
  });
  app.require_subcommand(1);
  const std::size_t width = output_width();
  app.formatter(help_format(width));  // before the verbs, which take it over
  const std::filesystem::path docs = docs_folder();
  const bool manual = argc > 1 && std::string_view(argv[1]) == "manual";  // pages are for any machine
  app.footer(
      "\ngraze VERB --help (or graze help VERB) tells more, with examples; graze help scenarios, policies, trackers, "
      "sensors, shapes, distributions, witnesses, objectives, physics, contact_models, sections and units list what "
      "there "
      "is, graze help NAME what one of them takes, graze help schema prints the JSON Schema of a scenario. "
      "Documentation: " +
      (manual || docs.empty() ? "share/doc/graze of an installed copy, docs/ beside the source" : docs.string()) + ".");
  Action action;
  add_verbs(app, action, join(argc, argv));
  const std::vector<std::string> given(argv + 1, argv + argc), words = as_help(given);
  if (const auto code = hidden_words(app, given)) return flushed(*code);
  if (const auto text = topics_asked_for(app, given, width)) {
    std::cout << *text;
    return flushed(kDone);
  }
  check_words(app, words);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::Success& told) {
    app.exit(told);
    action = [] { return kDone; };
  } catch (const CLI::ParseError& error) {
    throw InputError(parse_error_text(app, error));
  }
  return flushed(action());
}

/// A stream that was closed would give its number to the next file that is opened, and what is printed would go there.
/// Output that was closed is opened for reading alone, so that writing to it fails as it would have, with EBADF.
void open_standard_streams() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(number, F_GETFD) != -1) continue;
    if (open("/dev/null", number == STDOUT_FILENO ? O_RDONLY : O_RDWR) != number) std::_Exit(kMachineFailed);
  }
}

int run_program(int argc, char** argv) {
  try {
    log_to_stderr();
    const EscapedOutput out(std::cout), err(std::cerr);
    try {
      return parse_and_run(argc, argv);
    } catch (...) {
      return report_error(std::current_exception());
    }
  } catch (...) {  // there is not even memory for a message
    constexpr std::string_view kText = "graze: out of memory\n";
    [[maybe_unused]] const ssize_t told = write(STDERR_FILENO, kText.data(), kText.size());
    return kMachineFailed;
  }
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  using namespace graze;
  if (started_as_worker(argc, argv)) return work_for_parent();
  open_standard_streams();
  contain_crashes();
  mean_includes(shipped_scenario);
  hear_of_children();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error to tell, not the end
  const MainAtWork until_the_end;
  return run_program(argc, argv);
}
