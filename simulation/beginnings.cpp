#include "simulation/beginnings.h"

#include <fmt/format.h>

#include <cmath>

namespace graze {

std::uint32_t first_step(const Timing& timing, const Beginning& beginning) {
  return static_cast<std::uint32_t>(std::round(beginning.time / timing.control)) *
         static_cast<std::uint32_t>(timing.steps_per_control());
}

std::vector<Particle> begun_elsewhere(std::span<const Particle> particles, std::span<const Beginning> beginnings) {
  std::vector<Particle> out(particles.begin(), particles.end());
  for (std::size_t i = 0; i < out.size(); ++i) out[i].initial = beginnings[i].state;
  return out;
}

namespace {

double end_of(const Scenario& scenario, const RunOptions& options) {
  return options.end > 0 ? options.end : scenario.timing.end;
}

void check_end(const Timing& timing, double end) {
  if (end == 0) return;
  const double steps = std::round(end / timing.step);
  if (end > 0 && end <= timing.end + 1e-9 * timing.step && std::abs(end - steps * timing.step) <= 1e-9 * timing.end)
    return;
  throw InputError(
      fmt::format("traces cannot end at {} s: they end at a physics step (every {} s) no later than the "
                  "scenario's end ({} s)",
                  end, timing.step, timing.end));
}

void check_state(const Model& model, const State& state) {
  if (state.q.size() != model.nq || state.v.size() != model.nv || !state.q.allFinite() || !state.v.allFinite()) {
    throw InputError(
        fmt::format("a trace cannot begin in a state of {} positions and {} velocities; it has {} and "
                    "{}, all finite",
                    state.q.size(), state.v.size(), model.nq, model.nv));
  }
  for (const Body& body : model.bodies) {
    if (body.type != JointType::floating || std::abs(state.q.segment<4>(body.q).norm() - 1) < 1e-6) continue;
    throw InputError(fmt::format("a trace cannot begin with {} turned by a quaternion of length {}; it has length 1",
                                 body.name, state.q.segment<4>(body.q).norm()));
  }
}

void check_memory(const Scenario& scenario, const PolicySpec& policy, const Beginning& beginning) {
  const ControllerMemory& memory = *beginning.memory;
  if (memory.numbering != numbering_of(scenario.model)) {
    throw SavedTraceError(
        fmt::format("{}: what the controller of another robot or world remembers is of no use here", scenario.file));
  }
  if (memory.policy != policy_kind(policy)) {
    throw SavedTraceError(fmt::format(
        "what a policy of the kind '{}' remembers is of no use to {}, which is of the kind '{}'; without it "
        "the policy starts afresh",
        memory.policy, policy.name, policy_kind(policy)));
  }
  if (std::abs(memory.time - beginning.time) > 1e-9 * scenario.timing.control) {
    throw SavedTraceError(
        fmt::format("a trace cannot begin at {} s with what its controller knew at {} s", beginning.time, memory.time));
  }
}

}  // namespace

void check_beginnings(const Scenario& scenario, const PolicySpec& policy, std::size_t particles,
                      const RunOptions& options) {
  const Timing& timing = scenario.timing;
  check_end(timing, options.end);
  if (options.beginnings.empty()) return;
  if (options.beginnings.size() != particles) {
    throw InputError(
        fmt::format("{} beginnings for {} particles; each needs its own", options.beginnings.size(), particles));
  }
  const double end = end_of(scenario, options);
  for (const Beginning& one : options.beginnings) {
    const double periods = std::round(one.time / timing.control);
    if (!(one.time >= 0 && one.time < end) || std::abs(one.time - periods * timing.control) > 1e-9 * timing.control) {
      throw InputError(
          fmt::format("a trace cannot begin at {} s: it begins at a control step (every {} s) before the end ({} s)",
                      one.time, timing.control, end));
    }
    check_state(scenario.model, one.state);
    if (one.memory) check_memory(scenario, policy, one);
  }
}

void check_saved(const Scenario& scenario, const PolicySpec& policy, std::span<const Particle> particles,
                 const RunOptions& options) {
  if (options.saved.empty()) return;
  if (!options.beginnings.empty()) {
    throw SavedTraceError("a trace cannot both go on from where it was saved and begin elsewhere; give one of the two");
  }
  if (options.saved.size() != particles.size()) {
    throw SavedTraceError(
        fmt::format("{} saved traces for {} particles; each needs its own", options.saved.size(), particles.size()));
  }
  const TraceKind here = trace_kind(scenario, policy);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    check_saved(scenario, policy, here, particles[i], options.saved[i].get());
  }
}

}  // namespace graze
