#pragma once
// The ways from pairs of bodies to their bases: which degrees of freedom a contact between them moves.

#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "engine/contact/path_view.h"
#include "engine/dynamics/topology_view.h"

namespace graze {

/// Owns the tables of PathViews; equal pairs of bodies share one.
class Paths {
 public:
  explicit Paths(const TopologyView& topology) : topology_(topology) {}

  /// Index of the path of two bodies (-1: the world).
  int add(int body_a, int body_b);
  const std::vector<PathView>& views() const { return views_; }

 private:
  struct Table {
    std::vector<int> dofs, bodies;
    std::vector<double> signs;
  };
  TopologyView topology_;
  std::map<std::pair<int, int>, int> index_;
  std::deque<Table> tables_;  // never moves what views point to
  std::vector<PathView> views_;
};

}  // namespace graze
