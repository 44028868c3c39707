#include "simulation/saved_trace.h"

#include <fmt/format.h>

namespace graze {

std::string policy_kind(const PolicySpec& policy) {
  std::string name;
  for (const auto& [key, value] : policy.settings.entries()) {
    if (key != "control") name = key;
  }
  const auto control = policy.settings.at("control").entries();
  return control.empty() ? name : fmt::format("{}, control {}", name, control.front().first);
}

void check_saved(const Scenario& scenario, const PolicySpec& policy, std::uint32_t particle, const SavedTrace* saved) {
  if (!saved || !saved->physics) {
    throw InputError(fmt::format("particle {} has no saved trace to go on from; each needs its own", particle));
  }
  if (saved->particle != particle) {
    throw InputError(
        fmt::format("particle {} cannot go on from a trace that was saved of particle {}", particle, saved->particle));
  }
  if (saved->physics->back_end() != scenario.physics) {
    throw InputError(fmt::format("a trace that was saved under physics '{}' cannot go on under '{}'",
                                 saved->physics->back_end(), scenario.physics));
  }
  if (saved->physics->numbering() != numbering_of(scenario.model)) {
    throw InputError(
        fmt::format("{}: a trace of another robot or world cannot go on here: bodies, joints, shapes, "
                    "meshes or terrain differ",
                    scenario.file));
  }
  const std::string kind = policy_kind(policy);
  if (saved->policy_kind != kind) {
    throw InputError(
        fmt::format("a trace that was saved under a policy of the kind '{}' cannot go on under {}, which "
                    "is of the kind '{}'",
                    saved->policy_kind, policy.name, kind));
  }
  if (saved->period != scenario.timing.control || !(saved->time < scenario.timing.end)) {
    throw InputError(
        fmt::format("a trace that was saved at {} s with control steps of {} s cannot go on where they "
                    "take {} s and the end is at {} s",
                    saved->time, saved->period, scenario.timing.control, scenario.timing.end));
  }
}

}  // namespace graze
