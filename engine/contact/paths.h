#pragma once
// The ways from pairs of bodies to their bases: which degrees of freedom a contact between them moves.

#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "engine/contact/path_view.h"
#include "engine/dynamics/topology_view.h"
#include "engine/model/model.h"

namespace graze {

/// Degrees of freedom that the mimic rows of a model move, with their ancestors, descending.
std::vector<int> mimic_dofs(const Model& model, const TopologyView& topology);

/// Owns the tables of PathViews; equal pairs of bodies share one.
class Paths {
 public:
  /// `mimic_dofs`: impulses on any of them move all of them.
  explicit Paths(const TopologyView& topology, std::vector<int> mimic_dofs = {})
      : topology_(topology), mimic_dofs_(std::move(mimic_dofs)) {}

  /// Index of the path of two bodies (-1: the world).
  int add(int body_a, int body_b);
  const std::vector<PathView>& views() const { return views_; }
  /// Of a joint's row. What it points to lives as long as this.
  JointPathView joint(int dof);

 private:
  struct Table {
    std::vector<int> dofs, bodies;
    std::vector<double> signs;
  };
  /// Adds the mimic rows' to `dofs` if they have some in common; whether they have. Then `dofs` are descending.
  bool add_mimics(std::vector<int>& dofs) const;

  TopologyView topology_;
  std::vector<int> mimic_dofs_;
  std::map<std::pair<int, int>, int> index_;
  std::deque<Table> tables_;  // never moves what views point to
  std::deque<std::vector<int>> joint_dofs_;
  std::vector<PathView> views_;
};

}  // namespace graze
