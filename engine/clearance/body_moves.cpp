#include "engine/clearance/body_moves.h"

#include <algorithm>
#include <cassert>

#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/isa.h"

namespace graze {

BodyMoves::BodyMoves(std::vector<int> bodies)
    : kernel_(&kernel_of(chosen_isa(), kLanes)), bodies_(std::move(bodies)), fresh_(LaneMask::all()) {
  const int count = static_cast<int>(bodies_.size());
  last_ = BlockArray(12 * count), turn_ = BlockArray(count), way_ = BlockArray(count);
}

void BodyMoves::look(const BlockState& state) {
  if (seen_ || bodies_.empty()) return;
  kernel_->add_moves({static_cast<int>(bodies_.size()), bodies_.data(), state.X.row(0), fresh_.bits(), last_.row(0),
                      turn_.row(0), way_.row(0)});
  fresh_ = LaneMask();
  seen_ = true;
}

int BodyMoves::row_of(int body) const {
  const auto at = std::find(bodies_.begin(), bodies_.end(), body);
  assert(at != bodies_.end());
  return static_cast<int>(at - bodies_.begin());
}

}  // namespace graze
