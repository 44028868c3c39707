#include "jobs/campaign/design_robots.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "engine/model/urdf_writer.h"
#include "engine/settings/sha256.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

bool is_of_drive(const std::string& path) { return path.ends_with(".gear") || path.ends_with(".rotor_inertia"); }

/// As a YAML scalar, whatever quotes it holds.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
  return out + "'";
}

/// Of all drives, because one map takes the place of what the scenario says: "{hip: 50, knee: 40}".
std::string by_joint(const Robot& robot, double Joint::*member) {
  std::string out;
  for (const Joint& joint : robot.joints) {
    if (joint.driven()) out += fmt::format("{}{}: {}", out.empty() ? "" : ", ", quoted(joint.name), joint.*member);
  }
  return "{" + out + "}";
}

}  // namespace

DesignRobots::DesignRobots(const Scenario& scenario) : scenario_(scenario) {
  for (const DesignVariable& one : block().variables) {
    if (!one.of_policy) paths_.insert(paths_.end(), one.paths.begin(), one.paths.end());
  }
  files_ = scenario.source.inputs;
  const std::size_t levels = std::max<std::size_t>(1, block().task_values.size());
  for (std::size_t level = 0; level < levels; ++level) {
    if (block().task_path.empty()) {
      worlds_.push_back(scenario.world);
      warnings_.emplace_back();
    } else {
      read_level(level);
    }
  }
}

/// From the files as they are now: a harder task may name others.
void DesignRobots::read_level(std::size_t level) try {
  const Scenario there = load_scenario(scenario_.source.file, source_at(level).options);
  worlds_.push_back(there.world);
  warnings_.push_back(there.warnings);
  files_.insert(there.source.inputs.begin(), there.source.inputs.end());
} catch (const InputError& error) {
  std::string why = error.what();  // as of an override: nobody has said --set
  const std::string as_set = fmt::format("--set {}={}: ", block().task_path, block().task_values[level]);
  if (why.starts_with(as_set)) why.erase(0, as_set.size());
  throw InputError(fmt::format("{}: design.task.values, {} of {} ({}): {}", block().task_places[level], level + 1,
                               block().task_values.size(), block().task_values[level], why));
}

bool is_part_of_robot(const std::string& name) {
  const fs::path ending = fs::path(name).extension();
  return !name.starts_with('$') && !is_meant_include(name) && ending != ".yaml" && ending != ".yml";
}

std::string DesignRobots::files_sha256() const {
  std::multiset<std::string> sums;  // names may be of another folder
  for (const auto& [name, content] : files_) {
    if (is_part_of_robot(name)) sums.insert(sha256_of(content));
  }
  std::string all;
  for (const std::string& one : sums) all += one;
  return sha256_of(all);
}

DesignValues DesignRobots::initial() const {
  DesignValues out;
  for (const DesignVariable& one : block().variables) out.push_back(one.nominal);
  return out;
}

ScenarioSource DesignRobots::source_at(std::size_t level) const {
  ScenarioSource out = scenario_.source;
  if (!block().task_path.empty()) {
    out.options.overrides.push_back({block().task_path, block().task_values[level]});
  }
  return out;
}

World DesignRobots::world_of(std::size_t level, const DesignValues& design) const {
  std::vector<double> values;
  for (std::size_t i = 0; i < design.size(); ++i) {
    const DesignVariable& one = block().variables[i];
    if (one.of_policy) continue;
    for (std::size_t k = 0; k < one.paths.size(); ++k) values.push_back(one.at(k, design[i]));
  }
  return Fabricator(worlds_[level], paths_).perturbed(values);
}

std::vector<Override> DesignRobots::overrides(std::size_t level, const DesignValues& design) const {
  std::vector<Override> out;
  bool drives = false;
  for (std::size_t i = 0; i < design.size(); ++i) {
    const DesignVariable& one = block().variables[i];
    for (std::size_t k = 0; k < one.paths.size(); ++k) {
      drives = drives || is_of_drive(one.paths[k]);
      if (!one.of_policy) continue;
      const double value = one.share[k] * design[i] / one.scale;
      out.push_back({one.paths[k], fmt::format("{}{}{}", value, one.unit.empty() ? "" : " ", one.unit)});
    }
  }
  if (!drives) return out;
  const World world = world_of(level, design);
  out.push_back({"actuators.gear", by_joint(world.robot, &Joint::gear)});
  out.push_back({"actuators.rotor_inertia", by_joint(world.robot, &Joint::rotor_inertia)});
  return out;
}

std::string DesignRobots::urdf(std::size_t level, const DesignValues& design) const {
  return has_robot_variables() ? write_urdf(world_of(level, design).robot) : "";
}

MadeDesigns DesignRobots::make(std::size_t level, const std::vector<DesignValues>& designs) const {
  MadeDesigns out;
  out.scenarios.resize(designs.size());
  out.problems.resize(designs.size());
  InputFiles files = files_;
  std::vector<std::string> texts(designs.size());  // of the robots
  const auto name = [&](std::size_t i) {
    return (fs::path(scenario_.source.folder) / fmt::format("design-{}.urdf", i)).lexically_normal().string();
  };
  for (std::size_t i = 0; i < designs.size(); ++i) {
    try {
      if (has_robot_variables()) files[name(i)] = texts[i] = urdf(level, designs[i]);
    } catch (const InputError& error) {
      out.problems[i] = error.what();
    }
  }
  out.inputs = std::make_unique<InputReplay>(std::move(files), scenario_.source.folder);
  for (std::size_t i = 0; i < designs.size(); ++i) {
    if (!out.problems[i].empty()) continue;
    ScenarioSource source = source_at(level);
    try {
      for (const Override& one : overrides(level, designs[i])) source.options.overrides.push_back(one);
      if (has_robot_variables()) source.options.overrides.push_back({"robot.urdf", quoted(name(i))});
      source.options.overrides.push_back({"design", "~"});  // its bounds were those of the first robot
      out.scenarios[i] = reload_scenario(source);
      out.scenarios[i]->seed = scenario_.seed;
      out.scenarios[i]->particles = scenario_.particles;
      if (has_robot_variables()) out.scenarios[i]->controller_urdf = std::move(texts[i]);
    } catch (const InputError& error) {
      out.problems[i] = error.what();
    }
  }
  return out;
}

std::vector<std::string> DesignRobots::overdrawn() const {
  const auto drawn = [](const Scenario& scenario, const std::string& path) -> const UncertainParameter* {
    for (const UncertainParameter& one : scenario.space.parameters) {
      if (one.name == path && one.labels.empty()) return &one;
    }
    return nullptr;
  };
  std::vector<std::string> out;
  for (std::size_t i = 0; i < block().variables.size(); ++i) {
    const DesignVariable& variable = block().variables[i];
    if (variable.of_policy || !drawn(scenario_, variable.paths.front())) continue;
    DesignValues moved = initial();
    moved[i] = moved[i] > 0.5 * (variable.lower + variable.upper) ? variable.lower : variable.upper;
    const MadeDesigns made = make(0, {moved});
    const UncertainParameter* const before = drawn(scenario_, variable.paths.front());
    const UncertainParameter* const after =
        made.scenarios.front() ? drawn(*made.scenarios.front(), variable.paths.front()) : nullptr;
    if (!after || after->persistent.mean() != before->persistent.mean()) continue;
    out.push_back(fmt::format("{}: {} is {}", variable.name, before->name, before->persistent.describe()));
  }
  return out;
}

std::vector<std::optional<Particle>> DesignRobots::beside(const Scenario& made, const DesignValues& centre,
                                                          const std::vector<DesignValues>& designs) const {
  std::vector<std::optional<Particle>> out(designs.size());
  if (!has_robot_variables()) return out;
  const Fabricator fabricator(made.world, paths_);
  const ParameterTable table(*made.world);
  std::vector<double> nominal;
  for (const std::string& path : paths_) nominal.push_back(table.find(path)->nominal);
  for (std::size_t d = 0; d < designs.size(); ++d) {
    std::vector<double> values = nominal;
    std::size_t at = 0;
    bool fabricable = true;
    for (std::size_t i = 0; i < centre.size(); ++i) {
      const DesignVariable& one = block().variables[i];
      if (one.of_policy) {
        fabricable = fabricable && designs[d][i] == centre[i];
        continue;
      }
      for (std::size_t k = 0; k < one.paths.size(); ++k, ++at) {
        if (designs[d][i] != centre[i]) values[at] += one.at(k, designs[d][i]) - one.at(k, centre[i]);
      }
    }
    if (!fabricable) continue;
    try {
      out[d] = fabricator.fabricate(0, values);
    } catch (const InputError&) {  // make() says why
    }
  }
  return out;
}

std::string DesignRobots::yaml(std::size_t level, const DesignValues& design, const std::string& urdf) const {
  std::vector<Override> all = source_at(level).options.overrides;
  for (const Override& one : overrides(level, design)) all.push_back(one);
  if (!urdf.empty()) all.push_back({"robot.urdf", urdf});
  return yaml_of(all);
}

std::string DesignRobots::before(std::size_t level) const { return yaml_of(source_at(level).options.overrides); }

std::string DesignRobots::yaml_of(std::vector<Override> overrides) const {
  // Names of files that --set or a task gave begin in the working directory, those in a file beside it.
  const std::size_t given = scenario_.source.options.overrides.size() + (block().task_path.empty() ? 0 : 1);
  for (std::size_t i = 0; i < given; ++i) {
    if (input_exists(input_path(overrides[i].value))) overrides[i].value = input_path(overrides[i].value);
  }
  const std::string included = (fs::path(scenario_.source.folder) / scenario_.file).lexically_normal().string();
  const std::string rest =
      overrides.empty() ? "" : Settings::parse("{}", "improved").overridden(overrides).resolved_text();
  return fmt::format("include: {}\n{}{}", quoted(included), rest, rest.empty() || rest.ends_with('\n') ? "" : "\n");
}

}  // namespace graze
