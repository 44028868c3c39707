#include "simulation/particles.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>

namespace graze {
namespace {

std::vector<std::string> parameter_paths(const Scenario& scenario) {
  std::vector<std::string> paths;
  for (const UncertainParameter& parameter : scenario.space.parameters) paths.push_back(parameter.name);
  return paths;
}

Sampler sampler_of(const Scenario& scenario, std::uint64_t seed, std::uint64_t count) {
  try {
    return Sampler(scenario.space, scenario.design, seed, count);
  } catch (const std::invalid_argument& e) {
    throw InputError(fmt::format("{}: sampling.design: {}", scenario.file, e.what()));
  }
}

}  // namespace

ParticleSource::ParticleSource(const Scenario& scenario, std::uint64_t seed, std::uint64_t count)
    : sampler_(sampler_of(scenario, seed, count)), fabricator_(scenario.world, parameter_paths(scenario)) {}

TraceRecord unfabricated(std::uint32_t id, const Scenario& scenario, const std::string& reason) {
  TraceRecord record;
  record.particle = id;
  record.outcome = Outcome::invalid;
  record.invalid_reason = reason;
  const double never = std::numeric_limits<double>::quiet_NaN();
  record.margins.assign(scenario.task.requirements.size(), never);
  record.first_violations.assign(scenario.task.requirements.size(), never);
  record.objective_margin = never;
  record.q.assign(scenario.model.nq, never);
  record.v.assign(scenario.model.nv, never);
  return record;
}

}  // namespace graze
