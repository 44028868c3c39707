#pragma once
// A LaneBlock (kernel.h) with its types.

#include "engine/dynamics/tree.h"
#include "engine/lane_physics/kernel.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
inline T* rows(double* p) {
  return reinterpret_cast<T*>(p);
}

template <class T>
inline TreeT<T> tree_of(const LaneBlock& block) {
  TreeT<T> tree;
  tree.topology = block.topology;
  tree.body = reinterpret_cast<const BodyT<T>*>(block.body);
  tree.gravity = rows<T>(block.gravity);
  tree.motion = reinterpret_cast<MotionT<T>*>(block.motion);
  tree.pose = reinterpret_cast<PoseT<T>*>(block.X);
  tree.origin = reinterpret_cast<Vec3T<T>*>(block.origin);
  tree.M = rows<T>(block.M);
  tree.inverse_D = rows<T>(block.inverse_D);
  tree.bias = rows<T>(block.bias);
  return tree;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
