#include "engine/actuation/limb_inertia.h"

#include <map>

#include "engine/model/rotation.h"

namespace graze {

std::vector<LimbInertia> limbs_of(const Model& model) {
  std::vector<LimbInertia> limbs;
  std::map<int, std::pair<std::size_t, int>> place;  // body -> limb, link
  for (int k = 0; k < model.na(); ++k) {
    const int index = model.actuated[k];
    const Body& body = model.bodies[index];
    const auto parent = place.find(body.parent);
    if (parent == place.end()) limbs.emplace_back();
    const std::size_t limb = parent == place.end() ? limbs.size() - 1 : parent->second.first;
    const int above = parent == place.end() ? -1 : parent->second.second;
    place[index] = {limb, static_cast<int>(limbs[limb].links_.size())};
    limbs[limb].links_.push_back(
        {above, k, body.q, body.type == JointType::prismatic, body.X_PB, body.axis, body.com, body.mass, body.inertia});
  }
  for (LimbInertia& limb : limbs) limb.moving_.resize(limb.links_.size());
  return limbs;
}

void LimbInertia::evaluate(const Eigen::VectorXd& q, Eigen::MatrixXd& M) {
  const int n = static_cast<int>(links_.size());
  M.setZero(n, n);
  for (int i = 0; i < n; ++i) {
    const Link& link = links_[i];
    Moving& own = moving_[i];
    const Mat3 R_parent = link.parent < 0 ? Mat3(Mat3::Identity()) : moving_[link.parent].R;
    const Vec3 p_parent = link.parent < 0 ? Vec3(Vec3::Zero()) : moving_[link.parent].p;
    own.p = p_parent + R_parent * link.X_PB.translation();
    own.R = R_parent * link.X_PB.linear();
    own.axis = own.R * link.axis;
    if (link.prismatic) {
      own.p += q[i] * own.axis;
    } else {
      own.R = own.R * rotation_about(link.axis, q[i]);
    }
    const Vec3 com = own.p + own.R * link.com;
    own.mass = link.mass;
    own.moment = link.mass * com;
    own.inertia = own.R * link.inertia * own.R.transpose() +
                  link.mass * (com.squaredNorm() * Mat3::Identity() - com * com.transpose());
  }
  for (int i = n - 1; i >= 0; --i) {
    const Moving& own = moving_[i];
    // Momentum of the composite body when joint i moves at unit speed: force-like vector (torque about the origin,
    // force).
    const Vec3 omega = links_[i].prismatic ? Vec3(Vec3::Zero()) : own.axis;
    const Vec3 v = links_[i].prismatic ? own.axis : Vec3(own.p.cross(own.axis));
    const Vec3 force = own.mass * v + omega.cross(own.moment);
    const Vec3 torque = own.inertia * omega + own.moment.cross(v);
    for (int j = i; j >= 0; j = links_[j].parent) {
      const Moving& above = moving_[j];
      M(i, j) = M(j, i) =
          links_[j].prismatic ? above.axis.dot(force) : above.axis.dot(torque) + above.p.cross(above.axis).dot(force);
    }
    if (links_[i].parent < 0) continue;
    Moving& parent = moving_[links_[i].parent];
    parent.mass += own.mass;
    parent.moment += own.moment;
    parent.inertia += own.inertia;
  }
}

}  // namespace graze
