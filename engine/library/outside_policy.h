#pragma once
// What policies have in common whose controller is the user's own code (library, python).

#include <cstdint>
#include <string>
#include <vector>

#include "engine/control/policy.h"
#include "engine/library/library_use.h"

namespace graze {

class OutsidePolicy : public Policy {
 protected:
  OutsidePolicy(const ControlContext& context, LibraryUse use);

  const LibraryUse& use() const { return use_; }
  int joints() const { return static_cast<int>(names_.size()); }
  const std::vector<std::string>& joint_names() const { return names_; }

  /// Throws LibraryRefused that says why the controller does not run here.
  [[noreturn]] void refuse() const;
  /// 64 bits of (campaign's seed, particle, policy).
  std::uint64_t seed(int lane) const;
  /// s in the trace, of the first active lane.
  static double time_of(const Observation& observation, LaneMask active);
  /// Targets before a call, [joint][lane]: positions of the nominal initial state, velocities and torques 0.
  void preset(double* q, double* v, double* tau) const;
  /// Hands over what is wanted, of which there are a row per joint or more. Returns "asks joint hinge for a torque of
  /// nan, …" if some of it is no number, else nothing.
  std::string take(const Targets& wanted, LaneMask active, Targets& targets) const;

 private:
  std::string not_finite(const Targets& wanted, int lane) const;

  const LibraryUse use_;
  const std::vector<std::string> names_;
  const std::vector<double> initial_;
  PolicyDraws* const draws_;
};

}  // namespace graze
