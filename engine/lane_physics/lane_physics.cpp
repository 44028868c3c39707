#include "engine/lane_physics/lane_physics.h"

#include <fmt/format.h>

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

const std::vector<std::string>& lane_contact_models() {
  static const std::vector<std::string> names = {"complementarity", "complementarity_free", "compliant"};
  return names;
}

LanePhysics::LanePhysics(const Model& nominal)
    : engine_(nominal, kernel_of(chosen_isa(), kLanes), prepare(state_, nominal),
              std::make_unique<bullet::ConvexPairs>(nominal, kLanes)) {}

void LanePhysics::start(int lane, const Particle& particle) {
  engine_.start(lane, particle.model, particle.initial);
  for (ContactPoint& point : points_) point.lanes.set(lane, false);
  fault_[lane].reset();
  Budget& budget = budget_[lane];
  budget = {};
  budget.start = engine_.energy(lane);
  double weight = 0;
  for (const Body& body : particle.model.bodies) weight += body.mass * particle.model.gravity.norm();
  // Numbers that begin in overlap are lifted out of it: 5 cm, far more than any sensible start.
  budget.reserve = 1e-3 + 0.05 * weight;
}

void LanePhysics::step(double h, LaneMask active, const BlockArray& tau) {
  engine_.step(h, active.bits(), tau.rows() > 0 ? tau.row(0) : nullptr);
  report_contacts();
  for (int lane = 0; lane < kLanes; ++lane) {
    if (active[lane]) audit(lane);
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

/// A state is no longer physical when it is not finite, or has more energy than it began with and was given. The
/// integrator is of first order, so a fraction of the energy that has changed hands is tolerated.
void LanePhysics::audit(int lane) {
  if (fault_[lane]) return;
  Budget& budget = budget_[lane];
  const double energy = engine_.energy(lane), work = engine_.work(lane);
  budget.work += work;
  budget.turnover += std::abs(work);
  if (!std::isfinite(energy)) {
    fault_[lane] = "the state is not finite";
    return;
  }
  const double allowed = budget.start + budget.work + 0.5 * budget.turnover + budget.reserve;
  if (energy > allowed + 0.1 * std::abs(energy)) {
    fault_[lane] = fmt::format("the energy is {:.4g} J; it began with {:.4g} J and the joints put in {:.4g} J", energy,
                               budget.start, budget.work);
  }
}

}  // namespace graze
