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

/// The change of v of one lane by an impulse on a body: M^-1 J^T p, with the numbers that its trees have by now.
std::vector<double> response(const LaneBlock& block, int lanes, int lane, int body, const Vec3& p_B,
                             const Vec3& impulse_W) {
  constexpr std::size_t kRows = sizeof(BodyT<double>) / sizeof(double);
  const TopologyView& topology = block.topology;
  TreeMemory<double> memory(topology);
  for (int i = 0; i < topology.bodies; ++i) {
    memory.bodies()[static_cast<std::size_t>(i)] = lane_of<BodyT<double>>(block.body + i * kRows * lanes, lanes, lane);
  }
  const TreeT<double>& tree = memory.tree();
  update_poses(tree, lane_numbers(block.q, topology.nq, lanes, lane).data());
  update_mass(tree);
  std::vector<double> out(static_cast<std::size_t>(topology.nv));
  const PoseT<double>& X = tree.pose[body];
  add_force(tree, body, X.p + X.R * to_kernel(p_B), to_kernel(impulse_W), out.data());
  factor_and_solve(tree, out.data());
  solve_L(tree, out.data());
  return out;
}

}  // namespace

void LaneEngine::push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W) {
  const int W = kernel_.lanes, nv = block_.topology.nv;
  const std::vector<double> change = response(block_, W, lane, body, p_B, impulse_W);
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
