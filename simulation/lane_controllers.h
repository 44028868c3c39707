#pragma once
// The controllers of a block: one for all lanes, which knows the nominal robot, or in each lane the lane's, so that
// designs that plan with their own numbers share a block. Lanes whose robots one controller cannot know together have
// one each.

#include <array>
#include <memory>

#include "engine/control/policy.h"
#include "engine/model/fabrication.h"

namespace graze {

class LaneControllers {
 public:
  /// What `context` and `policy` refer to outlives this. Throws InputError as Controller does.
  LaneControllers(const ControlContext& context, const Settings& policy);

  /// Groups of the observation that they read (SensedGroup).
  unsigned reads() const { return common_.reads(); }
  /// `informed`: the lane's controller knows `particle` (which outlives the trace) in place of the nominal robot.
  /// Throws InputError if the policy is none for it.
  void start(int lane, const Particle& particle, bool informed);
  void carry(int lane, LaneTape& tape) { in_[lane]->carry(lane, tape); }
  /// As Controller::act. Whose controller is asked for one lane gives the bits that one for all lanes gives.
  void act(const Observation& observation, const double* lag_jitter, LaneMask active, ActuatorCommand& command);
  const Controller& of(int lane) const { return *in_[lane]; }

 private:
  const ControlContext context_;
  const Settings& policy_;
  Controller common_;
  std::array<std::unique_ptr<Controller>, kLanes> own_;
  std::array<Controller*, kLanes> in_;  // charge of each lane
  LaneMask knows_other_;                // lanes in which `common_` may know another robot than the nominal one
};

}  // namespace graze
