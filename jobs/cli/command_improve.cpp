// graze improve: changes a robot's design until its limits hold (Chapters 5 and 6).
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <set>
#include <span>
#include <thread>

#include "analysis/report_data.h"
#include "analysis/text_table.h"
#include "archive/files/files.h"
#include "archive/files/lock.h"
#include "archive/files/parent_folders.h"
#include "jobs/campaign/hanging_controllers.h"
#include "jobs/campaign/improvement_file.h"
#include "jobs/campaign/improvement_history.h"
#include "jobs/campaign/improvement_page.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/improve_dialogue.h"
#include "jobs/cli/improve_failures.h"
#include "jobs/cli/improve_page.h"
#include "jobs/cli/improve_picture.h"
#include "jobs/cli/improve_text.h"
#include "jobs/cli/improve_verdict.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/page.h"
#include "jobs/cli/picture_file.h"
#include "jobs/cli/value_warnings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct ImproveArguments {
  ScenarioArguments scenario;
  std::string policy, step = "plain", output, from, answers, plot, report;
  std::string alpha;
  std::uint64_t particles = 0, verdict = 0, most_steps = 100;
  std::optional<std::uint64_t> seed;
  int threads = 0;
  bool automatic = false, ask = false, json = false, force = false;
};

constexpr const char* kAnswersFile = "answers.txt";  // of a supervised session, for --answers

std::string policy_to_improve(const Scenario& scenario, const std::string& asked) {
  std::vector<std::string> names;
  for (const PolicySpec& one : scenario.policies) names.push_back(one.name);
  if (asked.empty() && names.size() == 1) return names.front();
  if (!asked.empty() && std::find(names.begin(), names.end(), asked) != names.end()) return asked;
  throw InputError(fmt::format("--policy{}: {}; {}", asked.empty() ? "" : " " + asked,
                               asked.empty() ? "one policy is improved at a time" : "no policy of that name",
                               nearest_or_all(asked, names)));
}

double alpha_of(const std::string& text) {
  if (text.empty()) return ImproveOptions{}.alpha;
  const Settings value = Settings::parse("alpha: " + text, "--alpha").at("alpha");
  const double out = value.number();
  if (out > 0 && out <= 1) return out;
  throw InputError(fmt::format("--alpha {}: must lie above 0 and at most at 1; nearest right answer: {}", text,
                               out > 0 ? "1" : "0.1"));
}

/// But for the lock of a session that was killed as it began.
bool holds_nothing(const fs::path& folder) {
  std::error_code error;
  for (const auto& one : fs::directory_iterator(folder, error)) {
    if (one.path().filename() != kLockFile) return false;
  }
  return true;
}

fs::path folder_of_session(const ImproveArguments& arguments, const Scenario& scenario) {
  fs::path out = arguments.output;
  if (arguments.output.empty()) out = fs::path(scenario.file).stem().string() + ".improve";
  const fs::path bare = out.has_filename() ? out : out.parent_path();  // "x/" is "x"
  std::error_code error;
  const bool there = fs::exists(fs::symlink_status(bare, error));
  if (there && !fs::is_directory(bare, error)) {
    throw InputError(fmt::format("{}: is there already, and no folder; choose another --output", bare.string()));
  }
  if (there) remove_abandoned(Directory(bare), kImproveFile);  // of a session that was killed as it began
  if (there && !holds_nothing(bare) && !fs::exists(bare / kImproveFile, error)) {
    throw InputError(
        fmt::format("{}: is there already, and no session of graze improve; choose another --output", bare.string()));
  }
  return bare;
}

void write_text(const fs::path& file, const std::string& text) {
  NewFile out(file, true);
  const int error = write_all(out.descriptor(), std::as_bytes(std::span(text)));
  if (error != 0) fail_writing(file, error);
  out.publish();
}

void write_robot(const fs::path& folder, const DesignRobots& robots, const ImproveState& state) {
  const auto [level, design] = best_design(state);
  const std::string urdf = robots.urdf(level, design);
  if (!urdf.empty()) write_text(folder / kImprovedRobot, urdf);
  write_text(folder / kImprovedScenario, robots.yaml(level, design, urdf.empty() ? "" : kImprovedRobot));
  write_text(folder / kBeforeScenario, robots.before(level));
}

/// The answers as a file that repeats the session; what they are is in its history.
void write_answers(const fs::path& folder, const ImproveState& state) {
  std::string text;
  for (const SessionAnswer& one : state.answers) text += one.text + "\n";
  std::error_code error;
  if (!text.empty()) write_text(folder / kAnswersFile, text);
  if (text.empty()) fs::remove(folder / kAnswersFile, error);
}

/// Asks about each step until the rest may go by itself. False: it may not.
bool ask_about_steps(const ImproveArguments& arguments, Improvement& session, const Scenario& scenario,
                     const fs::path& folder, std::ostream& out, const std::function<void()>& keep) {
  AnswerSource answers(arguments.answers, arguments.ask);
  DialogueRequest request;
  request.answers = &answers;
  request.out = &out;
  request.keep = keep;
  request.most_steps = arguments.most_steps;
  const ImproveState& state = session.state();
  if (!arguments.answers.empty() && !state.steps.empty() && state.answers.empty()) {
    throw InputError(fmt::format(
        "--answers: {} is a session that was not told anything; the command without --answers goes on with it; choose "
        "another --output, or --force to begin anew",
        folder.string()));
  }
  const std::optional<std::size_t> rest = answers.skip(state.answers, state.steps.size());
  const bool alone = !state.answers.empty() && state.answers.back().text == kAuto && !rest;
  DialogueEnd end = DialogueEnd::go_on;
  if (!alone || arguments.ask) {
    if (rest.value_or(0) > 0) go_on_alone(session, *rest, request);
    session.stop_going_alone();
    end = supervise(session, scenario, request);
  }
  if (answers.left() > 0 && end != DialogueEnd::quit && state.steps.size() < arguments.most_steps) {
    spdlog::warn("--answers {}: {} of its lines were not asked for any more", arguments.answers, answers.left());
  }
  return end == DialogueEnd::go_on;
}

/// A history that is damaged is of no use any more.
std::optional<ImproveState> read_or_advise(const fs::path& folder, const Scenario& scenario,
                                           const ImproveQuestion& question) {
  try {
    return read_improvement(folder, scenario, question);
  } catch (const InputError& error) {
    const std::string why = error.what();
    throw InputError(why.find("--force") == std::string::npos ? why + "; --force begins anew" : why);
  }
}

/// Steps until there is none left, or enough; each is on disk before the next begins.
ImproveState improve_robot(const ImproveArguments& arguments, const DesignRobots& robots,
                           const ImproveQuestion& question, const fs::path& folder) {
  const Scenario& scenario = robots.scenario();
  std::optional<ImproveState> begun;
  if (!arguments.force) begun = read_or_advise(folder, scenario, question);
  std::ostream& out = arguments.json ? std::cerr : std::cout;
  if (begun) out << fmt::format("{}: goes on after {} steps\n", folder.string(), begun->steps.size());
  Improvement session(robots, question.options, std::move(begun));
  std::size_t steps = session.state().steps.size(), reached = session.state().reached.size();
  const auto keep = [&] {
    const ImproveState& state = session.state();
    write_improvement(folder, scenario, question, state);
    write_answers(folder, state);
    if (state.steps.size() > steps) out << step_text(scenario, state, steps) << std::flush;
    if (state.reached.size() > reached) out << reached_text(scenario, state.reached.back()) << std::flush;
    steps = state.steps.size(), reached = state.reached.size();
  };
  const bool asks = arguments.ask || !arguments.answers.empty();
  bool more = !asks || ask_about_steps(arguments, session, scenario, folder, out, keep);
  if (more) session.go_alone();
  while (more && session.state().steps.size() < arguments.most_steps) {
    more = session.advance();
    keep();
  }
  keep();  // a session without steps is one, too
  return session.state();
}

/// Pictures and pages of a session, by the names that its folder keeps: the same command makes them anew.
class SessionOutputs {
 public:
  explicit SessionOutputs(const fs::path& folder) : list_(folder / ".outputs") {
    std::ifstream in(list_);
    for (std::string line; std::getline(in, line);) own_.insert(line);
  }
  /// Whether a file may be replaced.
  bool owns(const std::string& file) const { return own_.contains(fs::absolute(file).string()); }
  void add(const std::string& file) {
    if (!own_.insert(fs::absolute(file).string()).second) return;
    std::string text;
    for (const std::string& one : own_) text += one + "\n";
    write_text(list_, text);
  }

 private:
  fs::path list_;
  std::set<std::string> own_;
};

/// The picture and the page, if they are asked for.
void show_session(const ImproveArguments& arguments, const Redesign& redesign, SessionOutputs& outputs) {
  if (!arguments.plot.empty()) {
    const bool force = arguments.force || outputs.owns(arguments.plot);
    const PlotStyle style = picture_style(arguments.plot, force);
    const ParentFolders picture_folders(arguments.plot);
    const Figure figure = improve_figure(redesign.scenario, redesign.state);
    write_picture(arguments.plot, force, drawn_figure(figure, style, arguments.plot), false);
    outputs.add(arguments.plot);
  }
  if (arguments.report.empty()) return;
  const ParentFolders page_folders(arguments.report);
  write_page(arguments.report, arguments.force || outputs.owns(arguments.report),
             script_json(redesign_page(redesign, NumberForm::packed)));
  outputs.add(arguments.report);
}

// ---- the verb

/// A number that each particle draws for itself makes no task harder for them.
void doubt_task(const Scenario& scenario, bool particles) {
  const std::string& path = scenario.redesign->task_path;
  const auto& all = scenario.space.parameters;
  if (std::none_of(all.begin(), all.end(), [&](const auto& one) { return one.name == path; })) return;
  if (!particles) {
    spdlog::warn("{}: design.task.path: {}: is uncertain, so that the nominal robot alone heeds the task",
                 scenario.file, path);
    return;
  }
  throw InputError(fmt::format(
      "{}: design.task.path: {}: is uncertain, so that each particle draws its own value, whatever the task is; make "
      "the task of uncertain.{} instead, or take it out of 'uncertain'",
      scenario.file, path, path));
}

/// The same of a variable.
void doubt_variables(const DesignRobots& robots, bool particles) {
  for (const std::string& one : robots.overdrawn()) {
    const std::string text = fmt::format(
        "{}: design.variables.{} in 'uncertain' whatever the design's number is, so that particles do not heed "
        "it; let it be uncertain about the nominal one, as by {{normal: {{std: 10 %}}}}",
        robots.scenario().file, one);
    if (particles) throw InputError(text);
    spdlog::warn("{}", text);
  }
}

/// What is doubtful at single tasks.
void tell_warnings(const DesignRobots& robots) {
  ValueWarnings warnings(robots.scenario().warnings);
  const DesignBlock& block = robots.block();
  for (std::size_t level = 0; level < block.task_values.size(); ++level) {
    warnings.tell(robots.warnings(level), fmt::format("{}={}", block.task_path, block.task_values[level]));
  }
  warnings.end();
}

void check_asked(const ImproveArguments& arguments, const Scenario& scenario) {
  if (!scenario.redesign_problem.empty()) throw InputError(scenario.redesign_problem);
  if (!scenario.redesign) {
    throw InputError(
        fmt::format("{}: has no 'design', which says what of the robot may be changed; e.g. design: "
                    "{{variables: {{shin: {{of: robot.link.*_SHIN.length, factor: [0.5, 2]}}}}}} (docs/improve.md)",
                    scenario.file));
  }
  if (scenario.source.file == kStandardInput) {
    throw InputError("improve: the scenario is read once for every design; give a file instead of -");
  }
  if (arguments.step != "plain" && !arguments.alpha.empty()) {
    throw InputError("--alpha: is of --step plain; a damped step has a radius that it finds itself");
  }
}

ImproveQuestion question_of(const ImproveArguments& arguments, const Scenario& scenario) {
  ImproveQuestion out;
  out.scenario = scenario.sha256;
  out.seed = arguments.seed.value_or(scenario.seed);
  out.options.policy = policy_to_improve(scenario, arguments.policy);
  out.options.damped = arguments.step == "damped";
  out.options.alpha = alpha_of(arguments.alpha);
  out.options.threads = arguments.threads > 0 ? arguments.threads : std::max(1u, std::thread::hardware_concurrency());
  for (std::uint32_t i = 0; i < arguments.particles; ++i) out.options.particles.push_back(i);
  out.drawn = std::max(scenario.particles, arguments.particles);
  if (!arguments.from.empty()) begin_at_failures(arguments.from, arguments.particles, scenario, out);
  return out;
}

int exit_code_of(const ImproveState& state) {
  return state.end == ImproveEnd::reached_all ? kDone : state.end == ImproveEnd::stuck ? kGateMissed : kInconclusive;
}

int improve(ImproveArguments arguments) {
  Scenario scenario = arguments.scenario.load();
  check_asked(arguments, scenario);
  ImproveQuestion question = question_of(arguments, scenario);
  scenario.seed = question.seed;
  scenario.particles = question.drawn;
  const fs::path folder = folder_of_session(arguments, scenario);
  SessionOutputs outputs(folder);
  if (!arguments.plot.empty()) {
    picture_style(arguments.plot, arguments.force || outputs.owns(arguments.plot));  // refuses what cannot be
  }
  if (!arguments.report.empty()) {
    check_page_built("improve --report");
    check_page_output(arguments.report, arguments.force || outputs.owns(arguments.report), arguments.scenario.file,
                      NamedBy::word);
  }
  if (arguments.verdict == 0 && !question.options.particles.empty()) {
    arguments.verdict = std::max<std::uint64_t>(200, question.options.particles.size());
  }
  doubt_task(scenario, !question.options.particles.empty() || arguments.verdict > 0);
  const DesignRobots robots(scenario);
  question.files = robots.files_sha256();
  tell_warnings(robots);
  doubt_variables(robots, !question.options.particles.empty());
  const ParentFolders parents(folder / kImproveFile);
  const DirectoryLock lock{Directory(folder)};  // to the end: the verdict's campaigns and the page are of one session
  std::optional<EndHangingControllers> watch(std::in_place);
  const ImproveState state = improve_robot(arguments, robots, question, folder);
  write_robot(folder, robots, state);
  DesignPair traces = trace_pair(folder, question);
  write_history(folder, scenario, state, traces);
  std::ostream& out = arguments.json ? std::cerr : std::cout;
  out << summary_text(scenario, state, best_design(state).second);
  watch.reset();  // campaigns give up the thread
  if (arguments.verdict > 0)
    simulate_verdict(folder, {question, arguments.verdict, arguments.threads, arguments.force});
  Redesign redesign{scenario,
                    question,
                    state,
                    best_design(state).first,
                    best_design(state).second,
                    std::move(traces),
                    arguments.verdict > 0 ? session_verdict(folder) : kept_verdict(folder)};
  if (arguments.verdict > 0) out << verdict_text(*redesign.verdict, arguments.verdict, folder);
  out << fmt::format("{0}/{1}: the improved robot, ready to run; {0}/{2}: the first one in the same task\n",
                     folder.string(), kImprovedScenario, kBeforeScenario);
  if (arguments.json) std::cout << improvement_json(scenario, question, state);
  show_session(arguments, redesign, outputs);
  return exit_code_of(state);
}

void add_loop_options(CLI::App& verb, ImproveArguments& arguments) {
  add_choice(
      verb, "--step", arguments.step, {"plain", "damped"},
      "plain: a part of -J+ l of the violated limits (the dissertation's); damped: a regularised step in a trust "
      "region, which heeds all limits")
      ->default_str("plain");
  verb.add_option("--alpha", arguments.alpha, "Part of a plain step that is made at first")
      ->type_name("0..1")
      ->default_str("0.5");
  CLI::Option* most =
      add_whole(verb, "--max-steps", arguments.most_steps, 0, 1'000'000, "Most steps in all")->default_str("100");
  verb.add_flag("--auto", arguments.automatic, "As long as steps help, up to --max-steps: what it does anyway")
      ->excludes(most);
  verb.add_flag(
          "--ask", arguments.ask,
          "Show each step before it is made, and take answers: accept, scale, zero, only, same, set, reset, back, "
          "auto, quit ('help' tells them); they are kept in DIR/answers.txt")
      ->excludes("--auto");
  verb.add_option("--answers", arguments.answers, "Answers from a file, as --ask keeps them: a session again")
      ->type_name("FILE")
      ->excludes("--auto");
  add_whole(verb, "-n,--particles", arguments.particles, 1, 100'000,
            "Improve a quantile of the margins of so many particles (default: the nominal robot's margins)");
  add_whole(verb, "--verdict", arguments.verdict, 1, kParticleLimit,
            "Simulate so many other particles of both robots at the end, and compare them (default: 200 with "
            "--particles, else none)");
  CLI::Option* seed = add_whole(verb, "--seed", arguments.seed, 0, std::numeric_limits<std::uint64_t>::max(),
                                "Root seed (default: the scenario's)");
  verb.add_option("--from", arguments.from, "Improve on particles of a campaign that failed, by what failed most")
      ->type_name("ARCHIVE")
      ->excludes(seed);
}

}  // namespace

void add_improve(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ImproveArguments>();
  CLI::App* verb = add_verb(app, "improve", "Changes a robot's design until its limits hold in ever harder tasks",
                            "  graze improve quadruped_design\n"
                            "  graze improve my.yaml --step damped -n 32 -o better\n"
                            "  graze improve my.yaml --from first.h5\n\n"
                            "The scenario's 'design' says what may be changed and which witnesses are limits "
                            "(docs/improve.md). Each step is\n"
                            "printed and kept; a session that was interrupted goes on by the same command. Exit code "
                            "0: every limit holds in\n"
                            "every task, 1: no step helps any more, 4: --max-steps ended it.\n");
  arguments->scenario.add_to(*verb);
  verb->add_option("--policy", arguments->policy, "Which policy's robot is improved, if there are several")
      ->type_name("NAME");
  add_loop_options(*verb, *arguments);
  add_threads(*verb, arguments->threads);
  verb->add_option("-o,--output", arguments->output, "Folder of the session (default: SCENARIO.improve)")
      ->type_name("DIR");
  verb->add_option("--plot", arguments->plot, "Draw the session, too: a file ending in .svg or .png")
      ->type_name("FILE");
  verb->add_option("--report", arguments->report,
                   "Make a page of the session for a browser, too: a file ending in .html ('graze report DIR' makes it "
                   "later)")
      ->type_name("FILE");
  verb->add_flag("--force", arguments->force,
                 "Begin anew what stands in the folder, and write over the picture and the page");
  verb->add_flag("--json", arguments->json, "Print the history as JSON, and the rest on stderr");
  verb->callback([arguments, &action] { action = [arguments] { return improve(*arguments); }; });
}

}  // namespace graze
