#pragma once
// Inverse kinematics of a chain (position of its tip only): damped least squares for any chain, and a closed form for
// legs whose first axis is perpendicular to two further, parallel ones (hip roll, hip pitch, knee). Heap-free.

#include <optional>

#include "engine/control/chain.h"

namespace graze {

struct IkOptions {
  double tolerance = 1e-9;  // m
  int iterations = 60;
};

/// Damped least squares (Levenberg-Marquardt on |x(q) - x|^2, Nakamura & Hanafusa 1986) from the guess in `q`, within
/// joint limits: a joint at its limit that would go further drops out of the step. Returns the remaining distance, m;
/// for a target out of reach q is a local minimum of the distance.
double solve_damped(const Chain& chain, const Vec3& x, Chain::Values& q, const IkOptions& options = {});

/// The closed form of hip-pitch-knee legs. With w1 the first axis and w2 the direction of the parallel ones, the tip's
/// coordinate along w2 does not change with q2 and q3, which gives q1; the rest is a planar two-link arm.
class HipKneeLeg {
 public:
  /// Nothing if the chain is not of this shape. Branches (side of the hip, direction of the knee) and the turn in which
  /// angles are given are those of `reference`.
  static std::optional<HipKneeLeg> detect(const Chain& chain, const Chain::Values& reference);

  /// Returns false if x is out of reach or beyond a joint limit; q is then the nearest stretched or folded posture in
  /// the leg's plane, cut at the limits.
  bool solve(const Vec3& x, Chain::Values& q) const;

 private:
  Eigen::Vector3d solve_branch(const Vec3& x, double hip, double knee, bool& reached) const;

  Vec3 o1_, w1_, w2_, b_;               // first origin; axes; b = w1 x w2
  double d_ = 0;                        // tip along w2 from o1
  Eigen::Vector2d o2_, upper_, lower_;  // o2 - o1, o3 - o2, tip - o3 in the plane (w1, w2 x w1)
  double sign3_ = 1;                    // of the third axis along w2
  double hip_ = 1, knee_ = 1;           // branches
  Eigen::Vector3d reference_, low_, high_;
};

/// Joint positions and velocities for a tip that shall be at x (m) and move at xd (m/s), both in the base frame.
class InverseKinematics {
 public:
  InverseKinematics(Chain chain, const Chain::Values& reference);
  const Chain& chain() const { return chain_; }
  bool has_closed_form() const { return closed_.has_value(); }

  /// `q`: guess in, solution out.
  void solve(const Vec3& x, Chain::Values& q) const;
  /// v with J(q) v = xd in the damped least-squares sense.
  Chain::Values velocity(const Chain::Values& q, const Vec3& xd) const;

 private:
  Chain chain_;
  std::optional<HipKneeLeg> closed_;
};

}  // namespace graze
