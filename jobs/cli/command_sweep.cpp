// graze sweep: success against a value of the scenario, on the same particles.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

#include "analysis/sequential.h"
#include "archive/directory/campaign_directory.h"
#include "archive/files/files.h"
#include "archive/files/new_folder.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "archive/schema/info.h"
#include "jobs/campaign/describe_campaign.h"
#include "jobs/campaign/sweep_axis.h"
#include "jobs/campaign/sweep_directory.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/override_doubts.h"
#include "jobs/cli/picture_file.h"
#include "jobs/cli/resume_campaign.h"
#include "jobs/cli/shared_options.h"
#include "jobs/cli/size_estimate.h"
#include "jobs/cli/terminal.h"
#include "jobs/cli/value_warnings.h"
#include "jobs/workers/controllers.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostAdaptive = 4096;  // particles at a value, unless -n says

struct SweepArguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  std::vector<std::string> over, policies;
  int threads = 0;
  double watchdog = 0;  // s
  bool adaptive = false;
  std::string width, level, output, plot, plot_times;
  bool force = false, ignore_space = false, json = false, csv = false, quiet = false;
};

/// A folder behind `graze sweep`, with the trust that this command has.
std::string folder_words(const fs::path& folder) {
  return shell_path(folder.string()) + (controllers_trusted() ? " --trust" : "");
}

/// "contact.friction=0.4"; with a second axis ", time.end=2 s" behind it.
std::string values_text(const Sweep& sweep, const SweepPoint& point) {
  std::string out;
  for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
    out += fmt::format("{}{}={}", axis > 0 ? ", " : "", sweep.axes[axis].path, sweep.axes[axis].texts[point.at[axis]]);
  }
  return out;
}

/// The path's last key where the scenario has a similar one in its place: "environment.curb" for "environment.crub".
std::string similar_path(const Scenario& base, const std::string& path) {
  Settings here = Settings::parse(base.text, base.file);
  std::string good;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const std::string key = path.substr(begin, end - begin);
    if (!here.is_map()) return "";
    if (!here.has(key)) {
      std::vector<std::string> keys;
      for (const auto& [name, value] : here.entries()) keys.push_back(name);
      const std::string near = nearest(key, keys);
      return near.empty() ? "" : good + near + path.substr(end);
    }
    here = here.at(key);
    good += key + ".";
    begin = end + 1;
  }
  return "";
}

/// What is wrong with a value, told of --over.
[[noreturn]] void refuse_value(const Scenario& base, const Sweep& sweep, const InputError& error) {
  std::string text = error.what();
  for (const SweepAxis& axis : sweep.axes) {
    const std::string set = "--set " + axis.path;
    if (!text.starts_with(set)) continue;
    text.replace(0, std::string("--set").size(), "--over");
    const std::string near = similar_path(base, axis.path);
    if (!near.empty() && text.find("did you mean") == std::string::npos) {
      text += fmt::format("; did you mean --over {}=…?", near);
    }
    break;
  }
  throw InputError(text);
}

Scenario load_at(const SweepArguments& arguments, const Scenario& base, const Sweep& sweep, const SweepPoint& point) {
  ScenarioOptions options;
  options.ignore_missing_meshes = arguments.scenario.ignore_missing_meshes;
  options.overrides = arguments.scenario.overrides();
  for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
    options.overrides.push_back({sweep.axes[axis].path, sweep.axes[axis].texts[point.at[axis]]});
  }
  try {
    Scenario out = load_scenario(base.file, options);
    arguments.draw.apply_to(out);
    choose_policies(out, arguments.policies);
    return out;
  } catch (const InputError& error) {
    refuse_value(base, sweep, error);
  }
}

std::vector<std::string> names_of(const Scenario& scenario) {
  std::vector<std::string> out;
  for (const PolicySpec& policy : scenario.policies) out.push_back(policy.name);
  return out;
}

/// Designs that share out numbers by the place of a parameter draw others if there are more of them.
void check_common(const Scenario& first, const Scenario& other, const std::string& at) {
  if (names_of(first) != names_of(other)) {
    throw InputError(fmt::format("{}: has other policies than the first value; a sweep compares the same ones", at));
  }
  const auto same = [](const UncertainParameter& a, const UncertainParameter& b) { return a.name == b.name; };
  const auto &a = first.space.parameters, &b = other.space.parameters;
  if (first.design == Design::random || std::equal(a.begin(), a.end(), b.begin(), b.end(), same)) return;
  spdlog::warn(
      "{}: other parameters are uncertain than at the first value, so that particles are not the same ones; "
      "--set sampling.design=random keeps those that both have",
      at);
}

/// A number of the world that every particle draws for itself is only the middle of what is drawn, if it is even that.
void doubt_uncertain(const Sweep& sweep, const Scenario& scenario) {
  for (const SweepAxis& axis : sweep.axes) {
    const auto& all = scenario.space.parameters;
    if (std::none_of(all.begin(), all.end(), [&](const auto& one) { return one.name == axis.path; })) continue;
    spdlog::warn(
        "--over {0}: is uncertain, so that each particle draws its own value, whatever the nominal one is; did "
        "you mean --over uncertain.{0}=…, which gives all particles the value?",
        axis.path);
  }
}

SweepPlan plan_of(const SweepArguments& arguments, const Scenario& base) {
  SweepPlan out;
  Sweep& sweep = out.sweep;
  sweep.scenario = base.name;
  sweep.policies = names_of(base);
  for (const std::string& text : arguments.over) sweep.axes.push_back(parse_sweep_axis(text));
  if (sweep.axes.empty()) throw InputError("sweep: no --over; e.g. --over uncertain.contact.friction=0.2:1:0.1");
  if (sweep.axes.size() > 2) throw InputError(fmt::format("sweep: {} times --over; two at most", sweep.axes.size()));
  if (sweep.axes.size() == 2 && sweep.axes[0].path == sweep.axes[1].path) {
    throw InputError(fmt::format("--over {}: is given twice; one list has all values", sweep.axes[0].path));
  }
  for (std::size_t i = 0; sweep.axes.size() == 2 && i < 2; ++i) {
    const std::string &whole = sweep.axes[i].path, &part = sweep.axes[1 - i].path;
    if (!part.starts_with(whole + ".")) continue;
    throw InputError(fmt::format(
        "--over {}: lies within --over {}, which would replace it; sweep values beside each other", part, whole));
  }
  number_points(sweep);
  out.particles = base.particles;
  sweep.adaptive = arguments.adaptive;
  for (const auto& [option, text] : {std::pair("--width", arguments.width), {"--level", arguments.level}}) {
    if (!text.empty() && !arguments.adaptive) throw InputError(fmt::format("{}: is for --adaptive; give both", option));
  }
  if (!arguments.adaptive) return out;
  if (base.design == Design::latin_hypercube) {
    throw InputError(
        "--adaptive: the first particles of a Latin hypercube are none; use --set sampling.design=random (or sobol)");
  }
  if (!arguments.width.empty()) sweep.rule.width = parse_width(arguments.width, "--width");
  if (!arguments.level.empty()) sweep.rule.level = parse_fraction(arguments.level, "--level");
  if (arguments.draw.particles == 0) out.particles = kMostAdaptive;
  sweep.rule.least = std::min(sweep.rule.least, out.particles);
  return out;
}

std::uint64_t first_particles(const SweepPlan& plan) {
  return plan.sweep.adaptive ? plan.sweep.rule.least : plan.particles;
}

/// What the campaign of one value is described as. That of an adaptive sweep has a question, so that every reader takes
/// the confidence sequence that the sweep takes.
CampaignInfo describe_point(const SweepPlan& plan, const Scenario& scenario, const std::string& command_line) {
  const std::uint64_t particles = first_particles(plan);
  CampaignInfo info = describe_campaign(scenario, particles, command_line);
  if (plan.sweep.adaptive) {
    info.until.questions = {fmt::format("ci < {:g}", plan.sweep.rule.width)};
    info.until.most = info.until.least = particles;
  }
  check_policy_names(info.policies);
  return info;
}

void check_fits(const SweepArguments& arguments, const SweepPlan& plan, Scenario scenario, const fs::path& folder) {
  if (arguments.ignore_space) return;
  scenario.particles = first_particles(plan);
  SizeEstimate all = estimate_size(scenario);
  const auto values = static_cast<double>(plan.sweep.points.size());
  for (double* part : {&all.values, &all.traces, &all.events, &all.telemetry, &all.inputs}) *part *= values;
  check_space(all, folder, false);
}

fs::path folder_to_make(const SweepArguments& arguments, const Scenario& scenario) {
  fs::path out = arguments.output;
  if (arguments.output.empty()) out = fs::path(scenario.file).stem().string() + ".sweep";
  if (out.extension() != ".sweep") {
    const fs::path bare = out.has_filename() ? out : out.parent_path();  // "x/" is "x"
    throw InputError(fmt::format("--output {}: a sweep is a folder whose name ends in .sweep; nearest right answer: {}",
                                 arguments.output, fs::path(bare).replace_extension(".sweep").string()));
  }
  std::error_code error;
  if (is_sweep(out)) {
    throw InputError(fmt::format("{}: is there already; go on with it by 'graze sweep {}', or choose another --output",
                                 out.string(), folder_words(out)));
  }
  if (fs::exists(fs::symlink_status(out, error)) && !fs::is_empty(out, error)) {
    throw InputError(
        fmt::format("{}: is there already, and no sweep was begun in it; remove it, or choose another "
                    "--output",
                    out.string()));
  }
  return out;
}

/// All campaigns and the plan, or nothing: they are written beside, and take their name when they are whole.
void write_sweep(const fs::path& folder, const SweepPlan& plan, const std::vector<CampaignInfo>& campaigns,
                 const std::string& command_line) {
  const ParentFolders folders(folder);
  NewFolder beside(folder);
  for (std::size_t i = 0; i < campaigns.size(); ++i) {
    CampaignWriter(beside.path() / plan.sweep.points[i].campaign, campaigns[i], false).keep();
  }
  write_plan(beside.path(), plan, campaigns, command_line);
  const std::error_code error = beside.publish();
  if (error == std::errc::directory_not_empty || error == std::errc::file_exists) {
    throw InputError(fmt::format("{}: somebody else has just begun it; go on with it by 'graze sweep {}'",
                                 folder.string(), folder_words(folder)));
  }
  if (error) fail_writing(folder, error.value());
}

/// Throws InputError if there are no times to draw.
void check_times(const SweepArguments& arguments, const Scenario& base) {
  if (arguments.plot_times.empty()) return;
  if (arguments.adaptive) {
    throw InputError(
        "--plot-times: an adaptive sweep looks at its outcomes again and again, for which intervals of times are too "
        "narrow; leave out one of both");
  }
  const auto decides = [](const Requirement& one) { return !one.measure; };
  if (std::any_of(base.task.requirements.begin(), base.task.requirements.end(), decides)) return;
  throw InputError(fmt::format(
      "--plot-times: {}: its task has no requirements, so that nothing is violated at any time", base.file));
}

/// Reads the scenario at every value, so that all that can be refused is refused now, and describes every campaign.
fs::path begin(const SweepArguments& arguments, const std::string& command_line) {
  if (arguments.scenario.file == kStandardInput) {
    throw InputError("sweep: a sweep reads its scenario once for every value; give a file instead of -");
  }
  Scenario base = arguments.scenario.load();
  arguments.draw.apply_to(base);
  choose_policies(base, arguments.policies);
  check_times(arguments, base);
  const SweepPlan plan = plan_of(arguments, base);
  const fs::path folder = folder_to_make(arguments, base);
  std::vector<CampaignInfo> campaigns;
  std::optional<Scenario> first;
  ValueWarnings warnings(base.warnings);
  for (const SweepPoint& point : plan.sweep.points) {
    const Scenario scenario = load_at(arguments, base, plan.sweep, point);
    if (!first) first = scenario;
    const std::string at = values_text(plan.sweep, point);
    check_common(*first, scenario, at);
    warnings.tell(scenario.warnings, at);
    campaigns.push_back(describe_point(plan, scenario, command_line));
  }
  warnings.end();
  try_controllers(*first);
  doubt_uncertain(plan.sweep, *first);
  std::vector<std::string> paths;
  for (const SweepAxis& axis : plan.sweep.axes) paths.push_back(axis.path);
  doubt_settings("--over", paths, *first);
  check_fits(arguments, plan, *first, folder);
  write_sweep(folder, plan, campaigns, command_line);
  return folder;
}

/// A sweep in its folder, and the campaigns in it.
class SweepRun {
 public:
  SweepRun(const SweepArguments& arguments, fs::path folder)
      : arguments_(arguments), folder_(std::move(folder)), plan_(read_plan(folder_)) {}

  bool adaptive() const { return plan_.sweep.adaptive; }
  /// Values some of whose traces were left unfinished.
  std::size_t incomplete() const { return incomplete_; }
  /// Simulates what is missing; all outcomes are there then, but of traces that were left unfinished.
  const Sweep& run() {
    std::vector<std::uint64_t> particles(plan_.sweep.points.size(), first_particles(plan_));
    do {
      for (std::size_t i = 0; i < particles.size(); ++i) bring_to(i, particles[i]);
    } while (plan_.sweep.adaptive && next_turn(plan_.sweep, plan_.particles, particles));
    for (std::size_t i = 0; i < particles.size(); ++i) plan_.sweep.points[i].particles = particles[i];
    return plan_.sweep;
  }

 private:
  /// Has so many particles simulated at a point, unless they are, and reads their outcomes.
  void bring_to(std::size_t i, std::uint64_t particles) {
    SweepPoint& point = plan_.sweep.points[i];
    if (point.particles >= particles) return;  // read already
    const fs::path campaign = folder_ / point.campaign;
    try {
      if (has_particles(campaign, particles)) return read_traces(folder_, plan_.sweep, point);
    } catch (const InputError&) {
      point.particles = 0;  // what does not read is mended below, or refused with its reason
    }
    simulate(campaign, point, particles);
    read_traces(folder_, plan_.sweep, point);
  }

  void simulate(const fs::path& campaign, const SweepPoint& point, std::uint64_t particles) {
    const std::string title = fmt::format("{}: {} particles", values_text(plan_.sweep, point), particles);
    log_beneath(arguments_.quiet ? title : "");  // faults are told beside their value
    if (!arguments_.quiet) spdlog::info("{}", title);
    ResumeArguments resume;
    resume.directory = campaign.string();
    const std::uint64_t described = described_particles(campaign);
    resume.particles = 0 < described && described < particles ? particles : 0;  // 0: a restart, as many as it had then
    resume.threads = arguments_.threads;
    resume.watchdog = arguments_.watchdog;
    resume.ignore_space = arguments_.ignore_space;
    resume.quiet = arguments_.quiet;
    resume.table = false;
    resume.all = true;
    const auto comm = make_local_communicator();
    Start start(*comm);
    try {
      resume_campaign(resume, start);
    } catch (const MachineError& error) {
      const std::string text =
          fmt::format("{}; 'graze sweep {}' goes on with the whole sweep", error.what(), folder_words(folder_));
      // What is simulated next in an adaptive sweep depends on all outcomes.
      if (plan_.sweep.adaptive || !lacks_unfinished_only(campaign)) throw MachineError(text);
      spdlog::error("{}", text);
      ++incomplete_;
    }
    log_beneath("");
  }

  const SweepArguments& arguments_;
  const fs::path folder_;
  SweepPlan plan_;
  std::size_t incomplete_ = 0;
};

/// Options that say what is swept; a folder says it itself.
void check_is_taken_up(const SweepArguments& arguments) {
  const auto refuse = [&](bool given, const char* option) {
    if (!given) return;
    throw InputError(fmt::format("{}: {} says itself what is swept; leave {} out, or give a scenario", option,
                                 arguments.scenario.file, option));
  };
  refuse(!arguments.over.empty(), "--over");
  refuse(arguments.draw.particles > 0, "-n");
  refuse(arguments.draw.seed.has_value(), "--seed");
  refuse(!arguments.policies.empty(), "--policy");
  refuse(!arguments.scenario.set.empty(), "--set");
  refuse(arguments.adaptive, "--adaptive");
  refuse(!arguments.width.empty(), "--width");
  refuse(!arguments.level.empty(), "--level");
  refuse(!arguments.output.empty(), "--output");
}

/// A picture that a sweep is asked for, and what it shows.
struct SweepPicture {
  std::string file;
  Figure (*figure)(const Sweep&);
};

std::vector<SweepPicture> pictures_of(const SweepArguments& arguments) {
  std::vector<SweepPicture> out;
  if (!arguments.plot.empty()) out.push_back({arguments.plot, sweep_figure});
  if (!arguments.plot_times.empty()) out.push_back({arguments.plot_times, sweep_times_figure});
  for (const SweepPicture& picture : out) picture_style(picture.file, arguments.force);  // refuses what cannot be
  if (out.size() > 1 && fs::path(out[0].file).lexically_normal() == fs::path(out[1].file).lexically_normal()) {
    throw InputError(fmt::format("--plot-times {}: is the file of --plot, too; give it another name", out[1].file));
  }
  return out;
}

void check_alone() {
  if (make_communicator()->size() > 1) {
    throw InputError("sweep: is one process; run it without mpirun, or each value as a campaign of its own");
  }
}

int sweep(const SweepArguments& arguments, const std::string& command_line) {
  check_alone();
  const std::vector<SweepPicture> wanted = pictures_of(arguments);
  std::error_code error;
  const bool there = fs::is_directory(arguments.scenario.file, error);
  if (there) check_is_taken_up(arguments);
  if (there && !is_sweep(arguments.scenario.file)) {
    throw InputError(fmt::format("{}: holds no sweep: it has no {}", arguments.scenario.file, kSweepFile));
  }
  const fs::path folder = there ? fs::path(arguments.scenario.file) : begin(arguments, command_line);
  SweepRun run(arguments, folder);
  if (run.adaptive() && !arguments.plot_times.empty()) {
    throw InputError(
        "--plot-times: an adaptive sweep looks at its outcomes again and again, for which intervals of times are too "
        "narrow; leave it out, or sweep without --adaptive");
  }
  const Sweep& result = run.run();
  std::cout << (arguments.json  ? sweep_json(result)
                : arguments.csv ? sweep_csv(result)
                                : format_sweep(result))
            << std::flush;
  for (const SweepPicture& picture : wanted) {
    const PlotStyle style = picture_style(picture.file, arguments.force);
    const ParentFolders folders(picture.file);
    write_picture(picture.file, arguments.force, drawn_figure(picture.figure(result), style, picture.file), false);
  }
  if (!arguments.quiet) spdlog::info("sweep: {}", folder.string());
  if (run.incomplete() == 0) return kDone;
  spdlog::error(
      "sweep: {} of {} values lack traces that were left unfinished (above); 'graze sweep {}' tries them again",
      run.incomplete(), result.points.size(), folder_words(folder));
  return kMachineFailed;
}

}  // namespace

void add_sweep(CLI::App& app, Action& action, const std::string& command_line) {
  auto arguments = std::make_shared<SweepArguments>();
  SweepArguments& a = *arguments;
  CLI::App* verb = add_verb(
      app, "sweep", "Success against a value of the scenario, on the same particles, with intervals",
      "  graze sweep quadruped_curb --policy step/3cm --over environment.curb.friction=0.2:1:0.2 -n 100\n"
      "  graze sweep my.yaml --over policies.walk.gait.step_height='1:4:0.5 cm' --adaptive --plot height.svg\n"
      "  graze sweep my.yaml --over uncertain.contact.friction=0.4,0.6,1 --over 'time.control=1 ms,5 ms' -o "
      "both.sweep\n"
      "  graze sweep both.sweep                        # goes on after a kill; shows it again once it is whole\n"
      "  graze score both.sweep/003.graze              # each value is a campaign, for all verbs\n\n"
      "A range is FIRST:LAST:STEP; the last value counts if a step hits it. Values have units as scenarios write them; "
      "a unit\nbehind the last number of a range alone is that of all three. --adaptive begins with 64 particles at "
      "each "
      "value and doubles\nthem where the curve is steep or undecided.\n");
  a.scenario.add_to(*verb);
  verb->add_option("--over", a.over, "What is swept: a value by its path as for --set, and its values (once or twice)")
      ->type_name("PATH=VALUES")
      ->allow_extra_args(false);
  a.draw.add_to(*verb);
  add_policies(*verb, a.policies);
  verb->add_flag("--adaptive", a.adaptive,
                 "More particles where it matters; -n is then the most at a value (default 4096)");
  verb->add_option("--width", a.width, "With --adaptive: an interval that is narrow enough (default: 10%)")
      ->type_name("FRACTION");
  verb->add_option("--level", a.level, "With --adaptive: a rate that intervals shall not hold (default: 50%)")
      ->type_name("FRACTION");
  verb->add_option("-o,--output", a.output, "Folder, ending in .sweep (default: SCENARIO.sweep)");
  verb->add_option("--plot", a.plot, "Draw it, too: a file ending in .svg or .png")->type_name("FILE");
  verb->add_option("--plot-times", a.plot_times, "Draw the mean time until a requirement was violated, too")
      ->type_name("FILE");
  verb->add_flag("--force", a.force, "Replace an existing picture");
  add_threads(*verb, a.threads);
  add_watchdog(*verb, a.watchdog);
  verb->add_flag("--ignore-space", a.ignore_space, "Start even if the archives will not fit on the disk");
  CLI::Option* json = verb->add_flag("--json", a.json, "Print as JSON");
  verb->add_flag("--csv", a.csv, "Print as CSV")->excludes(json);
  verb->add_flag("--quiet", a.quiet, "No progress");
  verb->callback([arguments, command_line, &action] {
    action = [arguments, command_line] { return sweep(*arguments, command_line); };
  });
}

}  // namespace graze
