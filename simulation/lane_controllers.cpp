#include "simulation/lane_controllers.h"

#include <stdexcept>

namespace graze {

LaneControllers::LaneControllers(const ControlContext& context, const Settings& policy)
    : context_(context), policy_(policy), common_(context, policy) {
  in_.fill(&common_);
}

void LaneControllers::start(int lane, const Particle& particle, bool informed) {
  in_[lane] = &common_;
  if (informed || knows_other_[lane]) {
    const ControlContext& c = context_;
    own_[lane] = std::make_unique<Controller>(
        informed ? ControlContext{particle.model, particle.initial, c.period, c.solves_drives, c.end, c.seed, c.name}
                 : c,
        policy_);
    if (own_[lane]->reads() & ~common_.reads())
      throw std::logic_error("a policy reads more of one robot than of another");
    if (!common_.know(lane, *own_[lane])) in_[lane] = own_[lane].get();
    knows_other_.set(lane, informed);
  }
  in_[lane]->start(lane, particle.control_lag, particle.id);
}

void LaneControllers::act(const Observation& observation, const double* lag_jitter, LaneMask active,
                          ActuatorCommand& command) {
  LaneMask rest = active;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!rest[lane]) continue;
    LaneMask together;
    for (int other = lane; other < kLanes; ++other) together.set(other, rest[other] && in_[other] == in_[lane]);
    in_[lane]->act(observation, lag_jitter, together, command);
    rest = LaneMask(rest.bits() & ~together.bits());
  }
}

}  // namespace graze
