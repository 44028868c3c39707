#include "engine/control/ik.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace graze {

namespace {

/// J^T (J J^T + lambda^2 1)^-1 e.
Chain::Values damped_step(const Chain::Jacobian& J, const Vec3& e, double lambda) {
  const Mat3 A = J * J.transpose() + lambda * lambda * Mat3::Identity();
  const Vec3 y = A.ldlt().solve(e);
  return J.transpose() * y;
}

Chain::Values within_limits(const Chain& chain, Chain::Values q) {
  for (int i = 0; i < chain.size(); ++i) q[i] = std::clamp(q[i], chain.joints()[i].lower, chain.joints()[i].upper);
  return q;
}

/// The step from q, with joints dropped that stand at a limit and would leave it.
Chain::Values limited_step(const Chain& chain, Chain::Jacobian J, const Chain::Values& q, const Vec3& e,
                           double lambda) {
  Chain::Values step = damped_step(J, e, lambda);
  for (int pass = 0; pass < chain.size(); ++pass) {
    bool dropped = false;
    for (int i = 0; i < chain.size(); ++i) {
      const Chain::Joint& joint = chain.joints()[i];
      const bool blocked = (q[i] <= joint.lower && step[i] < 0) || (q[i] >= joint.upper && step[i] > 0);
      if (!blocked) continue;
      J.col(i).setZero();
      dropped = true;
    }
    if (!dropped) break;
    step = damped_step(J, e, lambda);
  }
  return step;
}

}  // namespace

double solve_damped(const Chain& chain, const Vec3& x, Chain::Values& q, const IkOptions& options) {
  q = within_limits(chain, q);
  Chain::Jacobian J;
  Vec3 e = x - chain.position(q, J);
  double lambda = 1e-3;  // m/rad; legs of a few decimetres have singular values of about 0.1
  for (int i = 0; i < options.iterations && e.norm() > options.tolerance; ++i) {
    const Chain::Values trial = within_limits(chain, q + limited_step(chain, J, q, e, lambda));
    Chain::Jacobian J_trial;
    const Vec3 e_trial = x - chain.position(trial, J_trial);
    if (e_trial.squaredNorm() < e.squaredNorm()) {
      q = trial;
      e = e_trial;
      J = J_trial;
      lambda = std::max(lambda / 4, 1e-7);
    } else {
      lambda *= 4;
      if (lambda > 1e3) break;  // a local minimum: no step helps
    }
  }
  return e.norm();
}

namespace {

constexpr double kParallel = 1e-9;  // on cosines; nominal axes are exact up to rounding

double wrap_near(double angle, double reference) {
  const double turn = 2 * std::numbers::pi;
  return angle - turn * std::round((angle - reference) / turn);
}

/// acos that says whether its argument was within [-1, 1].
double safe_acos(double c, bool& reached) {
  if (c < -1 || c > 1) reached = false;
  return std::acos(std::clamp(c, -1.0, 1.0));
}

double angle_of(const Eigen::Vector2d& v) { return std::atan2(v.y(), v.x()); }

}  // namespace

std::optional<HipKneeLeg> HipKneeLeg::detect(const Chain& chain, const Chain::Values& reference) {
  if (chain.size() != 3) return std::nullopt;
  for (const Chain::Joint& joint : chain.joints()) {
    if (joint.prismatic) return std::nullopt;
  }
  const Chain::Skeleton zero = chain.skeleton(Chain::Values::Zero(3));
  const Vec3 &w1 = zero.axis[0], &w2 = zero.axis[1], &w3 = zero.axis[2];
  if (std::abs(w1.dot(w2)) > kParallel || w2.cross(w3).norm() > kParallel) return std::nullopt;

  HipKneeLeg leg;
  leg.o1_ = zero.origin[0];
  leg.w1_ = w1;
  leg.w2_ = w2;
  leg.b_ = w1.cross(w2);
  leg.d_ = w2.dot(zero.tip - leg.o1_);
  const auto planar = [&](const Vec3& v) { return Eigen::Vector2d(w1.dot(v), -leg.b_.dot(v)); };
  leg.o2_ = planar(zero.origin[1] - zero.origin[0]);
  leg.upper_ = planar(zero.origin[2] - zero.origin[1]);
  leg.lower_ = planar(zero.tip - zero.origin[2]);
  if (leg.upper_.norm() < kParallel || leg.lower_.norm() < kParallel) return std::nullopt;
  leg.sign3_ = w2.dot(w3) > 0 ? 1 : -1;
  leg.reference_ = reference;
  for (int i = 0; i < 3; ++i) {
    leg.low_[i] = chain.joints()[i].lower;
    leg.high_[i] = chain.joints()[i].upper;
  }
  const Vec3 tip = chain.position(reference);
  double best = std::numeric_limits<double>::infinity();
  for (const double hip : {1.0, -1.0}) {
    for (const double knee : {1.0, -1.0}) {
      bool reached = true;
      const double distance = (leg.solve_branch(tip, hip, knee, reached) - leg.reference_).norm();
      if (distance >= best) continue;
      best = distance;
      leg.hip_ = hip;
      leg.knee_ = knee;
    }
  }
  return leg;
}

Eigen::Vector3d HipKneeLeg::solve_branch(const Vec3& x, double hip, double knee, bool& reached) const {
  const Vec3 y = x - o1_;
  const double ya = w2_.dot(y), yb = b_.dot(y);
  // Turning the target back by q1 about w1 must bring its coordinate along w2 to d: ya cos q1 + yb sin q1 = d.
  const double r = std::hypot(ya, yb);
  const double q1 = std::atan2(yb, ya) + hip * safe_acos(r > 0 ? d_ / r : 2.0, reached);
  const Eigen::Vector2d target = Eigen::Vector2d(w1_.dot(y), ya * std::sin(q1) - yb * std::cos(q1)) - o2_;
  // Two links a, c in the plane: |target|^2 = |a|^2 + |c|^2 + 2 |a| |c| cos(theta3 + gamma).
  const double a = upper_.norm(), c = lower_.norm();
  const double gamma = angle_of(lower_) - angle_of(upper_);
  const double cosine = (target.squaredNorm() - a * a - c * c) / (2 * a * c);
  const double theta3 = knee * safe_acos(cosine, reached) - gamma;
  const Eigen::Vector2d folded = upper_ + Eigen::Rotation2Dd(theta3) * lower_;
  const double theta2 = angle_of(target) - angle_of(folded);
  return {wrap_near(q1, reference_[0]), wrap_near(theta2, reference_[1]), wrap_near(sign3_ * theta3, reference_[2])};
}

bool HipKneeLeg::solve(const Vec3& x, Chain::Values& q) const {
  bool reached = true;
  const Eigen::Vector3d exact = solve_branch(x, hip_, knee_, reached);
  q.resize(3);
  for (int i = 0; i < 3; ++i) {
    q[i] = std::clamp(exact[i], low_[i], high_[i]);
    if (q[i] != exact[i]) reached = false;
  }
  return reached;
}

InverseKinematics::InverseKinematics(Chain chain, const Chain::Values& reference)
    : chain_(std::move(chain)), closed_(HipKneeLeg::detect(chain_, reference)) {}

void InverseKinematics::solve(const Vec3& x, Chain::Values& q) const {
  if (closed_) {
    closed_->solve(x, q);
  } else {
    solve_damped(chain_, x, q);
  }
}

Chain::Values InverseKinematics::velocity(const Chain::Values& q, const Vec3& xd) const {
  Chain::Jacobian J;
  chain_.position(q, J);
  // Below a singular value of about 1 mm/rad the leg is stretched, and joint speed is bounded instead of exact.
  return damped_step(J, xd, 1e-3);
}

}  // namespace graze
