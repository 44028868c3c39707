#pragma once
// The particles of a campaign: drawn, fabricated, or the record that says why one could not be.

#include <cstdint>
#include <string>
#include <vector>

#include "engine/model/derived.h"
#include "scenarios/scenario.h"
#include "simulation/trace.h"

namespace graze {

/// Thread-safe.
class ParticleSource {
 public:
  /// `count`: particles of the campaign, which a Latin hypercube depends on. Throws InputError if the design cannot
  /// serve them.
  ParticleSource(const Scenario& scenario, std::uint64_t seed, std::uint64_t count);
  /// Persistent values [parameter], in the order of the scenario's space.
  std::vector<double> draw(std::uint32_t id) const { return sampler_.draw(id); }
  /// Throws InputError that names the parameter if a value is impossible.
  Particle fabricate(std::uint32_t id, const std::vector<double>& values) const {
    return fabricator_.fabricate(id, values);
  }

  /// What fabrication makes of these values, and of the nominal ones. Throws as fabricate().
  std::vector<Derived> derived(const std::vector<double>& values) const {
    return derived_numbers(fabricator_.perturbed(values));
  }
  std::vector<Derived> nominal_derived() const { return derived_numbers(fabricator_.world()); }

 private:
  Sampler sampler_;
  Fabricator fabricator_;
};

/// The trace of a particle that could not be fabricated: invalid, NaN where there is nothing to tell.
TraceRecord unfabricated(std::uint32_t id, const Scenario& scenario, const std::string& reason);

}  // namespace graze
