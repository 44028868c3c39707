#pragma once
// The simulator as a library (Algorithm 1's inner loop): particles of a scenario, simulated under its policies, without
// files, processes or options. docs/library.md has examples.
//
//   const Simulation simulation(load_scenario("curb.yaml"));
//   Simulator simulator(simulation, "step/3cm");
//   for (const TraceRecord& trace : simulator.run(0, 100)) …

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "scenarios/scenario.h"
#include "simulation/block_run.h"
#include "simulation/particles.h"
#include "simulation/watchdog.h"

namespace graze {

/// A scenario with its particles. Constant once it is made, so that any number of threads may share one; simulations
/// know nothing of each other.
class Simulation {
 public:
  /// `particles`: how many there are, which a Latin hypercube depends on; 0: as the scenario says. Throws InputError if
  /// the sampling design cannot serve them.
  explicit Simulation(Scenario scenario, std::uint64_t particles = 0);

  const Scenario& scenario() const { return *scenario_; }
  const Model& nominal() const { return scenario_->model; }  // p0
  std::uint64_t particles() const { return particles_; }
  /// Persistent values [parameter] of a particle, in the order of scenario().space.
  std::vector<double> values(std::uint32_t id) const { return source_.draw(id); }
  /// The particle with these values. Throws InputError that names the parameter if a value is impossible.
  Particle fabricate(std::uint32_t id, const std::vector<double>& values) const {
    return source_.fabricate(id, values);
  }
  Particle particle(std::uint32_t id) const { return fabricate(id, values(id)); }
  /// Index into scenario().policies. Throws InputError with the nearest name.
  int policy(std::string_view name) const;

 private:
  std::unique_ptr<const Scenario> scenario_;  // at one address: runs refer to it
  std::uint64_t particles_;
  ParticleSource source_;
};

/// Simulates under one policy. Owned by one thread and reused for many runs; what a trace comes out as depends on
/// (scenario, policy, particle, beginning) alone.
class Simulator {
 public:
  /// `simulation` outlives this. Throws InputError: no such policy.
  Simulator(const Simulation& simulation, std::string_view policy);
  ~Simulator();
  Simulator(Simulator&&) noexcept;

  /// One record per particle, in the same order. A particle that cannot be fabricated or whose simulation throws is
  /// `invalid` and says why; the others have the bits that they have without it. Throws InputError for a beginning that
  /// no trace can have, SavedTraceError (an InputError) for a saved trace that does not fit or cannot be saved,
  /// MachineError if memory or, with a watchdog, time is over; what else an observer throws counts as a fault of its
  /// particle, after which the others are simulated again.
  std::vector<TraceRecord> run(std::span<const Particle> particles, const RunOptions& options = {});
  /// Particles first … first + count - 1 of the simulation.
  std::vector<TraceRecord> run(std::uint32_t first, std::uint32_t count, const RunOptions& options = {});

  /// For Watchdog::add: cuts traces off that take too long.
  std::shared_ptr<TraceWatch> watch() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace graze
