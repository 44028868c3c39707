// graze steps: how large a physics step a scenario bears, what it costs and how wrong it is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/text_table.h"
#include "archive/files/csv.h"
#include "engine/settings/units.h"
#include "jobs/campaign/hanging_controllers.h"
#include "jobs/campaign/step_study.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/shared_options.h"
#include "simulation/trace.h"

namespace graze {
namespace {

constexpr double kLeastStep = 1e-7, kMostStep = 1;  // s
constexpr double kLongStep = 0.1;                   // s; without a unit, ms were meant
constexpr double kMostSteps = 1e9;                  // of all runs together, about an hour
constexpr double kMostStudyBytes = 2e9;             // of what runs are compared by
constexpr const char* kUsualSteps = "0.1ms,0.2ms,0.5ms,1ms,2ms,5ms,10ms";

struct StepsArguments {
  ScenarioArguments scenario;
  std::vector<std::string> policies;
  std::string steps, reference, link;  // empty: the usual steps
  std::uint32_t particles = 8;
  std::optional<std::uint64_t> seed;
  bool control_each_step = false, json = false, csv = false;
};

struct PolicyStudy {
  std::string policy;
  StepStudy study;
};

double read_step(const std::string& text, const std::string& option) {
  const auto written = split_number(text);
  const auto value = written ? to_si(Quantity::time, written->value, written->unit) : std::nullopt;
  if (value && *value <= 0) {
    throw InputError(
        fmt::format("{} {}: a step is longer than 0; nearest right answer: {} {:g}", option, text, option, kLeastStep));
  }
  if (value && *value >= kLongStep && written->unit.empty()) {
    throw InputError(fmt::format("{0} {1}: is {2:g} s, longer than any step of physics; did you mean {0} {2:g}ms?",
                                 option, text, *value));
  }
  return parse_seconds(text, option, kLeastStep, kMostStep);
}

/// The steps that were asked for and the scenario's own, ascending, each once.
std::vector<double> read_steps(const std::string& asked, const Timing& own) {
  const std::string text = asked.empty() ? kUsualSteps : asked;
  std::vector<double> out = {own.step};
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    begin = end + 1;
    if (word.empty()) {
      throw InputError(
          fmt::format("--steps {}: nothing stands before, behind or between two commas; a step must", text));
    }
    const double step = read_step(word, "--steps");
    if (step <= own.end) {
      out.push_back(step);
    } else if (!asked.empty()) {
      throw InputError(
          fmt::format("--steps {}: longer than a trace, which ends at {:g} s (time.end); nearest right answer: "
                      "--steps {:g}",
                      word, own.end, own.end));
    }
  }
  std::sort(out.begin(), out.end());
  const auto same = [](double a, double b) { return std::abs(a - b) < 1e-9 * b; };
  out.erase(std::unique(out.begin(), out.end(), same), out.end());
  return out;
}

double read_reference(const std::string& text, double smallest) {
  if (text.empty()) return smallest / 2;
  const double out = read_step(text, "--reference");
  if (out <= smallest * (1 + 1e-9)) return out;
  throw InputError(
      fmt::format("--reference {}: is longer than the smallest step, {:g} ms, which it is to judge; nearest right "
                  "answer: --reference {:g}ms",
                  text, 1e3 * smallest, 1e3 * smallest / 2));
}

void check_effort(const StepsArguments& arguments, const Scenario& scenario, const std::vector<double>& steps,
                  double reference, std::size_t policies) {
  double all = scenario.timing.end / reference;
  for (const double step : steps) all += scenario.timing.end / step;
  all *= 2.0 * arguments.particles * static_cast<double>(policies);
  const double bytes = arguments.particles * study_bytes(scenario, steps);
  if (bytes > kMostStudyBytes) {
    throw InputError(
        fmt::format("steps: {:.2g} bytes for what the runs are compared by; at most {:.2g}: fewer particles (-n) or "
                    "--steps",
                    bytes, kMostStudyBytes));
  }
  if (all <= kMostSteps) return;
  throw InputError(
      fmt::format("steps: {:.2g} physics steps of a particle; at most {:.2g}: fewer particles (-n), policies "
                  "(--policy), a shorter trace (--set time.end='1 s') or larger steps",
                  all, kMostSteps));
}

/// Where the error of a robot is looked at: its base, or the end of the arm.
std::string default_link(const Scenario& scenario) {
  const std::vector<Link>& links = scenario.world->robot.links;
  if (scenario.model.floating_base) return links.front().name;
  const auto moves = [&](const Link& link) {
    const int frame = scenario.model.frame(link.name);
    return frame >= 0 && scenario.model.frames[frame].body >= 0;
  };
  const auto last = std::find_if(links.rbegin(), links.rend(), moves);
  return last == links.rend() ? links.back().name : last->name;
}

std::string milliseconds(double seconds) { return fmt::format("{:g}", 1e3 * seconds); }

std::string number(double x, double factor) { return std::isnan(x) ? "-" : fmt::format("{:.3g}", factor * x); }

std::string verdict(const StepRow& row) {
  std::string out;
  for (std::size_t i = 0; i < row.outcomes.size(); ++i) {
    if (row.outcomes[i] == 0) continue;
    out += (out.empty() ? "" : ", ") + fmt::format("{} {}", row.outcomes[i], outcome_name(static_cast<Outcome>(i)));
  }
  return out;
}

std::vector<std::string> cells(const StepRow& row, bool reference) {
  return {milliseconds(row.timing.step),
          milliseconds(row.timing.control),
          reference                ? "reference"
          : row.stable()           ? "stable"
          : row.same == row.traces ? "too short to compare"
                                   : fmt::format("{} differ", row.traces - row.same),
          verdict(row),
          reference ? "0" : number(row.joint_error, 1e3),
          reference ? "0" : number(row.link_error, 1e3),
          number(row.tracking, 1e3),
          number(row.cost, 1e3)};
}

/// Nothing is as it should be where the reference is not: the errors are of traces that end early.
std::string doubt(const StepRow& reference) {
  const int good = reference.outcomes[static_cast<std::size_t>(Outcome::success)];
  if (good == reference.traces) return "";
  return fmt::format("At the reference's {} ms {} of {} traces do not succeed: is that the robot, or the task?{}{}\n",
                     milliseconds(reference.timing.step), reference.traces - good, reference.traces,
                     reference.reason.empty() ? "" : " ", reference.reason);
}

/// What to take, in a sentence or two.
std::string recommendation(const StepStudy& study, double own) {
  const StepRow* largest = study.largest_stable();
  if (largest == nullptr) {
    return fmt::format(
        "No step is stable, not even {} ms: its traces do not end as at {} ms. Ask for smaller --steps.\n",
        milliseconds(study.rows.front().timing.step), milliseconds(study.reference.timing.step));
  }
  std::string out = fmt::format("Largest stable step: {} ms. ", milliseconds(largest->timing.step));
  for (const StepRow& row : study.rows) {
    if (std::abs(row.timing.step - own) > 1e-9 * own || &row == largest) continue;
    const double ratio = largest->link_error / row.link_error;
    out += fmt::format("Beside the scenario's {} ms it costs {:.2g} times as much{}.", milliseconds(own),
                       largest->cost / row.cost,
                       std::isfinite(ratio) ? fmt::format(", and its error is {:.2g} times as large", ratio) : "");
  }
  if (largest == &study.rows.back()) out += " Larger ones were not tried.";
  return out + "\n";
}

std::string text_of(const std::vector<PolicyStudy>& all, const std::string& link, double own) {
  std::string out;
  for (const PolicyStudy& one : all) {
    std::vector<std::vector<std::string>> table = {
        {"step ms", "control ms", "traces", "", "joints mrad", link + " mm", "tracking mrad", "cost ms/s"}};
    table.push_back(cells(one.study.reference, true));
    for (const StepRow& row : one.study.rows) table.push_back(cells(row, false));
    out += fmt::format("{}{}\n{}{}", out.empty() ? "" : "\n", one.policy, text_table(table, 4),
                       doubt(one.study.reference) + recommendation(one.study, own));
    for (const StepRow& row : one.study.rows) {
      if (row.reason.empty()) continue;
      out += fmt::format("{} ms: {}\n", milliseconds(row.timing.step), row.reason);
      break;
    }
  }
  return out;
}

std::string csv_of(const std::vector<PolicyStudy>& all) {
  std::string out = "policy,reference,step,control,traces,valid,same,joint_error,link_error,tracking,cost\n";
  for (const PolicyStudy& one : all) {
    const auto add = [&](const StepRow& row, bool reference) {
      out += fmt::format("{},{:d},{},{},{},{},{},{},{},{},{}\n", csv_cell(one.policy), reference, row.timing.step,
                         row.timing.control, row.traces, row.valid, row.same, csv_number(row.joint_error),
                         csv_number(row.link_error), csv_number(row.tracking), csv_number(row.cost));
    };
    add(one.study.reference, true);
    for (const StepRow& row : one.study.rows) add(row, false);
  }
  return out;
}

nlohmann::ordered_json json_of(const StepRow& row) {
  const auto known = [](double x) { return std::isnan(x) ? nlohmann::ordered_json() : nlohmann::ordered_json(x); };
  nlohmann::ordered_json outcomes;
  for (std::size_t i = 0; i < row.outcomes.size(); ++i) {
    outcomes[std::string(outcome_name(static_cast<Outcome>(i)))] = row.outcomes[i];
  }
  return {{"step", row.timing.step},
          {"control", row.timing.control},
          {"stable", row.stable()},
          {"traces", row.traces},
          {"same", row.same},
          {"outcomes", std::move(outcomes)},
          {"joint_error", known(row.joint_error)},
          {"link_error", known(row.link_error)},
          {"tracking", known(row.tracking)},
          {"cost", known(row.cost)},
          {"invalid_reason", row.reason}};
}

std::string json_of(const std::vector<PolicyStudy>& all, const std::string& link) {
  nlohmann::ordered_json out = {{"link", link}, {"policies", nlohmann::ordered_json::array()}};
  for (const PolicyStudy& one : all) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const StepRow& row : one.study.rows) rows.push_back(json_of(row));
    const StepRow* largest = one.study.largest_stable();
    out["policies"].push_back(
        {{"policy", one.policy},
         {"reference", json_of(one.study.reference)},
         {"rows", std::move(rows)},
         {"largest_stable_step", largest ? nlohmann::ordered_json(largest->timing.step) : nlohmann::ordered_json()}});
  }
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// The scenario that was read, at another timing.
Scenario load_at(const ScenarioSource& source, const Timing& timing, const StepsArguments& arguments) {
  ScenarioSource other = source;
  const auto set = [&](const char* key, double value) {
    other.options.overrides.push_back({std::string("time.") + key, fmt::format("{} s", value)});
  };
  set("step", timing.step);
  set("control", timing.control);
  set("end", timing.end);
  other.options.overrides.push_back({"record.telemetry", "none"});
  Scenario out = reload_scenario(other);
  if (arguments.seed) out.seed = *arguments.seed;
  return out;
}

/// Prescribed motion takes each control step's way within one physics step (docs/control.md).
bool is_prescribed(const Scenario& scenario, const std::string& policy) {
  const auto named = [&](const PolicySpec& one) { return one.name == policy; };
  const auto spec = std::find_if(scenario.policies.begin(), scenario.policies.end(), named);
  const auto control = spec == scenario.policies.end() ? std::nullopt : spec->settings.find("control");
  return control && control->is_map() && control->find("prescribed");
}

int steps(const StepsArguments& arguments) {
  const Scenario scenario = arguments.scenario.load();
  std::vector<std::string> names;
  for (const PolicySpec& policy : scenario.policies) names.push_back(policy.name);
  const std::vector<std::string> policies = chosen_names(names, arguments.policies, scenario.file);
  StepQuestion question;
  question.link = arguments.link.empty() ? default_link(scenario) : arguments.link;
  question.particles = arguments.particles;
  question.steps = read_steps(arguments.steps, scenario.timing);
  question.reference = read_reference(arguments.reference, question.steps.front());
  check_effort(arguments, scenario, question.steps, question.reference, policies.size());
  const InputReplay replay(scenario.source.inputs, scenario.source.folder);
  const EndHangingControllers watch;
  const LoadAt load = [&](const Timing& timing) { return load_at(scenario.source, timing, arguments); };
  std::vector<PolicyStudy> all;
  for (const std::string& policy : policies) {
    Timing timing = scenario.timing;
    const bool each = timing.control == timing.step && is_prescribed(scenario, policy);  // and stays so
    if (arguments.control_each_step || each) timing.control = 0;
    question.policy = policy;
    all.push_back({policy, study_steps(load, timing, question)});
  }
  std::cout << (arguments.json  ? json_of(all, question.link)
                : arguments.csv ? csv_of(all)
                                : text_of(all, question.link, scenario.timing.step));
  return kDone;
}

}  // namespace

void add_steps(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<StepsArguments>();
  CLI::App* verb = add_verb(
      app, "steps", "How large a physics step a scenario bears: stability, error and cost of several",
      "  graze steps arm_follow\n"
      "  graze steps quadruped_trot --steps 0.5ms,1ms,2ms,4ms --set time.end='1 s'\n"
      "  graze steps my.yaml --policy hold -n 32 --reference 0.02ms --csv > steps.csv\n\n"
      "The same particles, without jitter of sensors, at every step; errors are means over the trace beside a run at a "
      "tiny step.\nThe control period stays the scenario's, or is the next multiple of the step. Costs are processor "
      "time\nper simulated second of a trace, on one thread.\n");
  arguments->scenario.add_to(*verb);
  verb->add_option("--steps", arguments->steps, "Physics steps, beside the scenario's own")
      ->type_name("TIME,…")
      ->default_str(kUsualSteps);
  verb->add_option("--reference", arguments->reference,
                   "Step of the run that the others are compared with (default: half of the smallest)")
      ->type_name("TIME");
  verb->add_flag("--control-each-step", arguments->control_each_step,
                 "The control period is the step in every run, also below the scenario's");
  verb->add_option("--link", arguments->link, "Whose place is compared (default: a floating base, or the last link)");
  add_policies(*verb, arguments->policies);
  add_whole(*verb, "-n,--particles", arguments->particles, 1, 10'000, "How many particles")->default_str("8");
  add_whole(*verb, "--seed", arguments->seed, 0, std::numeric_limits<std::uint64_t>::max(),
            "Root seed (default: the scenario's)");
  CLI::Option* json = verb->add_flag("--json", arguments->json, "Print as JSON, in SI units");
  verb->add_flag("--csv", arguments->csv, "Print as CSV, in SI units")->excludes(json);
  verb->callback([arguments, &action] { action = [arguments] { return steps(*arguments); }; });
}

}  // namespace graze
