#pragma once
// Which policies a sensor or actuator channel has an effect on: asked of the sensors, which draw and compute only what
// the policy's controller says that it reads.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scenarios/scenario.h"

namespace graze {

class ChannelReaders {
 public:
  explicit ChannelReaders(const Scenario& scenario);

  /// The policies that read the channel that a parameter is about, in the scenario's order. Nothing for a parameter
  /// that is no channel: it is part of the robot or its world.
  std::optional<std::vector<std::string>> of(const std::string& parameter) const;
  /// True for a channel that no policy reads: its error changes no bit.
  bool idle(const std::string& parameter) const;

 private:
  std::map<std::string, std::vector<std::string>> policies_;  // by channel
};

}  // namespace graze
