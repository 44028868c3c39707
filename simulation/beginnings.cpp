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

void check_beginnings(const Scenario& scenario, std::size_t particles, std::span<const Beginning> beginnings) {
  if (beginnings.empty()) return;
  if (beginnings.size() != particles) {
    throw InputError(fmt::format("{} beginnings for {} particles; each needs its own", beginnings.size(), particles));
  }
  const Model& model = scenario.model;
  const Timing& timing = scenario.timing;
  for (const auto& [time, state] : beginnings) {
    const double periods = std::round(time / timing.control);
    if (!(time >= 0 && time < timing.end) || std::abs(time - periods * timing.control) > 1e-9 * timing.control) {
      throw InputError(
          fmt::format("a trace cannot begin at {} s: it begins at a control step (every {} s) before the end ({} s)",
                      time, timing.control, timing.end));
    }
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
}

}  // namespace graze
