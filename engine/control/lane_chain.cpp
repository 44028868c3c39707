#include "engine/control/lane_chain.h"

#include <algorithm>

#include "engine/lanes/block.h"

namespace graze {

static_assert(kTableLanes == kLanes);

LaneChain::LaneChain(const ChainView& like) : joints_(static_cast<std::size_t>(like.n)) {
  for (int i = 0; i < like.n; ++i) {
    joints_[i].prismatic = like.joint[i].prismatic;
    joints_[i].actuator = like.joint[i].actuator;
  }
}

bool LaneChain::fits(const ChainView& chain) const {
  return std::equal(joints_.begin(), joints_.end(), chain.joint, chain.joint + chain.n, [](auto& own, auto& other) {
    return own.prismatic == other.prismatic && own.actuator == other.actuator;
  });
}

void LaneChain::put(int lane, const ChainView& chain) {
  for (int i = 0; i < chain.n; ++i) {
    const ChainJointView& from = chain.joint[i];
    ChainJointOf<LaneNumber>& to = joints_[i];
    set_lane(lane, from.lower, to.lower), set_lane(lane, from.upper, to.upper);
    set_lane(lane, from.fixed, to.fixed);
    set_lane(lane, from.cosine, to.cosine), set_lane(lane, from.sine, to.sine);
    set_lane(lane, from.offset, to.offset), set_lane(lane, from.axis, to.axis);
    set_lane(lane, from.mass, to.mass), set_lane(lane, from.com, to.com), set_lane(lane, from.inertia, to.inertia);
    set_lane(lane, from.armature, to.armature);
  }
  set_lane(lane, chain.tip, tip_);
}

ChainOf<LaneNumber> LaneChain::view() const {
  return {static_cast<int>(joints_.size()), joints_.data(), {tip_[0], tip_[1], tip_[2]}};
}

}  // namespace graze
