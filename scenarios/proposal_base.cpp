#include "scenarios/proposal_base.h"

#include <algorithm>
#include <cctype>
#include <limits>
#include <string>
#include <vector>

#include "engine/model/placement.h"

namespace graze {
namespace {

constexpr int kLeastJoints = 3;    // fewer make a pendulum, a flap, a wheel
constexpr double kClearly = 0.25;  // of its reach: what counts as above or below the root

/// Bodies in a row from the base on, until one carries none or several.
int joints_in_a_row(const Model& model) {
  int out = 0;
  for (int at = 0;; ++out) {
    int next = -1, n = 0;
    for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
      if (model.bodies[static_cast<std::size_t>(i)].parent == at) next = i, ++n;
    }
    if (n != 1) return out;
    at = next;
  }
}

bool is_called_base(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.find("base") != std::string::npos || name.find("world") != std::string::npos ||
         name.find("pedestal") != std::string::npos;
}

/// What the chain takes up, from the origin of the base: m.
struct ChainRoom {
  double low = 0, high = 0, reach = 0;
};

ChainRoom room_of_chain(const Model& model, const State& initial) {
  const std::vector<Pose> X_WB = place_bodies(model, initial.q);
  ChainRoom out;
  for (std::size_t i = 1; i < model.bodies.size(); ++i) {
    for (const Vec3& p_B : {Vec3(Vec3::Zero()), model.bodies[i].com}) {
      const Vec3 p = X_WB[i] * p_B - X_WB[0].translation();
      out.low = std::min(out.low, p.z());
      out.high = std::max(out.high, p.z());
      out.reach = std::max(out.reach, p.norm());
    }
  }
  return out;
}

}  // namespace

int joints_of_bolted_arm(const Robot& robot, const Model& model, const State& initial) {
  if (!model.floating_base || robot.links.empty()) return 0;
  const int joints = joints_in_a_row(model);
  if (joints < kLeastJoints) return 0;
  const ChainRoom room = room_of_chain(model, initial);
  if (room.low < -kClearly * room.reach) return 0;
  const Link& root = robot.links.front();
  const bool bolted = !(root.inertia.mass > 0) || is_called_base(root.name) || room.high > kClearly * room.reach;
  return bolted ? joints : 0;
}

std::array<double, 2> bent_leg(const Chain& leg, Chain::Values angles, const std::array<double, 2>& low,
                               const std::array<double, 2>& high) {
  constexpr int kSteps = 60;
  constexpr double kBent = 0.85;
  const auto try_all = [&](const auto& act) {
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        angles[1] = low[0] + (high[0] - low[0]) * i / kSteps;
        angles[2] = low[1] + (high[1] - low[1]) * j / kSteps;
        const Chain::Skeleton at = leg.skeleton(angles);
        act(Vec3(at.tip - at.origin[1]));
      }
    }
  };
  double reach = 0, least = std::numeric_limits<double>::infinity();
  std::array<double, 2> best = {angles[1], angles[2]};
  try_all([&](const Vec3& foot) { reach = std::max(reach, -foot.z()); });
  try_all([&](const Vec3& foot) {
    const double down = -foot.z() - kBent * reach, off = foot.x() * foot.x() + down * down;
    if (off < least) least = off, best = {angles[1], angles[2]};
  });
  return best;
}

}  // namespace graze
