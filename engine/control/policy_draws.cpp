#include "engine/control/policy_draws.h"

#include <cmath>

#include "sampling/stream.h"

namespace graze {

PolicyDraws::PolicyDraws(std::uint64_t seed, std::string policy, double period)
    : seed_(seed), policy_(std::move(policy)), period_(period) {}

std::uint64_t PolicyDraws::name_of(int number) {
  while (static_cast<int>(names_.size()) <= number) {
    // No parameter or channel begins like this, and no policy's name has a '#'.
    names_.push_back(name_hash("policy." + policy_ + "#" + std::to_string(names_.size())));
  }
  return names_[static_cast<std::size_t>(number)];
}

double PolicyDraws::uniform(int lane, int number) {
  const auto step = static_cast<std::uint32_t>(std::llround(time_[lane] / period_));
  return graze::uniform(seed_, particle_[lane], name_of(number), step);
}

double PolicyDraws::uniform_of_trace(int lane, int number) {
  return graze::uniform(seed_, particle_[lane], name_of(number), kPersistent);
}

}  // namespace graze
