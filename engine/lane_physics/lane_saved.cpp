// A lane of the engine as it is, kept and put back.
#include <algorithm>
#include <cassert>
#include <cstddef>

#include "engine/lane_physics/lane_engine.h"

namespace graze {

template <class F>
void LaneEngine::each_kept_row(const F& f) const {
  const LaneBlock& b = block_;
  const TopologyView& t = b.topology;
  const int nb = t.bodies;
  // Numbers of the particle.
  f(b.body, nb * kernel_.body_rows), f(b.gravity, 3), f(b.law, kernel_.law_rows), f(b.limit, 3 * nb);
  f(b.mimic, 2 * b.mimic_count);
  f(b.collider, b.collider_count * kColliderRows), f(b.pair, kPairRows * b.pair_count);
  // State, what settle() makes of it, and the audit.
  f(b.q, t.nq), f(b.v, t.nv), f(b.a, t.nv), f(b.X, 12 * nb);
  f(b.motion, nb * kernel_.motion_rows), f(b.origin, 3 * nb), f(b.balance, nb * kernel_.balance_rows);
  f(b.M, t.row[t.nv]), f(b.bias, t.nv), f(b.pose, 12 * b.collider_count);
  f(b.energy, 1), f(b.energy_audit, kAuditRows), f(b.effort, 4), f(b.measured, 4);
  // Warm starts, but for those of contacts.
  f(b.joint_impulse, 3 * nb), f(b.servo, kServoRows * b.na);
}

LaneEngine::Saved LaneEngine::save(int lane) const {
  const int W = kernel_.lanes;
  Saved out;
  std::size_t total = 0;
  each_kept_row([&](const double*, int count) { total += static_cast<std::size_t>(count); });
  out.rows.reserve(total);
  each_kept_row([&](const double* rows, int count) {
    for (int i = 0; i < count; ++i) out.rows.push_back(rows[i * W + lane]);
  });
  for (std::size_t at = lane; at < grids_.size(); at += W) out.grids.push_back(grids_[at]);
  for (int pair = 0; pair < block_.pair_count; ++pair) {
    for (int slot = 0; slot < kSlots; ++slot) {
      if (!(slot_used_[pair] >> slot & 1)) continue;
      Saved::Slot one{pair, slot, {}};
      const double* rows = kept_of(pair, slot);
      for (int i = 0; i < kKept; ++i) one.kept[i] = rows[i * W + lane];
      if (std::any_of(one.kept.begin(), one.kept.end(), [](double x) { return x != 0; })) out.slots.push_back(one);
    }
  }
  return out;
}

void LaneEngine::restore(int lane, const Saved& saved) {
  const int W = kernel_.lanes;
  forget_contacts(lane);
  const double* from = saved.rows.data();
  each_kept_row([&](double* rows, int count) {
    for (int i = 0; i < count; ++i) rows[i * W + lane] = *from++;
  });
  assert(from == saved.rows.data() + saved.rows.size());
  for (std::size_t field = 0; field < saved.grids.size(); ++field) {
    set_ground(static_cast<int>(field), lane, saved.grids[field]);
  }
  for (const Saved::Slot& one : saved.slots) {
    double* rows = kept_of(one.pair, one.slot);
    for (int i = 0; i < kKept; ++i) rows[i * W + lane] = one.kept[i];
    slot_used_[one.pair] |= 1 << one.slot;
  }
  watch_joints();
}

}  // namespace graze
