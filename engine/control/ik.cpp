#include "engine/control/ik.h"

#include <cmath>
#include <limits>

#include "engine/lanes/scalar.h"

namespace graze {

namespace {

constexpr double kParallel = 1e-9;  // on cosines; nominal axes are exact up to rounding

double angle_of(const Eigen::Vector2d& v) { return pinned::atan2(v.y(), v.x()); }

/// Distance of the angles that a branch has for the tip's place at the reference from the reference.
double branch_error(const HipKneeView& leg, const Vec3& tip) {
  double q[3];
  bool reached = true;
  solve_hip_knee_freely(leg, Vec3T<double>{tip.x(), tip.y(), tip.z()}, q, reached);
  return Vec3(q[0] - leg.reference[0], q[1] - leg.reference[1], q[2] - leg.reference[2]).norm();
}

}  // namespace

std::optional<HipKneeView> detect_hip_knee(const Chain& chain, const Chain::Values& reference) {
  if (chain.size() != 3) return std::nullopt;
  for (const ChainJointView& joint : chain.joints()) {
    if (joint.prismatic) return std::nullopt;
  }
  const Chain::Skeleton zero = chain.skeleton(Chain::Values::Zero(3));
  const Vec3 &w1 = zero.axis[0], &w2 = zero.axis[1], &w3 = zero.axis[2];
  if (std::abs(w1.dot(w2)) > kParallel || w2.cross(w3).norm() > kParallel) return std::nullopt;

  HipKneeView leg{};
  const Vec3 b = w1.cross(w2);
  Vec3::Map(leg.o1) = zero.origin[0];
  Vec3::Map(leg.w1) = w1;
  Vec3::Map(leg.w2) = w2;
  Vec3::Map(leg.b) = b;
  leg.d = w2.dot(zero.tip - zero.origin[0]);
  const auto planar = [&](const Vec3& v) { return Eigen::Vector2d(w1.dot(v), -b.dot(v)); };
  const Eigen::Vector2d upper = planar(zero.origin[2] - zero.origin[1]), lower = planar(zero.tip - zero.origin[2]);
  if (upper.norm() < kParallel || lower.norm() < kParallel) return std::nullopt;
  Eigen::Vector2d::Map(leg.o2) = planar(zero.origin[1] - zero.origin[0]);
  Eigen::Vector2d::Map(leg.upper) = upper;
  leg.lower_length = lower.norm();
  leg.bend = angle_of(lower) - angle_of(upper);
  leg.sign3 = w2.dot(w3) > 0 ? 1 : -1;
  for (int i = 0; i < 3; ++i) {
    leg.reference[i] = reference[i];
    leg.low[i] = chain.joints()[i].lower;
    leg.high[i] = chain.joints()[i].upper;
  }
  const Vec3 tip = chain.position(reference);
  HipKneeView best = leg;
  double least = std::numeric_limits<double>::infinity();
  for (const double hip : {1.0, -1.0}) {
    for (const double knee : {1.0, -1.0}) {
      leg.hip = hip;
      leg.knee = knee;
      const double error = branch_error(leg, tip);
      if (error >= least) continue;
      least = error;
      best = leg;
    }
  }
  return best;
}

}  // namespace graze
