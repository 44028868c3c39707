#include "jobs/workers/first_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "archive/files/utf8.h"
#include "engine/library/library_use.h"
#include "jobs/workers/controllers.h"
#include "simulation/contained.h"
#include "simulation/particles.h"

namespace graze {
namespace {

/// Robots of these trackers move by torques alone.
bool moves_by_torque(const PolicySpec& policy) {
  const auto control = policy.settings.find("control");
  return control && (control->find("torque") || control->find("joint_pd"));
}

FirstTrace trace_of(const Scenario& scenario, const Particle& particle, int policy, const RunElsewhere& elsewhere) {
  const PolicySpec& spec = scenario.policies[static_cast<std::size_t>(policy)];
  FirstTrace out{.policy = spec.name};
  TraceWatch watch;
  ContainedRun run(scenario, scenario.seed, watch, elsewhere);
  WorkUnit unit;
  unit.policy = policy;
  unit.particles = {particle};
  run.run(unit);
  for (const UnfinishedParticle& one : unit.unfinished) out.unfinished = one.reason;
  for (const TraceRecord& record : unit.records) {
    const std::vector<double>& torques = record.telemetry.tau();
    if (record.outcome == Outcome::invalid) out.invalid = record.invalid_reason;
    out.limp =
        !torques.empty() && moves_by_torque(spec) && std::ranges::all_of(torques, [](double t) { return t == 0; });
  }
  return out;
}

}  // namespace

std::vector<FirstTrace> first_traces(const Scenario& scenario) {
  Scenario watched = scenario;
  watched.recording.telemetry = Telemetry::all;
  const ParticleSource source(watched, watched.seed, watched.particles);
  std::vector<FirstTrace> out;
  std::optional<Particle> particle;
  try {
    particle = source.fabricate(0, source.draw(0));
  } catch (const InputError&) {  // it is invalid under any controller
    return out;
  }
  const RunElsewhere elsewhere = controllers_elsewhere(watched, watched.seed, watched.particles, 0);
  for (std::size_t i = 0; i < watched.policies.size(); ++i) {
    if (is_from_outside(watched.policies[i].settings))
      out.push_back(trace_of(watched, *particle, static_cast<int>(i), elsewhere));
  }
  return out;
}

std::string problem_of(const FirstTrace& trace) {
  const std::string begin = fmt::format("policy {}, particle 0: ", printable(trace.policy));
  if (!trace.unfinished.empty()) return begin + printable(trace.unfinished) + "; its trace would be left unfinished";
  if (!trace.invalid.empty()) return begin + printable(trace.invalid) + "; its trace would be invalid";
  if (!trace.limp) return "";
  return begin +
         "all torques are 0 from beginning to end: the robot is limp; the tracker 'torque' uses targets.torque, "
         "'joint_pd' uses position by kp, velocity by kd, and torque beside";
}

}  // namespace graze
