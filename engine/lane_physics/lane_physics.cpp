#include "engine/lane_physics/lane_physics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/bullet/convex_pairs.h"
#include "engine/lanes/isa.h"

namespace graze {

namespace {

BlockState state_of(const Model& model) {
  return {BlockArray(model.nq), BlockArray(model.nv), BlockArray(model.nv),
          BlockArray(12 * static_cast<int>(model.bodies.size()))};
}

double* rows_of(BlockArray& array) { return array.rows() > 0 ? array.row(0) : nullptr; }

StateRows rows_of(BlockState& state) {
  return {rows_of(state.q), rows_of(state.v), rows_of(state.a), rows_of(state.X)};
}

/// Fills the state first, because the engine keeps pointers into it.
StateRows prepare(BlockState& state, const Model& model) {
  state = state_of(model);
  return rows_of(state);
}

}  // namespace

LanePhysics::LanePhysics(const Model& nominal)
    : engine_(nominal, kernel_of(chosen_isa(), kLanes), prepare(state_, nominal),
              std::make_unique<bullet::ConvexPairs>(nominal, kLanes)) {}

void LanePhysics::start(int lane, const Particle& particle) {
  engine_.start(lane, particle.model, particle.initial);
  for (ContactPoint& point : points_) point.lanes.set(lane, false);
  fault_[lane].reset();
}

void LanePhysics::step(double h, LaneMask active, const BlockArray& tau) {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (fault_[lane]) active.set(lane, false);  // what is no longer physical stands still
  }
  engine_.step(h, active.bits(), tau.rows() > 0 ? tau.row(0) : nullptr);
  report_contacts();
  find_faults();
}

void LanePhysics::drive(double h, LaneMask active, const Drive& drive, DriveResult& result) {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (fault_[lane]) active.set(lane, false);
  }
  const int na = drive.tau.rows();
  assert(na == engine_.block().na && result.torque.rows() == na && result.asked.rows() == na);
  if (na == 0) {
    engine_.step(h, active.bits(), nullptr);
  } else {
    // Prescribed motion is rare, and costs nothing where there is none.
    bool prescribed = false;
    for (int k = 0; k < na; ++k) {
      for (int lane = 0; lane < kLanes; ++lane) prescribed |= drive.prescribed(k, lane) != 0;
    }
    const DriveView view{
        drive.tau.row(0), drive.q.row(0),     drive.v.row(0),     drive.kp.row(0),
        drive.kd.row(0),  drive.lower.row(0), drive.upper.row(0), prescribed ? drive.prescribed.row(0) : nullptr};
    engine_.drive(h, active.bits(), view);
  }
  for (int k = 0; k < na; ++k) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      // A row's impulse is at its bound to rounding.
      result.torque(k, lane) = std::min(std::max(engine_.torque(k)[lane], drive.lower(k, lane)), drive.upper(k, lane));
      result.asked(k, lane) = engine_.asked(k)[lane];
    }
  }
  report_contacts();
  find_faults();
}

SolverEffort LanePhysics::effort(int lane) const {
  const SolverSettings& settings = engine_.block().settings;
  const double sweeps = engine_.sweeps(lane), residual = engine_.residual(lane);
  return {sweeps, residual, sweeps >= settings.most_sweeps && residual > settings.tolerance};
}

void LanePhysics::find_faults() {
  if (engine_.suspect() == 0) return;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (engine_.suspect() >> lane & 1) fault_[lane] = why_not_physical(lane);
  }
}

void LanePhysics::report_contacts() {
  const LaneBlock& block = engine_.block();
  points_.clear();
  for (int i = 0; i < block.contact_count; ++i) {
    const PairView& pair = block.pairs[block.report_pair[i]];
    points_.push_back({pair.a, pair.b, LaneMask(block.report_lanes[i]), block.report + i * kContactRows * kLanes});
  }
}

std::string LanePhysics::why_not_physical(int lane) const {
  if (!std::isfinite(engine_.energy(lane))) return "state is not finite";
  const double spin = std::sqrt(engine_.ledger(kSpin2, lane));
  const double created = engine_.ledger(kCreated, lane);
  const double tolerated = engine_.ledger(kLift, lane) + kCreatedShare * engine_.ledger(kPeak, lane);
  if (created <= tolerated) {
    return fmt::format("a body turns at {:.4g} rad/s, more than an eighth of a turn per step", spin);
  }
  return fmt::format("{:.4g} J came out of nothing (tolerated: {:.4g} J), {:.4g} J of it in this step", created,
                     tolerated, engine_.ledger(kRise, lane));
}

}  // namespace graze
