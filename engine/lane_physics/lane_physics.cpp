#include "engine/lane_physics/lane_physics.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "engine/lanes/isa.h"
#include "engine/physics.h"

namespace graze {

namespace {

constexpr const char* kLanesName = "lanes";

BlockState state_of(const Model& model) {
  return {BlockArray(model.nq), BlockArray(model.nv), BlockArray(model.nv),
          BlockArray(12 * static_cast<int>(model.bodies.size()))};
}

/// Without a branch per number: a zero has no bit but its sign.
bool all_zero(const BlockArray& array) {
  std::uint64_t some = 0;
  for (int i = 0; i < array.rows(); ++i) {
    const double* row = array.row(i);
    for (int lane = 0; lane < kLanes; ++lane) some |= std::bit_cast<std::uint64_t>(row[lane]);
  }
  return some << 1 == 0;
}

/// An engine of more lanes than a register holds spills, and takes twice as long for each.
int best_width() { return chosen_isa() == Isa::avx2 ? 4 : kLanes; }

}  // namespace

/// Lanes first … first + width - 1 of the block. An engine that has not all of them has rows of its own, [row][width],
/// which are copied from and to the block's.
struct LanePhysics::Part {
  static constexpr int kInputs = 10;  // of a Drive and its result

  const int first, width;
  LaneMemory memory;  // of `state` and `inputs`
  StateRows state{};
  double* inputs[kInputs] = {};
  std::unique_ptr<LaneEngine> engine;
  bool stepped = false;  // in the last step

  Part(int first_lane, int lanes, const BlockState& like, int na) : first(first_lane), width(lanes) {
    int rows = kInputs * na;
    for (const BlockArray* array : {&like.q, &like.v, &like.a, &like.X}) rows += array->rows();
    memory.grow(static_cast<std::size_t>(rows) * width);
    double* next = memory.data();
    const auto take = [&](int count) {
      double* const out = next;
      next += static_cast<std::ptrdiff_t>(count) * width;
      return out;
    };
    state = {take(like.q.rows()), take(like.v.rows()), take(like.a.rows()), take(like.X.rows())};
    for (double*& input : inputs) input = take(na);
  }

  unsigned lanes_of(LaneMask mask) const { return mask.bits() >> first & ((1u << width) - 1u); }

  /// The part's columns of an input.
  double* gather(int input, const BlockArray& array) {
    double* to = inputs[input];
    for (int i = 0; i < array.rows(); ++i, to += width) std::copy_n(array.row(i) + first, width, to);
    return inputs[input];
  }
  void scatter(const double* from, BlockArray& array) const {
    for (int i = 0; i < array.rows(); ++i, from += width) std::copy_n(from, width, array.row(i) + first);
  }
};

/// One lane, with the points of its last step.
struct LanePhysics::Saved final : SavedLane {
  struct Point {
    int a, b;
    std::array<double, kContactRows> rows;
  };
  LaneEngine::Saved engine;
  std::vector<Point> points;
  std::optional<std::string> fault;

  explicit Saved(std::uint64_t numbering) : SavedLane(kLanesName, numbering) {}
};

LanePhysics::LanePhysics(const Model& nominal, int width)
    : width_(width > 0 ? width : best_width()), numbering_(numbering_of(nominal)) {
  state_ = state_of(nominal);
  for (const Body& body : nominal.bodies) names_.push_back(body.name);
  const LaneKernel& kernel = kernel_of(chosen_isa(), width_);
  for (int first = 0; first < kLanes; first += width_) {
    Part& part = *parts_.emplace_back(std::make_unique<Part>(first, width_, state_, nominal.na()));
    const StateRows block{state_.q.row(0), state_.v.row(0), state_.a.row(0), state_.X.row(0)};
    part.engine = std::make_unique<LaneEngine>(nominal, kernel, whole() ? block : part.state);
    take_state(part);
  }
}

LanePhysics::~LanePhysics() = default;

const LaneEngine& LanePhysics::engine(int lane) const {
  return *parts_[static_cast<std::size_t>(lane / width_)]->engine;
}

void LanePhysics::take_state(const Part& part) {
  if (whole()) return;
  part.scatter(part.state.q, state_.q);
  part.scatter(part.state.v, state_.v);
  part.scatter(part.state.a, state_.a);
  part.scatter(part.state.X, state_.X);
}

void LanePhysics::start(int lane, const Particle& particle) {
  const Part& part = *parts_[static_cast<std::size_t>(lane / width_)];
  part.engine->start(lane % width_, particle.model, particle.initial);
  take_state(part);
  forget_points(lane);
  fault_[lane].reset();
}

void LanePhysics::push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W) {
  const Part& part = *parts_[static_cast<std::size_t>(lane / width_)];
  part.engine->push(lane % width_, body, p_B, impulse_W);
  take_state(part);
}

void LanePhysics::load(int lane, int body, const Vec3& p_B, double mass) {
  const Part& part = *parts_[static_cast<std::size_t>(lane / width_)];
  part.engine->load(lane % width_, body, p_B, mass);
  take_state(part);
}

void LanePhysics::forget_points(int lane) {
  for (ContactPoint& point : points_) point.lanes.set(lane, false);
  // Not one is left that has no lane: its rows may be those of an earlier restore.
  std::erase_if(points_, [](const ContactPoint& point) { return !point.lanes.any(); });
}

std::shared_ptr<const SavedLane> LanePhysics::save(int lane) const {
  auto out = std::make_shared<Saved>(numbering_);
  out->engine = engine(lane).save(lane % width_);
  for (const ContactPoint& point : points_) {
    if (!point.lanes[lane]) continue;
    Saved::Point& one = out->points.emplace_back(Saved::Point{point.a, point.b, {}});
    for (int i = 0; i < kContactRows; ++i) one.rows[i] = point.row(i)[lane];
  }
  out->fault = fault_[lane];
  return out;
}

void LanePhysics::restore(int lane, const SavedLane& saved) {
  const Saved& from = own<Saved>(saved, kLanesName, numbering_);
  const Part& part = *parts_[static_cast<std::size_t>(lane / width_)];
  part.engine->restore(lane % width_, from.engine);
  take_state(part);
  forget_points(lane);
  BlockArray& rows = restored_[lane];
  rows = BlockArray(static_cast<int>(from.points.size()) * kContactRows);
  LaneMask here;
  here.set(lane);
  int first = 0;
  for (const Saved::Point& point : from.points) {
    for (int i = 0; i < kContactRows; ++i) rows(first + i, lane) = point.rows[i];
    points_.push_back({point.a, point.b, here, rows.row(first)});
    first += kContactRows;
  }
  fault_[lane] = from.fault;
}

LaneMask LanePhysics::physical(LaneMask active) const {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (fault_[lane]) active.set(lane, false);
  }
  return active;
}

template <class Run>
void LanePhysics::step_parts(LaneMask active, const Run& run) {
  for (const auto& part : parts_) {
    const unsigned lanes = part->lanes_of(active);
    part->stepped = whole() || lanes != 0;
    if (!part->stepped) continue;
    run(*part, lanes);
    take_state(*part);
  }
  report_contacts();
  find_faults();
}

void LanePhysics::step(double h, LaneMask active, const BlockArray& tau) {
  step_parts(physical(active), [&](Part& part, unsigned lanes) {
    const double* const rows = tau.rows() == 0 ? nullptr : whole() ? tau.row(0) : part.gather(0, tau);
    part.engine->step(h, lanes, rows);
  });
}

void LanePhysics::drive(double h, LaneMask active, const Drive& drive, DriveResult& result) {
  active = physical(active);
  const int na = drive.tau.rows();
  assert(na == parts_[0]->engine->block().na && result.torque.rows() == na && result.demand.rows() == na);
  if (na == 0) return step(h, active, drive.tau);
  // Prescribed motion is rare, and costs nothing where there is none.
  const bool prescribed = !all_zero(drive.prescribed);
  step_parts(active, [&](Part& part, unsigned lanes) {
    int input = 0;
    const auto rows = [&](const BlockArray& array) { return whole() ? array.row(0) : part.gather(input++, array); };
    const auto results = [&](BlockArray& array) { return whole() ? array.row(0) : part.gather(input++, array); };
    const DriveView view{
        rows(drive.tau),        rows(drive.q),         rows(drive.v),     rows(drive.kp),
        rows(drive.kd),         rows(drive.lower),     rows(drive.upper), prescribed ? rows(drive.prescribed) : nullptr,
        results(result.torque), results(result.demand)};
    part.engine->drive(h, lanes, view);
    if (whole()) return;
    part.scatter(view.torque, result.torque);
    part.scatter(view.demand, result.demand);
  });
}

SolverEffort LanePhysics::effort(int lane) const {
  const LaneEngine& of = engine(lane);
  const int at = lane % width_;
  const SolverSettings& settings = of.block().settings;
  const double sweeps = of.sweeps(at), residual = of.residual(at);
  // Whatever bound ended the solve: one that has converged leaves no more than is accepted.
  return {sweeps, residual, residual > settings.accepted, of.braked(at)};
}

void LanePhysics::find_faults() {
  for (const auto& part : parts_) {
    if (!part->stepped || part->engine->suspect() == 0) continue;
    for (int i = 0; i < width_; ++i) {
      if (part->engine->suspect() >> i & 1) fault_[part->first + i] = why_not_physical(part->first + i);
    }
  }
}

void LanePhysics::report_contacts() {
  points_.clear();
  if (!whole()) return report_contacts_of_parts();
  const LaneBlock& block = parts_[0]->engine->block();
  for (int i = 0; i < block.contact_count; ++i) {
    const PairView& pair = block.pairs[block.report_pair[i]];
    points_.push_back({pair.a, pair.b, LaneMask(block.report_lanes[i]), block.report + i * kContactRows * kLanes});
  }
}

/// Each part's points become points of the block, its rows columns of theirs.
void LanePhysics::report_contacts_of_parts() {
  int count = 0;
  for (const auto& part : parts_) count += part->stepped ? part->engine->block().contact_count : 0;
  if (report_.rows() < count * kContactRows) report_ = BlockArray(2 * count * kContactRows);
  int row = 0;
  for (const auto& part : parts_) {
    if (!part->stepped) continue;
    const LaneBlock& block = part->engine->block();
    for (int i = 0; i < block.contact_count; ++i, row += kContactRows) {
      const double* from = block.report + static_cast<std::ptrdiff_t>(i) * kContactRows * width_;
      for (int k = 0; k < kContactRows; ++k, from += width_)
        std::copy_n(from, width_, report_.row(row + k) + part->first);
      const PairView& pair = block.pairs[block.report_pair[i]];
      points_.push_back({pair.a, pair.b, LaneMask(block.report_lanes[i] << part->first), report_.row(row)});
    }
  }
}

std::string LanePhysics::why_not_physical(int lane) const {
  if (!std::isfinite(energy(lane))) return "state is not finite";
  const LaneEngine& of = engine(lane);
  const int at = lane % width_;
  const double created = of.energy_audit(kCreated, at);
  const double tolerated = of.energy_audit(kLift, at) + kCreatedShare * of.energy_audit(kPeak, at);
  if (created <= tolerated) {
    const auto [body, spin] = of.fastest_spin(at);
    return fmt::format("body '{}' turns at {:.4g} rad/s, more than an eighth of a turn per step", names_[body], spin);
  }
  return fmt::format("{:.4g} J came out of nothing (tolerated: {:.4g} J), {:.4g} J of it in this step", created,
                     tolerated, of.energy_audit(kRise, at));
}

namespace {

std::vector<PhysicsText::ContactModel> contact_models() {
  std::vector<PhysicsText::ContactModel> out;
  for (const LaneContactModel& model : lane_contact_table()) out.push_back({model.name, model.help});
  return out;
}

const PhysicsRegistration lanes_registration(
    kLanesName,
    {"many particles at once, one per SIMD lane: articulated bodies, impulses at velocity level, servos in the solve",
     contact_models()},
    [](const Model& nominal) { return std::make_unique<LanePhysics>(nominal); });

}  // namespace

}  // namespace graze
