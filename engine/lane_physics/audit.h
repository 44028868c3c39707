#pragma once
// Whether a step was physical. The balance of a step's kinetic energy is known to rounding: torques, gravity and
// impulses do work with the mean of v and v*, and free motion does none. Of dampers what they give counts, not what
// they take. What it shows beyond that came out of nothing.

#include "engine/lane_physics/block_view.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Squared speed of the fastest spin, rad^2/s^2.
template <class T>
inline T fastest_spin2(const TreeT<T>& tree) {
  T fastest(0.0);
  for (int i = 0; i < tree.topology.bodies; ++i) fastest = max(fastest, norm2(tree.motion[i].V.w));
  return fastest;
}

/// Enters a step that had kinetic energy `before` and work done on it, and marks lanes that are not physical.
template <class T>
inline void audit(LaneBlock& block, const TreeT<T>& tree, double h, unsigned active, const T& before,
                  const T& impulse_work, const T& gravity_work, const T& torque_work) {
  T* energy_audit = rows<T>(block.energy_audit);
  const auto live = mask_from_bits<T>(active);
  const T now = energy_audit[kKinetic], spin2 = fastest_spin2(tree);
  const T turn2 = T(h * h) * max(spin2, energy_audit[kSpin2]);
  const T given = impulse_work + gravity_work + torque_work;
  const T turnover = abs(impulse_work) + abs(gravity_work) + abs(torque_work);
  // The attitude's step leaves an error of third order in the spin of a tree; the rest is rounding.
  const T allowed = fma(turn2 * sqrt(turn2), before, T(1e-10) * (before + now + turnover));
  const T rise = max(now - before - given - allowed, T(0.0));
  energy_audit[kSpin2] = spin2;
  energy_audit[kRise] = select(live, rise, energy_audit[kRise]);
  energy_audit[kCreated] = select(live, energy_audit[kCreated] + rise, energy_audit[kCreated]);
  energy_audit[kPeak] = select(live, max(energy_audit[kPeak], before), energy_audit[kPeak]);
  const T tolerated = fma(T(kCreatedShare), energy_audit[kPeak], energy_audit[kLift]);
  const auto sound = (abs(*rows<T>(block.energy)) < T(1e300)) & (energy_audit[kCreated] <= tolerated) &
                     (turn2 <= T(kLargestTurn * kLargestTurn));
  block.suspect = active & ~bits(sound);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
