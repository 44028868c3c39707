#include "simulation/saved_trace.h"

#include <fmt/format.h>

#include "engine/lanes/running_digest.h"

namespace graze {
namespace {

void add_window(const Window& window, RunningDigest& digest) { digest.add(window.from), digest.add(window.to); }

void add_objective(const Objective& objective, RunningDigest& digest) {
  digest.add(static_cast<int>(objective.kind)), digest.add(objective.description);
  add_window(objective.window, digest);
  digest.add(objective.parts.size());
  for (const Objective& part : objective.parts) add_objective(part, digest);
}

std::uint64_t digest_of(const Task& task) {
  RunningDigest digest;
  digest.add(task.requirements.size());
  for (const Requirement& one : task.requirements) {
    digest.add(static_cast<int>(one.measure)), digest.add(one.description);
    add_window(one.window, digest);
  }
  add_objective(task.objective, digest);
  digest.add(static_cast<int>(task.stop_at_violation));
  return digest.value();
}

void add_pose(const Pose& X, RunningDigest& digest) { digest.add_all(X.matrix()); }

/// "{telemetry: last, every: 1, last: 0.02 s, events: false, phases: {gap: 0.02 s, dwell: 0.002 s, impulse: 0.1 N s}}"
std::string text_of(const Recording& recording) {
  static constexpr const char* kNames[] = {"none", "failures", "last", "all"};
  const std::string last =
      recording.telemetry == Telemetry::last ? fmt::format(", last: {} s", recording.last) : std::string();
  const PhaseRules& rules = recording.rules;
  const std::string phases = recording.phases ? fmt::format("{{gap: {} s, dwell: {} s, impulse: {} N s}}", rules.gap,
                                                            rules.dwell, rules.impulse)
                                              : "false";
  return fmt::format("{{telemetry: {}, every: {}{}, events: {}, phases: {}}}",
                     kNames[static_cast<int>(recording.telemetry)], recording.every, last, recording.events, phases);
}

void check_kind(const Scenario& scenario, const PolicySpec& policy, const TraceKind& here, const TraceKind& saved) {
  if (saved.numbering != here.numbering) {
    throw SavedTraceError(
        fmt::format("{}: a trace of another robot or world cannot go on here: bodies, joints, shapes, "
                    "meshes or terrain differ",
                    scenario.file));
  }
  if (saved.policy != here.policy) {
    throw SavedTraceError(
        fmt::format("a trace that was saved under a policy of the kind '{}' cannot go on under {}, which "
                    "is of the kind '{}'",
                    saved.policy, policy.name, here.policy));
  }
  if (saved.step != here.step) {
    throw SavedTraceError(
        fmt::format("{}: time.step: a trace that was saved with physics steps of {} s cannot go on with steps of {} s",
                    scenario.file, saved.step, here.step));
  }
  if (saved.task != here.task) {
    throw SavedTraceError(
        fmt::format("{}: task: a trace that was judged by another task cannot go on here: requirements, measures, "
                    "objective, their windows or stop_at_violation differ",
                    scenario.file));
  }
  if (text_of(saved.recording) != text_of(here.recording)) {
    throw SavedTraceError(fmt::format("{}: record: a trace that was saved under {} cannot go on under {}",
                                      scenario.file, text_of(saved.recording), text_of(here.recording)));
  }
}

/// A base that is led from waypoint to waypoint has a next one to remember.
std::string way_of(const std::string& part, const Settings& settings) {
  return (part == "gait" || part == "network") && settings.is_map() && settings.has("waypoints") ? " by waypoints" : "";
}

/// What of a tracker's settings decides what it remembers: impulses where it predicts them, forces until they are
/// passed on, sums of errors.
std::string memory_of(const Settings& tracker) {
  if (!tracker.is_map()) return "";
  std::string out;
  const auto word = [](const Settings& value) { return value.is_scalar() ? value.text() : ""; };
  if (const auto model = tracker.find("model")) {
    if (const std::string name = word(*model); name == "none" || name == "sensed") out += ", model " + name;
  }
  const auto contacts = tracker.find("contacts");
  if (contacts && contacts->is_map() && contacts->has("delay")) out += ", delay " + word(contacts->at("delay"));
  if (tracker.has("ki")) out += ", ki";
  return out;
}

}  // namespace

std::string policy_kind(const PolicySpec& policy) {
  std::string name;
  for (const auto& [key, value] : policy.settings.entries()) {
    if (key != "control") name = key + way_of(key, value);
  }
  const auto control = policy.settings.at("control").entries();
  if (control.empty()) return name;
  return fmt::format("{}, control {}{}", name, control.front().first, memory_of(control.front().second));
}

TraceKind trace_kind(const Scenario& scenario, const PolicySpec& policy) {
  return {numbering_of(scenario.model), policy_kind(policy),  digest_of(scenario.task),
          scenario.recording,           scenario.timing.step, scenario.timing.control};
}

std::uint64_t own_numbers_of(const Particle& particle) {
  RunningDigest digest;
  const Model& model = particle.model;
  for (const Body& body : model.bodies) {
    add_pose(body.X_PB, digest);
    digest.add_all(body.axis), digest.add_all(body.com), digest.add_all(body.inertia);
    for (const double number :
         {body.mass, body.lower, body.upper, body.effort, body.velocity, body.damping, body.friction, body.armature}) {
      digest.add(number);
    }
  }
  for (const Collider& collider : model.colliders) {
    digest.add_all(collider.shape.size);
    add_pose(collider.X_BG, digest);
  }
  for (const ColliderPair& pair : model.pairs) {
    for (const double number : {pair.friction, pair.restitution, pair.spring.stiffness, pair.spring.damping}) {
      digest.add(number);
    }
  }
  for (const Frame& frame : model.frames) add_pose(frame.X_BF, digest);
  digest.add_all(model.gravity);
  digest.add(model.contact_model);
  digest.add(particle.control_lag);
  for (const double zero : particle.joint_zero) digest.add(zero);
  for (const double bias : particle.sensor_bias) digest.add(bias);
  for (const BodyDisturbance& one : particle.disturbances) {
    digest.add(static_cast<int>(one.kind)), digest.add(one.body);
    digest.add_all(one.p_B), digest.add_all(one.impulse_W);
    for (const double number : {one.at, one.duration, one.mass}) digest.add(number);
  }
  return digest.value();
}

void check_saved(const Scenario& scenario, const PolicySpec& policy, const TraceKind& here, const Particle& particle,
                 const SavedTrace* saved) {
  if (!saved || !saved->physics || !saved->kind) {
    throw SavedTraceError(fmt::format("particle {} has no saved trace to go on from; each needs its own", particle.id));
  }
  if (saved->particle != particle.id) {
    throw SavedTraceError(fmt::format("particle {} cannot go on from a trace that was saved of particle {}",
                                      particle.id, saved->particle));
  }
  if (saved->physics->back_end() != scenario.physics) {
    throw SavedTraceError(fmt::format("a trace that was saved under physics '{}' cannot go on under '{}'",
                                      saved->physics->back_end(), scenario.physics));
  }
  check_kind(scenario, policy, here, *saved->kind);
  if (saved->kind->control != here.control || !(saved->time < scenario.timing.end)) {
    throw SavedTraceError(
        fmt::format("a trace that was saved at {} s with control steps of {} s cannot go on where they "
                    "take {} s and the end is at {} s",
                    saved->time, saved->kind->control, here.control, scenario.timing.end));
  }
  if (saved->own != own_numbers_of(particle)) {
    throw SavedTraceError(
        fmt::format("particle {} has other numbers (masses, lengths, friction, biases, …) than when its trace was "
                    "saved; give the particle of the simulation that it was saved in, Simulation::particle({})",
                    particle.id, particle.id));
  }
}

}  // namespace graze
