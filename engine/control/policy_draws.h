#pragma once
// Random numbers of a policy, for those that do not do the same in every trace. Each is keyed by the seed, the
// particle, the policy's name, the control step and its own number (sampling/stream.h), so that a trace is the same in
// any lane, block and thread, after a restart and in a replay, and draws nothing that sensors or other policies draw.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/lanes/block.h"

namespace graze {

class PolicyDraws {
 public:
  PolicyDraws() = default;
  /// `period`: s, of a control step, by which steps are counted from the start of the trace.
  PolicyDraws(std::uint64_t seed, std::string policy, double period);

  /// Uniform in (0,1), fresh at every control step; `number` tells several of one step apart. For Policy::act. The
  /// quantiles of sampling/distribution.h make any other distribution of it.
  double uniform(int lane, int number = 0);
  /// The same, one for the whole trace; from Policy::start on.
  double uniform_of_trace(int lane, int number = 0);

  // What follows is the Controller's.
  void start(int lane, std::uint32_t particle) { particle_[lane] = particle; }
  /// `time`: of the observation, s.
  void begin_step(const std::array<double, kLanes>& time) { time_ = time; }

 private:
  std::uint64_t name_of(int number);

  std::uint64_t seed_ = 0;
  std::string policy_;
  double period_ = 1;
  std::vector<std::uint64_t> names_;  // name_hash() of each number that was asked for
  std::array<std::uint32_t, kLanes> particle_{};
  std::array<double, kLanes> time_{};
};

}  // namespace graze
