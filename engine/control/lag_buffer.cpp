#include "engine/control/lag_buffer.h"

#include <algorithm>
#include <cmath>

namespace graze {

namespace {

constexpr double kTimeSlack = 1e-9;  // s; control times are sums of steps and carry rounding

void copy_column(const BlockArray& from, int lane, BlockArray& to) {
  for (int i = 0; i < from.rows(); ++i) to(i, lane) = from(i, lane);
}

void copy_lane(const Targets& from, int lane, Targets& to) {
  copy_column(from.q, lane, to.q);
  copy_column(from.v, lane, to.v);
  copy_column(from.tau, lane, to.tau);
  copy_column(from.x, lane, to.x);
  copy_column(from.xd, lane, to.xd);
}

}  // namespace

LagBuffer::LagBuffer(Targets initial, double period) : initial_(std::move(initial)), period_(period) {}

void LagBuffer::start(int lane, double lag) {
  Lane& own = lanes_[lane];
  own.issued = 0;
  own.depth = 100 + static_cast<std::size_t>(std::ceil(3 * std::max(lag, 0.0) / period_));
  own.time.assign(own.depth, 0.0);
  if (slots_.size() < own.depth) slots_.resize(own.depth, initial_);
}

void LagBuffer::pass(int lane, double time, double lag, const Targets& targets, Targets& out) {
  Lane& own = lanes_[lane];
  const std::size_t newest = own.issued % own.depth;
  copy_lane(targets, lane, slots_[newest]);
  own.time[newest] = time;
  ++own.issued;
  const double due = time - std::max(lag, 0.0) + kTimeSlack;
  const std::size_t kept = std::min(own.issued, own.depth);
  for (std::size_t age = 0; age < kept; ++age) {
    const std::size_t slot = (own.issued - 1 - age) % own.depth;
    const bool oldest_kept = own.issued > own.depth && age + 1 == kept;
    if (own.time[slot] > due && !oldest_kept) continue;
    copy_lane(slots_[slot], lane, out);
    return;
  }
  copy_lane(initial_, lane, out);
}

}  // namespace graze
