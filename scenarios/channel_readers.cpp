#include "scenarios/channel_readers.h"

namespace graze {

ChannelReaders::ChannelReaders(const Scenario& scenario) {
  const std::vector<std::string> channels = channel_names(scenario.world->robot);
  for (const std::string& channel : channels) policies_[channel];
  std::map<unsigned, std::vector<int>> needed;  // by what is read; many policies read the same
  for (const PolicySpec& policy : scenario.policies) {
    const auto [found, fresh] = needed.try_emplace(policy.reads);
    if (fresh) found->second = Sensors(scenario.model, channels, {}, policy.reads).needed_channels();
    for (const int channel : found->second) policies_[channels[channel]].push_back(policy.name);
  }
}

std::optional<std::vector<std::string>> ChannelReaders::of(const std::string& parameter) const {
  const auto found = policies_.find(parameter);
  if (found == policies_.end()) return std::nullopt;
  return found->second;
}

bool ChannelReaders::idle(const std::string& parameter) const {
  const auto policies = of(parameter);
  return policies && policies->empty();
}

}  // namespace graze
