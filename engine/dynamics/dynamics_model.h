#pragma once
// Model and data of a robot's dynamics, apart: a DynamicsModel holds tables and numbers, constant and shared by
// threads; a DynamicsData holds what is computed of it, one per thread. What is computed are free function templates on
// the data's tree, the same that the lane engine runs:
//   tree.h      poses, M, bias, potential energy
//   equation.h  velocities, forward and inverse dynamics, gravity
//   frames.h    frames and points: poses, velocities, Jacobians, forces; contact Jacobians
//   totals.h    of a tree: mass, centre of mass and its Jacobian, momentum, kinetic energy
//
//   const DynamicsModel robot(model);
//   DynamicsData<double> data(robot);
//   update(data.tree(), q.data(), v.data());
//   forward_dynamics(data.tree(), tau.data(), a.data());
//
// T is double, or a Pack<W>: W particles at once, each lane with its own numbers or with the same.

#include <cassert>
#include <vector>

#include "engine/dynamics/equation.h"
#include "engine/dynamics/topology.h"
#include "engine/dynamics/totals.h"

namespace graze {

/// Numbers of Eigen as kernels take them.
Vec3T<double> to_kernel(const Vec3& a);
RotT<double> to_kernel(const Mat3& R);
PoseT<double> to_kernel(const Pose& X);
Vec3 to_eigen(const Vec3T<double>& a);
Pose to_eigen(const PoseT<double>& X);

/// Numbers of a body as the tree takes them: a joint turns about z of a canonical frame (tree.h).
BodyT<double> body_numbers(const Body& body);

/// The trees of a Model, robot and movable objects alike. Constant; valid without the Model.
class DynamicsModel {
 public:
  explicit DynamicsModel(const Model& model);

  int nq() const { return topology_.view().nq; }
  int nv() const { return topology_.view().nv; }
  int bodies() const { return static_cast<int>(bodies_.size()); }
  /// Points into this.
  TopologyView topology() const { return topology_.view(); }
  const BodyT<double>& body(int i) const { return bodies_[i]; }
  const Vec3& gravity() const { return gravity_; }

 private:
  Topology topology_;
  std::vector<BodyT<double>> bodies_;
  Vec3 gravity_;
};

/// Writes one lane of an array of quantities that each have kWidth<T> lanes.
template <class T, class S>
inline void set_lane_of(S& all, int lane, const double* one) {
  double* rows = reinterpret_cast<double*>(&all);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(T); ++i) rows[i * kWidth<T> + lane] = one[i];
}

/// Room for what functions on trees compute, and for the bodies' numbers, which whoever makes it sets. Nothing is
/// allocated after construction; moved about, the memory stays where it is.
template <class T>
class TreeMemory {
 public:
  /// What `topology` points into must outlive this.
  explicit TreeMemory(const TopologyView& topology)
      : body_(topology.bodies),
        gravity_(3),
        motion_(topology.bodies),
        pose_(topology.bodies),
        origin_(topology.bodies),
        M_(topology.row[topology.nv]),
        inverse_D_(topology.nv),
        bias_(topology.nv) {
    tree_ = {topology,       body_.data(), gravity_.data(),   motion_.data(), pose_.data(),
             origin_.data(), M_.data(),    inverse_D_.data(), bias_.data()};
  }
  TreeMemory(const TreeMemory&) = delete;
  TreeMemory& operator=(const TreeMemory&) = delete;
  TreeMemory(TreeMemory&&) = default;

  std::vector<BodyT<T>>& bodies() { return body_; }
  std::vector<T>& gravity() { return gravity_; }
  const TreeT<T>& tree() const { return tree_; }

 private:
  std::vector<BodyT<T>> body_;
  std::vector<T> gravity_;
  std::vector<MotionT<T>> motion_;
  std::vector<PoseT<T>> pose_;
  std::vector<Vec3T<T>> origin_;
  std::vector<T> M_, inverse_D_, bias_;
  TreeT<T> tree_;
};

/// Working memory of a DynamicsModel, which must outlive it. All numbers begin as those of the model, the same in all
/// lanes; poses and the like are unset until they are computed.
template <class T>
class DynamicsData {
 public:
  explicit DynamicsData(const DynamicsModel& model) : memory_(model.topology()) {
    for (int lane = 0; lane < kWidth<T>; ++lane) set_lane(lane, model);
  }

  /// Sets a lane to the numbers of another model of the same shape (a particle's, for example).
  void set_lane(int lane, const DynamicsModel& numbers) {
    assert(lane < kWidth<T> && numbers.bodies() == static_cast<int>(memory_.bodies().size()));
    for (int i = 0; i < numbers.bodies(); ++i) {
      set_lane_of<T>(memory_.bodies()[i], lane, reinterpret_cast<const double*>(&numbers.body(i)));
    }
    for (int k = 0; k < 3; ++k) set_lane_of<T>(memory_.gravity()[k], lane, &numbers.gravity()[k]);
  }

  /// What the functions of tree.h, equation.h, frames.h and totals.h take.
  const TreeT<T>& tree() const { return memory_.tree(); }

 private:
  TreeMemory<T> memory_;
};

}  // namespace graze
