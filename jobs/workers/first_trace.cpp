#include "jobs/workers/first_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
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

/// Joints whose torque was at least 95 % of its nominal limit in 90 % of the frames: what targets in other units do, or
/// of the wrong sign, or for other joints. The first frame is before the first step.
std::vector<std::string> joints_at_limit(const Model& model, const std::vector<double>& torques) {
  const std::size_t na = model.actuated.size(), frames = na == 0 ? 0 : torques.size() / na;
  std::vector<std::string> out;
  for (std::size_t k = 0; k < na; ++k) {
    const Body& body = model.bodies[static_cast<std::size_t>(model.actuated[k])];
    std::size_t at_limit = 0;
    for (std::size_t i = 1; i < frames; ++i) at_limit += std::abs(torques[i * na + k]) >= 0.95 * body.effort;
    if (body.effort > 0 && std::isfinite(body.effort) && at_limit * 10 > (frames - 1) * 9) out.push_back(body.joint);
  }
  return out;
}

/// Whether the torque of one of these joints changed its sign from frame to frame nearly always, as an explicit law's
/// does whose gains are too high for the inertia and the control period.
bool any_flips(const Model& model, const std::vector<double>& torques, const std::vector<std::string>& which) {
  const std::size_t na = model.actuated.size(), frames = na == 0 ? 0 : torques.size() / na;
  for (std::size_t k = 0; k < na; ++k) {
    const std::string& joint = model.bodies[static_cast<std::size_t>(model.actuated[k])].joint;
    if (std::find(which.begin(), which.end(), joint) == which.end()) continue;
    std::size_t flips = 0;
    for (std::size_t i = 2; i < frames; ++i) flips += torques[i * na + k] * torques[(i - 1) * na + k] < 0;
    if (frames > 20 && flips * 10 > (frames - 2) * 6) return true;
  }
  return false;
}

/// "known failure (upright) at 0.31 s", "unknown failure: the objective is missed, its margin is -0.145"
std::string first_outcome(const TraceRecord& record, const Task& task) {
  std::string out(outcome_name(record.outcome));
  if (record.outcome == Outcome::unknown_failure) {
    return out + fmt::format(": the objective is missed, its margin is {:.3g}", record.objective_margin);
  }
  if (record.violated < 0) return out;
  const std::string& name = task.requirements.at(static_cast<std::size_t>(record.violated)).name;
  return out + fmt::format(" ({}) at {:.4g} s", printable(name), record.end_time);
}

/// Faults of a controller in a process of its own are told when they occur, by the name of its file.
bool is_told(const PolicySpec& policy, const std::string& reason) {
  if (!is_from_outside(policy.settings) || !is_isolated(policy.settings)) return false;
  const Settings own = policy.settings.at(policy.settings.has("library") ? "library" : "python");
  return reason.starts_with(std::filesystem::path(own.at("file").text()).filename().string() + ": ");
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
    if (record.outcome != Outcome::invalid) out.outcome = first_outcome(record, scenario.task);
    out.at_limit = joints_at_limit(scenario.model, torques);
    out.flips = any_flips(scenario.model, torques, out.at_limit);
  }
  out.told = is_told(spec, out.invalid + out.unfinished);
  return out;
}

}  // namespace

std::vector<FirstTrace> first_traces(const Scenario& scenario, bool trusted) {
  Scenario watched = scenario;
  watched.recording.telemetry = Telemetry::all;
  watched.recording.every = watched.timing.steps_per_control();
  std::vector<int> policies;
  for (std::size_t i = 0; i < watched.policies.size(); ++i) {
    const Settings& policy = watched.policies[i].settings;
    if ((trusted && is_from_outside(policy)) || policy.has("network")) policies.push_back(static_cast<int>(i));
  }
  if (policies.empty()) return {};
  const ParticleSource source(watched, watched.seed, watched.particles);
  std::optional<Particle> particle;
  try {
    particle = source.fabricate(0, source.draw(0));
  } catch (const InputError&) {  // it is invalid under any controller
    return {};
  }
  const RunElsewhere elsewhere =
      trusted ? controllers_elsewhere(watched, watched.seed, watched.particles, 0) : RunElsewhere();
  std::vector<FirstTrace> out;
  for (const int policy : policies) out.push_back(trace_of(watched, *particle, policy, elsewhere));
  return out;
}

namespace {

std::string limit_text(const std::vector<std::string>& joints, bool flips) {
  const std::string which = joints.size() == 1 ? "a joint (" + printable(joints[0]) + ")"
                                               : fmt::format("{} joints ({}, …)", joints.size(), printable(joints[0]));
  if (flips) {
    return fmt::format(
        "the torque of {} is at its limit nearly all the time, and changes its sign from one control step to the next: "
        "the "
        "gains (a damping, above all) are too high for so light a link at this control period; lower them, let "
        "control: {{joint_pd: …}} damp, which is implicit, or shorten time.control",
        which);
  }
  return fmt::format(
      "the torque of {} is at its limit nearly all the time; are the targets in rad, m and N m, of the right sign, and "
      "in the order of the robot's joints?",
      which);
}

}  // namespace

std::string outcome_of(const FirstTrace& trace) {
  if (trace.outcome.empty()) return "";
  return fmt::format("policy {}, particle 0: {}", printable(trace.policy), trace.outcome);
}

std::string problem_of(const FirstTrace& trace) {
  const std::string begin = fmt::format("policy {}, particle 0: ", printable(trace.policy));
  const auto because = [&](const std::string& why) { return trace.told ? "" : printable(why) + "; "; };
  if (!trace.unfinished.empty()) return begin + because(trace.unfinished) + "its trace would be left unfinished";
  const std::string limit = trace.at_limit.empty() ? "" : limit_text(trace.at_limit, trace.flips);
  if (!trace.invalid.empty()) {
    return begin + because(trace.invalid) + "its trace would be invalid" + (limit.empty() ? "" : "; ") + limit;
  }
  if (!limit.empty()) return begin + limit;
  if (!trace.limp) return "";
  return begin +
         "all torques are 0 from beginning to end: the robot is limp; the tracker 'torque' uses targets.torque, "
         "'joint_pd' uses position by kp, velocity by kd, and torque beside";
}

}  // namespace graze
