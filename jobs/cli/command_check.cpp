// graze check: validates everything, simulates nothing.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "analysis/text_table.h"
#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/utf8.h"
#include "engine/model/measures.h"
#include "engine/settings/units.h"
#include "jobs/campaign/hanging_controllers.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/hull_table.h"
#include "jobs/cli/robot_facts.h"
#include "jobs/cli/run_request.h"
#include "jobs/cli/size_estimate.h"
#include "jobs/workers/controllers.h"
#include "jobs/workers/determinism.h"
#include "jobs/workers/first_trace.h"
#include "sampling/design_name.h"
#include "scenarios/channel_readers.h"
#include "scenarios/disturbances.h"
#include "scenarios/doubts.h"
#include "scenarios/robot_file.h"

namespace graze {
namespace {

struct CheckArguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  RecordArguments record;
  std::string output, urdf;
  bool probe = false, json = false, force = false, determinism = false;
};

bool ends_with(const std::string& text, std::string_view tail) {
  return text.size() >= tail.size() && text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

/// How many parameters a table of the dissertation would count: a conical axis error is one, though it takes two
/// scalars (tilt and heading), and persistent value and jitter count apart (Figure 15).
struct Count {
  int persistent = 0, transient = 0, headings = 0, both = 0, fixed = 0;
  int idle = 0, idle_transient = 0;  // channels that no policy reads
  int welded = 0;                    // masses of links that are welded to the world
  int total() const { return persistent + transient; }
};

Count count(const Scenario& s, const ChannelReaders& readers) {
  const ParameterSpace& space = s.space;
  Count count;
  for (const UncertainParameter& parameter : space.parameters) {
    count.welded += is_welded_mass(parameter.name, s.model);
    if (readers.idle(parameter.name)) {
      count.idle += (parameter.jitter ? 1 : 0) + (parameter.persistent.is_constant() ? 0 : 1);
      count.idle_transient += parameter.jitter ? 1 : 0;
    }
    if (ends_with(parameter.name, ".axis.heading")) {
      ++count.headings;
      continue;
    }
    if (parameter.jitter) ++count.transient;
    if (!parameter.persistent.is_constant()) ++count.persistent;
    if (!parameter.persistent.is_constant() && parameter.jitter) ++count.both;
    if (parameter.persistent.is_constant() && !parameter.jitter) ++count.fixed;
  }
  return count;
}

/// "1 link", "2 links"
std::string counted(std::size_t n, const std::string& noun) {
  return fmt::format("{} {}{}", n, noun, n == 1 ? "" : "s");
}

/// "upright (tilt of BODY0 below 90 deg); …", of requirements or of measures.
std::string requirement_list(const Task& task, bool measures) {
  std::string out;
  for (const Requirement& one : task.requirements) {
    if (one.measure == measures) out += fmt::format("{}{} ({})", out.empty() ? "" : "; ", one.name, one.description);
  }
  return out;
}

/// "a, b by 0.5", or "a, b, c … (12 in all) by -0.1 to 0.7".
std::string group_text(const ParameterSpace& space, const CorrelationGroup& group) {
  constexpr std::size_t kShown = 3;
  std::string out;
  for (std::size_t i = 0; i < std::min(kShown, group.members.size()); ++i) {
    out += (i > 0 ? ", " : "") + space.parameters[static_cast<std::size_t>(group.members[i])].name;
  }
  if (group.members.size() > kShown) out += fmt::format(" … ({} in all)", group.members.size());
  double low = 1, high = -1;
  for (Eigen::Index i = 0; i < group.correlation.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      low = std::min(low, group.correlation(i, j));
      high = std::max(high, group.correlation(i, j));
    }
  }
  if (group.members.size() < 2) return out + ", alone";
  return out + (low == high ? fmt::format(" by {:g}", low) : fmt::format(" by {:g} to {:g}", low, high));
}

/// Whatever particles are drawn by.
std::string sampling_text(const Scenario& s) {
  std::string out;
  for (const CorrelationGroup& group : s.space.groups) {
    out += (out.empty() ? "  correlated   " : "; ") + group_text(s.space, group);
  }
  return fmt::format("{}{}  sampling     {}, design {}, seed {}\n", out, out.empty() ? "" : "\n",
                     counted(s.particles, "particle"), design_name(s.design), s.seed);
}

/// " (2 more follow them)", of joints with <mimic>.
std::string followers(const Model& model) {
  const auto n = std::count_if(model.bodies.begin(), model.bodies.end(), [](const Body& b) { return b.mimics >= 0; });
  return n == 0 ? "" : fmt::format(" ({} more follow{} {})", n, n == 1 ? "s" : "", model.na() == 1 ? "it" : "them");
}

std::string overview(const Scenario& s, const ChannelReaders& readers) {
  std::string out = fmt::format("{}\n", printable(s.name));
  if (!s.description.empty()) out += fmt::format("  {}\n", s.description);
  out += fmt::format("  robot        {}: {}, {}, {} base, {}\n", s.world->robot.name,
                     counted(s.world->robot.links.size(), "link"),
                     counted(static_cast<std::size_t>(s.model.na()), "driven joint") + followers(s.model),
                     s.world->robot.floating_base ? "floating" : "fixed", mass_text(s.world->robot, s.model));
  const std::string shapes = shapes_text(s.model);
  out += fmt::format("  environment  {}; {}{}, {} that may touch\n",
                     counted(s.world->objects.size(), "object") + object_masses(*s.world),
                     counted(s.model.colliders.size(), "collision shape"),
                     shapes.empty() ? "" : fmt::format(" ({})", shapes), counted(s.model.pairs.size(), "pair"));
  out += fmt::format("  time         {:g} s in steps of {:g} s, control every {:g} s; physics: {}\n", s.timing.end,
                     s.timing.step, s.timing.control, s.physics);
  out += "  policies     ";
  for (std::size_t i = 0; i < s.policies.size(); ++i) out += (i ? ", " : "") + s.policies[i].name;
  out += "\n  requirements " + requirement_list(s.task, false);
  const std::string measures = requirement_list(s.task, true);
  if (!measures.empty()) out += "\n  measures     " + measures;
  const Count c = count(s, readers);
  out += fmt::format("\n  objective    {}\n", s.task.objective.name);
  for (std::size_t i = 0; i < s.world->disturbances.size(); ++i) {
    const Disturbance& one = s.world->disturbances[i];
    out += fmt::format("  {:<12} {}: {}\n", i == 0 ? "disturbances" : "", one.name, disturbance_text(one, s.space));
  }
  out += fmt::format("  uncertain    {}: {} drawn once per particle, {} redrawn at each control step",
                     counted(static_cast<std::size_t>(c.total()), "parameter"), c.persistent, c.transient);
  if (c.fixed > 0) out += fmt::format("; {} set to a fixed value", c.fixed);
  std::string why;
  if (c.headings > 0) why = fmt::format(" ({} conical errors count once and take two each", c.headings);
  if (c.both > 0)
    why += fmt::format("{}value and jitter of {} count twice and take one", why.empty() ? " (" : "; ", c.both);
  if (c.idle > 0) {
    out += fmt::format("; {} of them ({} at each control step) idle: {} of channels that no policy reads", c.idle,
                       c.idle_transient, c.idle == 1 ? "it is" : "they are");
  }
  if (c.welded > 0) {
    out += fmt::format("; {} of them without effect: {} welded to the world", c.welded,
                       c.welded == 1 ? "its link is" : "their links are");
  }
  if (s.space.size() != c.total()) out += fmt::format("; {} scalars{}{}", s.space.size(), why, why.empty() ? "" : ")");
  return out + "\n" + sampling_text(s);
}

/// "all", "nobody (idle)", "step/1cm, step/2cm"; nothing for what is no channel.
std::string readers_text(const std::optional<std::vector<std::string>>& policies, std::size_t all) {
  if (!policies) return "";
  if (policies->empty()) return "nobody (idle)";
  if (policies->size() == all) return "all";
  return policies->size() > 3 ? fmt::format("{} policies", policies->size())
                              : fmt::format("{}", fmt::join(*policies, ", "));
}

std::string parameter_table(const Scenario& scenario, const ChannelReaders& readers) {
  const ParameterSpace& space = scenario.space;
  std::vector<std::vector<std::string>> rows = {{"parameter", "unit", "nominal", "distribution", "jitter", "read by"}};
  for (const UncertainParameter& p : space.parameters) {
    const std::string nominal =
        p.labels.empty() ? fmt::format("{:.6g}", p.nominal) : p.labels.at(static_cast<int>(p.nominal));
    const std::string persistent = p.distribution_text.empty() ? p.persistent.describe() : p.distribution_text;
    rows.push_back({p.name, p.unit, nominal, rounded_numbers(persistent),
                    p.jitter ? rounded_numbers(p.jitter->describe()) : "-",
                    readers_text(readers.of(p.name), scenario.policies.size())});
  }
  return text_table(rows, rows[0].size());
}

nlohmann::json as_json(const SizeEstimate& e, std::optional<double> free) {
  return {{"particles", e.particles},
          {"policies", e.policies},
          {"bytes", e.total()},
          {"values", e.values},
          {"traces", e.traces},
          {"events", e.events},
          {"telemetry", e.telemetry},
          {"inputs", e.inputs},
          {"probed_traces", e.probed},
          {"processor_seconds", e.probed > 0 ? nlohmann::json(e.seconds) : nlohmann::json()},
          {"seconds_per_step", e.probed > 0 ? nlohmann::json(e.step_seconds) : nlohmann::json()},
          {"free", free ? nlohmann::json(*free) : nlohmann::json()},
          {"fits", free ? nlohmann::json(e.total() <= *free) : nlohmann::json()}};
}

nlohmann::json as_json(const ParameterSpace& space, const CorrelationGroup& group) {
  nlohmann::json out = {{"parameters", nlohmann::json::array()}, {"correlation", nlohmann::json::array()}};
  for (const int member : group.members) {
    out["parameters"].push_back(space.parameters[static_cast<std::size_t>(member)].name);
  }
  for (Eigen::Index i = 0; i < group.correlation.rows(); ++i) {
    const Eigen::VectorXd row = group.correlation.row(i);
    out["correlation"].push_back(std::vector<double>(row.begin(), row.end()));
  }
  return out;
}

nlohmann::json as_json(const Scenario& s, const ChannelReaders& readers) {
  const Count c = count(s, readers);
  nlohmann::json out = {{"name", s.name},
                        {"file", s.file},
                        {"sha256", s.sha256},
                        {"warnings", s.warnings},
                        {"parameters", nlohmann::json::array()},
                        {"count",
                         {{"total", c.total()},
                          {"persistent", c.persistent},
                          {"transient", c.transient},
                          {"idle", c.idle},
                          {"scalars", s.space.size()}}},
                        {"sampling", {{"design", design_name(s.design)}, {"seed", s.seed}, {"particles", s.particles}}},
                        {"correlated", nlohmann::json::array()}};
  for (const CorrelationGroup& group : s.space.groups) out["correlated"].push_back(as_json(s.space, group));
  for (const PolicySpec& policy : s.policies) out["policies"].push_back(policy.name);
  for (const Requirement& r : s.task.requirements) out[r.measure ? "measures" : "requirements"].push_back(r.name);
  for (const Disturbance& one : s.world->disturbances) {
    out["disturbances"].push_back({{"name", one.name}, {"what", disturbance_text(one, s.space)}});
  }
  for (const UncertainParameter& p : s.space.parameters) {
    const auto policies = readers.of(p.name);
    out["parameters"].push_back({{"name", p.name},
                                 {"unit", p.unit},
                                 {"nominal", p.nominal},
                                 {"distribution", p.persistent.describe()},
                                 {"jitter", p.jitter ? nlohmann::json(p.jitter->describe()) : nlohmann::json()},
                                 {"read_by", policies ? nlohmann::json(*policies) : nlohmann::json()}});
  }
  return out;
}

/// What graze run would say about its output.
void look_at(const std::filesystem::path& output) {
  const std::string problem = cannot_make(output);
  const std::filesystem::path folder = folder_of(output);
  if (!problem.empty()) {
    spdlog::warn("{}: cannot be written: {}", output.string(), problem);
  } else if (!std::filesystem::exists(folder)) {
    spdlog::info("{}: is not there yet; graze run makes it", folder.string());
  } else if (std::filesystem::exists(output)) {
    spdlog::warn("{}: exists already; graze run would not replace it without --force", output.string());
  }
}

/// Whether --write-urdf may write where it is told to.
void check_urdf_output(const CheckArguments& arguments, const Scenario& scenario) {
  check_new_file(arguments.urdf, arguments.force, files_of(scenario), NamedBy::word);
}

void write_urdf(const CheckArguments& arguments, const ScenarioArguments& source, const Scenario& scenario) {
  check_urdf_output(arguments, scenario);
  std::optional<InputReplay> given;  // standard input is there once
  if (scenario.source.file == kStandardInput) given.emplace(scenario.source.inputs, scenario.source.folder);
  const std::filesystem::path folder = folder_of(arguments.urdf);
  const std::string text = robot_document(Settings::load(scenario.source.file, source.overrides()),
                                          source.ignore_missing_meshes, std::filesystem::absolute(folder).string());
  const ParentFolders folders(arguments.urdf);
  NewFile file(arguments.urdf, arguments.force);
  const int error = write_all(file.descriptor(), std::as_bytes(std::span(text)));
  if (error != 0) fail_writing(arguments.urdf, error);
  file.publish();
  spdlog::info("{}: the robot's URDF as it was read", arguments.urdf);
}

/// Whether traces depend on what they may depend on alone.
int check_determinism(const Scenario& scenario) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kSilence(5);
  Clock::time_point told = Clock::now();
  const auto begins = [&](const std::string& policy, const std::string& what, std::size_t done, std::size_t all) {
    if (Clock::now() - told < kSilence) return;
    told = Clock::now();
    spdlog::info("policy {}: {} of {} simulations done; now {}", printable(policy), done, all, what);
  };
  const auto ends = [](const PromiseReport& report) { std::cout << promise_text(report) << std::flush; };
  const std::vector<PromiseReport> reports = check_promises(scenario, 0, begins, ends);
  const bool kept = std::all_of(reports.begin(), reports.end(), [](const auto& one) {
    return one.broken.empty() && one.mixed_up == 0 && (one.compared() || one.unfinished > 0);
  });
  const bool known = std::all_of(reports.begin(), reports.end(), [](const auto& one) { return one.unfinished == 0; });
  return !kept ? kGateMissed : known ? kDone : kMachineFailed;
}

/// Whether a controller of the user's own gets through one trace.
ExitCode try_first_traces(const Scenario& scenario) {
  ExitCode out = kDone;
  for (const FirstTrace& trace : first_traces(scenario, controllers_trusted())) {
    if (const std::string outcome = outcome_of(trace); !outcome.empty()) spdlog::info("{}", outcome);
    const std::string problem = problem_of(trace);
    if (problem.empty()) continue;
    spdlog::warn("{}", problem);
    if (!trace.unfinished.empty()) out = kMachineFailed;
    if (!trace.invalid.empty() && out == kDone) out = kGateMissed;
  }
  return out;
}

/// A shared object that is older than the source beside it is mostly one that somebody has forgotten to build.
void tell_old_libraries(const Scenario& scenario) {
  namespace fs = std::filesystem;
  for (const PolicySpec& policy : scenario.policies) {
    const auto library = policy.settings.find("library");
    const auto file = library ? library->find("file") : std::nullopt;
    if (!file || !file->is_scalar()) continue;
    const fs::path object = file->resolve_file(file->text());
    for (const char* ending : {".c", ".cpp", ".cc"}) {
      const fs::path source = fs::path(object).replace_extension(ending);
      std::error_code unknown;
      if (!fs::exists(source, unknown)) continue;
      const auto made = fs::last_write_time(object, unknown), written = fs::last_write_time(source, unknown);
      if (unknown || written <= made) continue;
      spdlog::warn("policy {}: {} is older than {}, of which it was built; build it again", printable(policy.name),
                   printable(object.filename().string()), printable(source.filename().string()));
    }
  }
}

/// What particles do wrong is no fault of the program: it is told, and nothing is probed.
SizeEstimate probed_size(const Scenario& scenario, ExitCode& code) {
  try {
    return probe_size(scenario);
  } catch (const InputError&) {
    throw;
  } catch (const MachineError&) {
    throw;
  } catch (const std::runtime_error& error) {
    spdlog::error("--probe: {}; sizes are guessed", printable(error.what()));
    code = kGateMissed;
    return estimate_size(scenario);
  }
}

int check(const CheckArguments& arguments) {
  if (!arguments.output.empty()) check_campaign_output(arguments.output);
  if (!arguments.urdf.empty()) {
    check_ending(arguments.urdf, "a robot is written as URDF", {".urdf", ".xml"}, Endings::free, NamedBy::word);
  } else if (arguments.force) {
    throw InputError("--force lets --write-urdf replace a file, and there is no --write-urdf");
  }
  ScenarioArguments source = arguments.scenario;
  arguments.record.apply_to(source);
  Scenario scenario = source.load();
  if (!scenario.redesign_problem.empty()) throw InputError(scenario.redesign_problem);
  arguments.draw.apply_to(scenario);
  const EndHangingControllers watch;
  if (arguments.determinism) return check_determinism(scenario);
  if (controllers_trusted()) try_controllers(scenario);
  tell_old_libraries(scenario);
  ExitCode tried = kDone;
  if (!arguments.urdf.empty()) write_urdf(arguments, source, scenario);
  const SizeEstimate size = arguments.probe ? probed_size(scenario, tried) : estimate_size(scenario);
  const std::optional<double> free = free_bytes(arguments.output.empty() ? "." : arguments.output);
  const ChannelReaders readers(scenario);
  if (arguments.json) {
    nlohmann::json out = as_json(scenario, readers);
    out["archive"] = as_json(size, free);
    out["robot"] = robot_as_json(scenario);
    out["meshes"] = hulls_as_json(scenario.model);
    out["objects"] = objects_as_json(*scenario.world);
    std::cout << out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
  } else {
    std::cout << overview(scenario, readers) << "  archive      " << size_text(size, free) << "\n";
    if (free && size.total() > *free) spdlog::warn("the archive would not fit");
    if (!arguments.output.empty()) look_at(arguments.output);
    std::cout << hull_table(scenario.model);
    if (scenario.space.size() > 0) std::cout << "\n" << parameter_table(scenario, readers);
  }
  std::cout << std::flush;
  show_prints();                                      // of particle 0, of campaigns it would be too much
  const ExitCode first = try_first_traces(scenario);  // told last, where it is seen
  return tried == kDone ? first : tried;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* verb = add_verb(
      app, "check", "Validate a scenario before it is simulated, print the resolved parameter table",
      "  graze check data/scenarios/quadruped_curb.yaml\n"
      "  graze check data/scenarios/drop_and_stand.yaml --set robot.urdf=my_robot.urdf\n"
      "  graze check my.yaml --repair --write-urdf mended.urdf         # what is wrong, and mended\n"
      "  graze check my.yaml -n 1000000 --telemetry failures --probe   # how large, how long\n"
      "  graze check my.yaml --trust                                   # does my controller load, and do one trace?\n"
      "  graze check my.yaml --determinism --trust                     # does my controller keep its promise?\n");
  arguments->scenario.add_to(*verb);
  arguments->draw.add_to(*verb);
  arguments->record.add_to(*verb);
  verb->add_option("-o,--output", arguments->output, "Where the archive would be written: its disk is looked at");
  verb->add_option("--write-urdf", arguments->urdf, "Write the robot's URDF as it was read, with --repair mended")
      ->type_name("FILE");
  verb->add_flag("--force", arguments->force, "Let --write-urdf replace the file if it exists");
  verb->add_flag("--probe", arguments->probe, "Simulate one block under each policy: how large, how long");
  verb->add_flag("--determinism", arguments->determinism,
                 "Simulate particles under each policy in different company, and tell whether they come out the same "
                 "(exit code 1: not, or nothing was valid; 3: some were left unfinished)");
  verb->add_flag("--json", arguments->json, "Print JSON");
  verb->callback([arguments, &action] { action = [arguments] { return check(*arguments); }; });
}

}  // namespace graze
