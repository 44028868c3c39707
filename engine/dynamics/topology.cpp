#include "engine/dynamics/topology.h"

#include <cassert>

namespace graze {

namespace {

BodyKind kind_of(JointType type) {
  assert(type != JointType::fixed);
  if (type == JointType::floating) return kFloating;
  return type == JointType::revolute ? kRevolute : kPrismatic;
}

}  // namespace

Topology::Topology(const Model& model) {
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const bool floating = body.type == JointType::floating;
    assert(body.parent < static_cast<int>(i) && body.v == static_cast<int>(dof_parent_.size()));
    assert(!floating || body.parent < 0);
    parent_.push_back(body.parent);
    kind_.push_back(kind_of(body.type));
    q_.push_back(body.q);
    v_.push_back(body.v);
    root_.push_back(floating ? static_cast<int>(i) : body.parent < 0 ? -1 : root_[body.parent]);
    top_.push_back(body.parent < 0 ? static_cast<int>(i) : top_[body.parent]);
    end_.push_back(static_cast<int>(i) + 1);
    last_child_.push_back(-1);
    if (body.parent >= 0) last_child_[body.parent] = static_cast<int>(i);
    if (root_[i] >= 0) {
      assert(end_[root_[i]] + 1 >= end_[i]);  // a tree's bodies are consecutive
      end_[root_[i]] = end_[i];
    }
    int above = -1;
    if (body.parent >= 0) above = v_[body.parent] + (kind_[body.parent] == kFloating ? 5 : 0);
    for (int k = 0; k < (floating ? 6 : 1); ++k) {
      dof_parent_.push_back(above);
      above = static_cast<int>(dof_parent_.size()) - 1;
    }
  }
  row_.push_back(0);
  for (int i = 0; i < static_cast<int>(dof_parent_.size()); ++i) {
    const int above = dof_parent_[i];
    dof_depth_.push_back(above < 0 ? 0 : dof_depth_[above] + 1);
    for (int d = 0; d < dof_depth_[i]; ++d) chain_.push_back(chain_[row_[above] + d]);
    chain_.push_back(i);
    row_.push_back(static_cast<int>(chain_.size()));
  }
}

TopologyView Topology::view() const {
  TopologyView view;
  view.bodies = static_cast<int>(parent_.size());
  view.nv = static_cast<int>(dof_parent_.size());
  view.nq = 0;
  for (int kind : kind_) view.nq += kind == kFloating ? 7 : 1;
  view.parent = parent_.data();
  view.kind = kind_.data();
  view.q = q_.data();
  view.v = v_.data();
  view.end = end_.data();
  view.last_child = last_child_.data();
  view.root = root_.data();
  view.top = top_.data();
  view.dof_parent = dof_parent_.data();
  view.dof_depth = dof_depth_.data();
  view.row = row_.data();
  view.chain = chain_.data();
  return view;
}

}  // namespace graze
