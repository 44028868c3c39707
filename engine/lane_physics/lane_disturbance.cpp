// What is done to one lane between two steps, in plain numbers: the kernels know nothing of it, so it costs nothing
// where nobody is disturbed.

#include <cassert>
#include <cstring>
#include <vector>

#include "engine/dynamics/dynamics_model.h"
#include "engine/dynamics/frames.h"
#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/scalar.h"

namespace graze {
namespace {

/// One lane of rows as a struct of the kernels, and back.
template <class S>
S lane_of(const double* rows, int lanes, int lane) {
  double flat[sizeof(S) / sizeof(double)];
  for (std::size_t i = 0; i < std::size(flat); ++i) flat[i] = rows[i * lanes + lane];
  S out;
  std::memcpy(&out, flat, sizeof(S));
  return out;
}

template <class S>
void set_lane(const S& numbers, double* rows, int lanes, int lane) {
  double flat[sizeof(S) / sizeof(double)];
  std::memcpy(flat, &numbers, sizeof(S));
  for (std::size_t i = 0; i < std::size(flat); ++i) rows[i * lanes + lane] = flat[i];
}

std::vector<double> lane_numbers(const double* rows, int count, int lanes, int lane) {
  std::vector<double> out(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) out[i] = rows[i * lanes + lane];
  return out;
}

/// One lane's trees, with the numbers that they have by now.
class LaneTree {
 public:
  LaneTree(const LaneBlock& block, int lanes, int lane)
      : gravity_(3),
        motion_(block.topology.bodies),
        pose_(block.topology.bodies),
        origin_(block.topology.bodies),
        M_(block.topology.row[block.topology.nv]),
        inverse_D_(block.topology.nv),
        bias_(block.topology.nv) {
    constexpr std::size_t kRows = sizeof(BodyT<double>) / sizeof(double);
    for (int i = 0; i < block.topology.bodies; ++i) {
      body_.push_back(lane_of<BodyT<double>>(block.body + i * kRows * lanes, lanes, lane));
    }
    tree_ = {block.topology, body_.data(), gravity_.data(),   motion_.data(), pose_.data(),
             origin_.data(), M_.data(),    inverse_D_.data(), bias_.data()};
    const std::vector<double> q = lane_numbers(block.q, block.topology.nq, lanes, lane);
    update_poses(tree_, q.data());
    update_mass(tree_);
  }

  /// The change of v by an impulse on a body: M^-1 J^T p. M becomes its factors.
  std::vector<double> response(int body, const Vec3& p_B, const Vec3& impulse_W) {
    std::vector<double> out(bias_.size());
    const PoseT<double>& X = pose_[static_cast<std::size_t>(body)];
    add_force(tree_, body, X.p + X.R * to_kernel(p_B), to_kernel(impulse_W), out.data());
    factor_and_solve(tree_, out.data());
    solve_L(tree_, out.data());
    return out;
  }

 private:
  std::vector<BodyT<double>> body_;
  std::vector<double> gravity_;
  std::vector<MotionT<double>> motion_;
  std::vector<PoseT<double>> pose_;
  std::vector<Vec3T<double>> origin_;
  std::vector<double> M_, inverse_D_, bias_;
  TreeT<double> tree_;
};

}  // namespace

void LaneEngine::push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W) {
  const int W = kernel_.lanes, nv = block_.topology.nv;
  const std::vector<double> change = LaneTree(block_, W, lane).response(body, p_B, impulse_W);
  pushed_.resize(static_cast<std::size_t>(nv) * W);
  for (int k = 0; k < nv; ++k) {
    block_.v[k * W + lane] += change[k];
    pushed_[static_cast<std::size_t>(k * W + lane)] += change[k];
  }
  pushed_lanes_ |= 1u << lane;
  kernel_.settle(block_);
}

/// The acceleration that a step shows begins at the velocity before the push.
void LaneEngine::show_pushes(double h, unsigned active) {
  const int W = kernel_.lanes;
  for (int k = 0; k < block_.topology.nv; ++k) {
    for (int lane = 0; lane < W; ++lane) {
      if (!(pushed_lanes_ >> lane & 1)) continue;
      double& change = pushed_[static_cast<std::size_t>(k * W + lane)];
      if (active >> lane & 1) block_.a[k * W + lane] += change / h;
      change = 0;
    }
  }
  pushed_lanes_ = 0;
}

void LaneEngine::load(int lane, int body, const Vec3& p_B, double mass) {
  const int W = kernel_.lanes;
  double* const rows = block_.body + static_cast<std::ptrdiff_t>(body) * kernel_.body_rows * W;
  BodyT<double> numbers = lane_of<BodyT<double>>(rows, W, lane);
  Body sum;
  sum.mass = numbers.mass;
  sum.com = to_eigen(numbers.com);
  sum.inertia << numbers.ixx, numbers.ixy, numbers.ixz, numbers.ixy, numbers.iyy, numbers.iyz, numbers.ixz, numbers.iyz,
      numbers.izz;
  add_point_mass(sum, p_B, mass);
  numbers.mass = sum.mass;
  numbers.com = to_kernel(sum.com);
  numbers.ixx = sum.inertia(0, 0), numbers.iyy = sum.inertia(1, 1), numbers.izz = sum.inertia(2, 2);
  numbers.ixy = sum.inertia(0, 1), numbers.ixz = sum.inertia(0, 2), numbers.iyz = sum.inertia(1, 2);
  set_lane(numbers, rows, W, lane);
  const Vec3 gravity(block_.gravity[lane], block_.gravity[W + lane], block_.gravity[2 * W + lane]);
  block_.energy_audit[kLift * W + lane] += kCreatedLift * mass * gravity.norm();
  kernel_.settle(block_);
}

}  // namespace graze
