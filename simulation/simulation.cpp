#include "simulation/simulation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "simulation/contained.h"

namespace graze {

Simulation::Simulation(Scenario scenario, std::uint64_t particles)
    : scenario_(std::make_unique<const Scenario>(std::move(scenario))),
      particles_(particles ? particles : scenario_->particles),
      source_(*scenario_, scenario_->seed, particles_) {}

int Simulation::policy(std::string_view name) const {
  std::vector<std::string> names;
  for (const PolicySpec& policy : scenario_->policies) {
    if (policy.name == name) return static_cast<int>(names.size());
    names.push_back(policy.name);
  }
  const std::string near = nearest(std::string(name), names);
  throw InputError(fmt::format("{}: policies: {}: no such policy{}; it has {}", scenario_->file, name,
                               near.empty() ? "" : "; nearest: " + near, fmt::join(names, ", ")));
}

struct Simulator::Impl {
  const Simulation& simulation;
  const int policy;
  std::shared_ptr<TraceWatch> watch = std::make_shared<TraceWatch>();
  ContainedRun run;

  Impl(const Simulation& s, std::string_view name)
      : simulation(s), policy(s.policy(name)), run(s.scenario(), s.scenario().seed, *watch) {}
};

Simulator::Simulator(const Simulation& simulation, std::string_view policy)
    : impl_(std::make_unique<Impl>(simulation, policy)) {}
Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&&) noexcept = default;

std::shared_ptr<TraceWatch> Simulator::watch() const { return impl_->watch; }

std::vector<TraceRecord> Simulator::run(std::span<const Particle> particles, const RunOptions& options) {
  const Scenario& scenario = impl_->simulation.scenario();
  const PolicySpec& policy = scenario.policies[impl_->policy];
  check_beginnings(scenario, policy, particles.size(), options);
  check_saved(scenario, policy, particles, options);
  WorkUnit unit;
  unit.policy = impl_->policy;
  unit.particles.assign(particles.begin(), particles.end());
  if (!unit.particles.empty()) impl_->run.run(unit, options);
  if (!unit.unfinished.empty()) {
    const UnfinishedParticle& one = unit.unfinished.front();
    throw MachineError(fmt::format("particle {} has no trace: {}", one.particle, one.reason));
  }
  return std::move(unit.records);
}

std::vector<TraceRecord> Simulator::run(std::uint32_t first, std::uint32_t count, const RunOptions& options) {
  const Scenario& scenario = impl_->simulation.scenario();
  check_beginnings(scenario, scenario.policies[impl_->policy], count, options);
  if (!options.saved.empty() && options.saved.size() != count) {
    throw SavedTraceError(
        fmt::format("{} saved traces for {} particles; each needs its own", options.saved.size(), count));
  }
  std::vector<Particle> particles;
  std::vector<Beginning> beginnings;
  std::vector<std::shared_ptr<const SavedTrace>> saved;
  std::vector<TraceRecord> out(count);
  std::vector<std::size_t> places;  // of `particles`, in `out`
  for (std::uint32_t i = 0; i < count; ++i) {
    try {
      particles.push_back(impl_->simulation.particle(first + i));
    } catch (const InputError& error) {
      out[i] = unfabricated(first + i, scenario, error.what());
      continue;
    }
    places.push_back(i);
    if (!options.beginnings.empty()) beginnings.push_back(options.beginnings[i]);
    if (!options.saved.empty()) saved.push_back(options.saved[i]);
  }
  std::vector<TraceRecord> made = run(particles, {options.observer, beginnings, saved, options.end, options.informed});
  for (std::size_t k = 0; k < made.size(); ++k) out[places[k]] = std::move(made[k]);
  return out;
}

}  // namespace graze
