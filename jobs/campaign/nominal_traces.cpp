#include "jobs/campaign/nominal_traces.h"

#include <utility>

#include "engine/model/fabrication.h"
#include "simulation/simulation.h"

namespace graze {

std::vector<TraceRecord> nominal_traces(const Scenario& scenario, const std::vector<std::string>& policies) {
  Scenario own = scenario;
  own.recording.telemetry = Telemetry::none;
  own.recording.events = false;
  own.recording.phases = true;
  for (UncertainParameter& parameter : own.space.parameters) parameter.jitter.reset();
  const Simulation simulation(std::move(own), 1);
  std::vector<Particle> particles = {Fabricator(simulation.scenario().world, {}).nominal()};
  particles.front().id = kNominalParticle;
  std::vector<TraceRecord> out;
  for (const std::string& policy : policies) {
    out.push_back(std::move(Simulator(simulation, policy).run(particles).front()));
  }
  return out;
}

}  // namespace graze
