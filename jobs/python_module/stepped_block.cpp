#include "jobs/python_module/stepped_block.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "engine/library/library_use.h"
#include "engine/library/python_use.h"
#include "scenarios/robot_file.h"

namespace graze {
namespace {

/// Controllers are told of the robot before they are made, and reading a scenario makes them where they are allowed.
Simulation simulation_of(const BlockRequest& request) {
  if (request.trust) allow_interpreters();
  allow_libraries(LibraryLoading::refused);
  ScenarioOptions options;
  options.overrides = request.overrides;
  Scenario scenario = load_scenario(request.file, options);
  if (request.seed) scenario.seed = *request.seed;
  scenario.recording.telemetry = Telemetry::none;  // who steps sees every step
  scenario.recording.events = true;
  const bool outside = std::any_of(scenario.policies.begin(), scenario.policies.end(),
                                   [](const PolicySpec& one) { return is_from_outside(one.settings); });
  if (outside && request.trust) {
    const ScenarioSource& source = scenario.source;
    brief_libraries(robot_document(Settings::load(source.file, source.options.overrides),
                                   source.options.ignore_missing_meshes, source.folder));
    allow_libraries(LibraryLoading::all);
  }
  return Simulation(std::move(scenario), request.count);
}

const PolicySpec& policy_of(const Simulation& simulation, const std::string& name) {
  const std::vector<PolicySpec>& all = simulation.scenario().policies;
  if (!name.empty()) return all[static_cast<std::size_t>(simulation.policy(name))];
  if (all.size() == 1) return all.front();
  std::vector<std::string> names;
  for (const PolicySpec& one : all) names.push_back(one.name);
  throw InputError(fmt::format("{}: policies: a block runs under one policy, and there are {}: {}; name one",
                               simulation.scenario().file, all.size(), fmt::join(names, ", ")));
}

std::vector<Particle> particles_of(const Simulation& simulation, const std::vector<std::uint32_t>& ids) {
  if (ids.empty() || ids.size() > kLanes) {
    throw InputError(fmt::format("particles: {} are asked for; a block has 1 to {}", ids.size(), kLanes));
  }
  const bool closed = simulation.scenario().design == Design::latin_hypercube;  // has no others
  std::vector<Particle> out;
  for (const std::uint32_t id : ids) {
    if (closed && id >= simulation.particles()) {
      throw InputError(fmt::format("particles: particle {} is none of the {} of this Latin hypercube, which n says", id,
                                   simulation.particles()));
    }
    if (std::count(ids.begin(), ids.end(), id) > 1) throw InputError(fmt::format("particles: {} is named twice", id));
    out.push_back(simulation.particle(id));
  }
  return out;
}

void set_column(SteppedBlock::Array& out, int column, const BlockArray& array, int lane) {
  for (int i = 0; i < array.rows(); ++i) out(i, column) = array(i, lane);
}

SteppedBlock::Array zeros(std::size_t rows, int columns) {
  return SteppedBlock::Array::Zero(static_cast<Eigen::Index>(rows), columns);
}

}  // namespace

SteppedBlock::SteppedBlock(const BlockRequest& request)
    : simulation_(simulation_of(request)),
      policy_(policy_of(simulation_, request.policy)),
      names_(trace_names(simulation_.nominal())),
      particles_(particles_of(simulation_, request.particles)),
      lane_of_(particles_.size(), 0),
      column_of_(kLanes, 0),
      run_(scenario(), policy_, scenario().seed) {
  const Model& model = simulation_.nominal();
  const int n = size();
  const auto nv = static_cast<std::size_t>(model.nv);
  time.assign(particles_.size(), 0);
  active.assign(particles_.size(), true);
  contacts.resize(particles_.size());
  q = zeros(static_cast<std::size_t>(model.nq), n), v = zeros(nv, n), a = zeros(nv, n);
  tau = zeros(model.actuated.size(), n);
  link_position = zeros(3 * model.frames.size(), n), link_rotation = zeros(9 * model.frames.size(), n);
  requirements = zeros(scenario().task.requirements.size(), n);
  objective = zeros(leaves(scenario().task.objective).size(), n);
  run_.begin(particles_, {.observer = this});
}

bool SteppedBlock::step() { return run_.step(); }

void SteppedBlock::stop(const std::vector<int>& columns) {
  LaneMask lanes;
  for (const int column : columns) {
    check_column(column);
    if (active[static_cast<std::size_t>(column)]) lanes.set(lane_of_[static_cast<std::size_t>(column)]);
    active[static_cast<std::size_t>(column)] = false;
  }
  run_.stop(lanes);
}

bool SteppedBlock::see(const StepView& view) {
  if (view.step == view.first) {
    const auto here = std::find_if(particles_.begin(), particles_.end(),
                                   [&](const Particle& one) { return one.id == view.particle; });
    column_of_[static_cast<std::size_t>(view.lane)] = static_cast<int>(here - particles_.begin());
  }
  const int column = column_of_[static_cast<std::size_t>(view.lane)];
  const auto at = static_cast<std::size_t>(column);
  lane_of_[at] = view.lane;
  time[at] = view.time;
  active[at] = !view.ends;
  const BlockState& state = view.physics.state();
  set_column(q, column, state.q, view.lane);
  set_column(v, column, state.v, view.lane);
  set_column(a, column, state.a, view.lane);
  set_column(tau, column, view.tau, view.lane);
  set_column(requirements, column, view.requirements, view.lane);
  set_column(objective, column, view.objective, view.lane);
  for (std::size_t k = 0; k < view.model.frames.size(); ++k) {
    const Frame& frame = view.model.frames[k];
    const Pose X_WB = frame.body < 0 ? Pose(Pose::Identity()) : state.pose(frame.body, view.lane);
    const Pose X_WL = X_WB * frame.X_BF;
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R_WL = X_WL.rotation();
    const auto row = static_cast<Eigen::Index>(k);
    link_position.block(3 * row, column, 3, 1) = X_WL.translation().array();
    link_rotation.block(9 * row, column, 9, 1) = Eigen::Map<const Eigen::Array<double, 9, 1>>(R_WL.data());
  }
  contacts[at] = view.physics.contacts(view.lane);
  return true;
}

const std::vector<Event>& SteppedBlock::events(int column) const {
  check_column(column);
  const auto at = static_cast<std::size_t>(column);
  return active[at] ? run_.events(lane_of_[at]) : run_.records()[at].events;
}

const TraceRecord& SteppedBlock::record(int column) const {
  check_column(column);
  if (active[static_cast<std::size_t>(column)]) {
    throw InputError(fmt::format("lane {}: its trace goes on; it is judged when it ends (stop() ends it now)", column));
  }
  return run_.records()[static_cast<std::size_t>(column)];
}

void SteppedBlock::check_column(int column) const {
  if (column >= 0 && column < size()) return;
  throw InputError(fmt::format("lane {}: there are {}, counted from 0", column, size()));
}

}  // namespace graze
