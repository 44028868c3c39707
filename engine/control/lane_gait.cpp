#include "engine/control/lane_gait.h"

#include <algorithm>

#include "engine/lanes/block.h"

namespace graze {
namespace {

void put_closed(int lane, const HipKneeOf<double>& from, HipKneeOf<LaneNumber>& to) {
  set_lane(lane, from.o1, to.o1), set_lane(lane, from.w1, to.w1), set_lane(lane, from.w2, to.w2);
  set_lane(lane, from.b, to.b), set_lane(lane, from.d, to.d);
  set_lane(lane, from.o2, to.o2), set_lane(lane, from.upper, to.upper);
  set_lane(lane, from.lower_length, to.lower_length), set_lane(lane, from.bend, to.bend);
  set_lane(lane, from.sign3, to.sign3), set_lane(lane, from.hip, to.hip), set_lane(lane, from.knee, to.knee);
  set_lane(lane, from.reference, to.reference);
  set_lane(lane, from.low, to.low), set_lane(lane, from.high, to.high);
}

}  // namespace

LaneGait::LaneGait(const GaitOf<double>& like) : initial_(static_cast<std::size_t>(like.na)) {
  for (int i = 0; i < like.p.timing.feet; ++i) {
    const LegOf<double>& leg = like.legs[i];
    Leg& own = legs_.emplace_back(Leg{LaneChain(leg.chain), {}, std::nullopt});
    own.reference.resize(static_cast<std::size_t>(leg.chain.n));
    if (leg.closed != nullptr) own.closed.emplace();
  }
  views_.resize(legs_.size());
  view_ = {{like.p, {}, {}, {}, {}}, views_.data(), like.by_joints, like.na, initial_.data()};
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    views_[i].closed = legs_[i].closed ? &*legs_[i].closed : nullptr;
    views_[i].reference = legs_[i].reference.data();
    views_[i].forces = like.legs[i].forces, views_[i].force = like.legs[i].force;
  }
  for (int lane = 0; lane < kLanes; ++lane) put(lane, like);
}

bool LaneGait::fits(const GaitOf<double>& robot) const {
  // Settings are the same for all; only this number follows from the robot and is none of a lane.
  if (robot.p.gravity != view_.p.gravity || robot.na != view_.na) return false;
  if (robot.p.timing.feet != view_.p.timing.feet) return false;
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    const LegOf<double>& leg = robot.legs[i];
    const LegOf<LaneNumber>& own = views_[i];
    if (!legs_[i].chain.fits(leg.chain) || (leg.closed == nullptr) != (own.closed == nullptr)) return false;
    if (!std::equal(leg.force, leg.force + leg.forces, own.force, own.force + own.forces)) return false;
  }
  return true;
}

void LaneGait::put(int lane, const GaitOf<double>& robot) {
  set_lane(lane, robot.p.contact_force, view_.p.contact_force);
  set_lane(lane, robot.p.origin, view_.p.origin);
  set_lane(lane, robot.p.hip, view_.p.hip);
  set_lane(lane, robot.p.reach, view_.p.reach);
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    const LegOf<double>& from = robot.legs[i];
    Leg& to = legs_[i];
    to.chain.put(lane, from.chain);
    views_[i].chain = to.chain.view();
    for (std::size_t k = 0; k < to.reference.size(); ++k) set_lane(lane, from.reference[k], to.reference[k]);
    if (to.closed) put_closed(lane, *from.closed, *to.closed);
  }
  for (std::size_t k = 0; k < initial_.size(); ++k) set_lane(lane, robot.initial[k], initial_[k]);
}

}  // namespace graze
