#include "engine/control/lag_buffer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/control/rows.h"

namespace graze {

namespace {

constexpr double kTimeSlack = 1e-9;   // s; control times are sums of steps and carry rounding
constexpr std::size_t kFewest = 100;  // control steps kept, and the first that memory is taken for

}  // namespace

LagBuffer::LagBuffer(Targets initial, double period, double end, TargetKind kind)
    : initial_(std::move(initial)),
      delayed_(initial_),
      period_(period),
      longest_(std::ceil(end / period) + 1),
      kept_{&Targets::tau} {
  if (kind == TargetKind::effector) {
    kept_.insert(kept_.end(), {&Targets::x, &Targets::xd});
  } else {
    kept_.insert(kept_.end(), {&Targets::q, &Targets::v});
  }
}

void LagBuffer::start(int lane, double lag) {
  Lane& own = lanes_[lane];
  constexpr double kMost = 1e9;  // control steps: as many as the longest trace that a scenario may have
  const double steps = std::ceil(3 * std::max(lag, 0.0) / period_);
  own.depth = kFewest + static_cast<std::size_t>(std::min({steps, longest_, kMost}));
  grow(kFewest);
  own.issued = 0;
  own.time.assign(slots_.size(), 0.0);
  own.head = common_head();
}

void LagBuffer::know(int lane, const LagBuffer& other) {
  for (const auto part : kept_) {
    BlockArray& own = initial_.*part;
    for (int i = 0; i < own.rows(); ++i) own(i, lane) = (other.initial_.*part)(i, lane);
  }
}

std::size_t LagBuffer::common_head() const {
  const auto longest =
      std::max_element(lanes_.begin(), lanes_.end(), [](const Lane& a, const Lane& b) { return a.issued < b.issued; });
  return longest->head;
}

void LagBuffer::carry(int lane, LaneTape& tape) {
  Lane& own = lanes_[lane];
  std::size_t issued = own.issued;
  tape.carry(issued), tape.carry(own.depth);
  const std::size_t kept = std::min(issued, own.depth);  // as many slots there are: make_room
  if (tape.reads()) {
    own.issued = 0;
    grow(std::max(kept, kFewest));
    own.time.assign(slots_.size(), 0.0);
    own.head = common_head();
    own.issued = issued;
  }
  for (std::size_t age = 0; age < kept; ++age) {
    const std::size_t slot = before(own.head, age);
    tape.carry(own.time[slot]);
    for (const auto part : kept_) tape.carry(slots_[slot].*part, lane);
  }
}

void LagBuffer::grow(std::size_t slots) {
  if (slots <= slots_.size()) return;
  const std::vector<Targets> old = std::exchange(slots_, std::vector<Targets>(slots, initial_));
  for (int lane = 0; lane < kLanes; ++lane) {
    Lane& own = lanes_[lane];
    const std::vector<double> time = std::exchange(own.time, std::vector<double>(slots, 0.0));
    for (std::size_t age = 0; age < std::min({own.issued, own.depth, old.size()}); ++age) {
      const std::size_t from = (own.head + old.size() - age) % old.size(), to = before(own.head, age);
      own.time[to] = time[from];
      LaneMask only;
      only.set(lane);
      for (const auto part : kept_) {
        const BlockArray& source = old[from].*part;
        for (int i = 0; i < source.rows(); ++i) copy_lanes((slots_[to].*part).row(i), source.row(i), only);
      }
    }
  }
}

/// Twice as many slots when a lane is about to overwrite targets that it may still need.
void LagBuffer::make_room(LaneMask active) {
  std::size_t most = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    const Lane& own = lanes_[lane];
    if (active[lane] && own.issued >= slots_.size()) most = std::max(most, own.depth);
  }
  if (most > slots_.size()) grow(std::min(most, 2 * slots_.size()));
}

void LagBuffer::record(const std::array<double, kLanes>& time, LaneMask active, const Targets& targets) {
  make_room(active);
  std::array<LaneMask, kLanes> together;  // lanes by the first of those that write the same slot
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!active[lane]) continue;
    Lane& own = lanes_[lane];
    own.head = own.head + 1 == slots_.size() ? 0 : own.head + 1;
    own.time[own.head] = time[lane];
    ++own.issued;
    int first = 0;
    while (!active[first] || lanes_[first].head != own.head) ++first;
    together[first].set(lane);
  }
  for (int first = 0; first < kLanes; ++first) {
    if (!together[first].any()) continue;
    Targets& slot = slots_[lanes_[first].head];
    for (const auto part : kept_) {
      const BlockArray& source = targets.*part;
      for (int i = 0; i < source.rows(); ++i) copy_lanes((slot.*part).row(i), source.row(i), together[first]);
    }
  }
}

int LagBuffer::age_in_force(const Lane& lane, double due) const {
  const int kept = static_cast<int>(std::min(lane.issued, lane.depth));
  const auto issued_at = [&](int age) { return lane.time[before(lane.head, static_cast<std::size_t>(age))]; };
  // Times grow: from a guess to the newest that is due.
  const double steps = std::floor((lane.time[lane.head] - due) / period_);
  int age = static_cast<int>(std::clamp(steps, 0.0, kept - 1.0));
  while (age > 0 && issued_at(age - 1) <= due) --age;
  while (age < kept && issued_at(age) > due) ++age;
  if (age < kept) return age;
  return lane.issued > lane.depth ? kept - 1 : kInitial;
}

const Targets& LagBuffer::pass(const std::array<double, kLanes>& time, const std::array<double, kLanes>& lag,
                               LaneMask active, const Targets& targets) {
  record(time, active, targets);
  std::array<const Targets*, kLanes> in_force;
  in_force.fill(&initial_);
  bool at_once = true;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!active[lane]) continue;
    const Lane& own = lanes_[lane];
    const int age = age_in_force(own, time[lane] - std::max(lag[lane], 0.0) + kTimeSlack);
    if (age != 0) at_once = false;
    if (age != kInitial) in_force[lane] = &slots_[before(own.head, static_cast<std::size_t>(age))];
  }
  if (at_once) return targets;
  for (const auto part : kept_) {
    BlockArray& out = delayed_.*part;
    if (out.rows() == 0) continue;
    std::array<const double*, kLanes> from;
    for (int lane = 0; lane < kLanes; ++lane) from[lane] = ((*in_force[lane]).*part).row(0) + lane;
    for (int i = 0; i < out.rows(); ++i) {
      double* const row = out.row(i);
      for (int lane = 0; lane < kLanes; ++lane) row[lane] = from[lane][i * kLanes];
    }
  }
  return delayed_;
}

}  // namespace graze
