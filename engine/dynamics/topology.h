#pragma once
// Dynamics of kinematic trees, on lanes. The folder turns poses and velocities of a Model's bodies into its joint-space
// equation of motion M(q) v' + bias(q, v) = tau and solves it (Featherstone, Rigid Body Dynamics Algorithms, 2008):
//   topology.h   the shape of the trees as tables of integers, the same for all particles
//   tree.h       kinematics, mass matrix (composite rigid bodies), bias forces (Newton-Euler)
//   factor.h     M = L^T D L in the sparsity of the tree, and solves with it
//   equation.h   the equation of motion forth and back: forward and inverse dynamics
//   frames.h     points and frames on bodies: poses, velocities, Jacobians, forces; contacts between two bodies
//   totals.h     of a whole tree: mass, centre of mass, momentum, energy
//   chain.h      one leg or arm of the nominal model, as straight code on numbers that all lanes share
//   dynamics_model.h   a robot's numbers and working memory, outside of kernels
// Everything is expressed in world axes about the origin O of the tree's base, which moves with it: so spatial vectors
// of different links add without transforms. In: q, v. Out: poses, M's factors, bias. Kernels are templates on
// T = double or Pack<W>; they see the tables through TopologyView only.

#include <vector>

#include "engine/dynamics/topology_view.h"
#include "engine/model/model.h"

namespace graze {

/// Owns the tables of TopologyView.
class Topology {
 public:
  explicit Topology(const Model& model);
  TopologyView view() const;

 private:
  std::vector<int> parent_, kind_, q_, v_, end_, last_child_, root_, top_;  // per body
  std::vector<int> dof_parent_, dof_depth_, row_, chain_;                   // per degree of freedom
};

}  // namespace graze
