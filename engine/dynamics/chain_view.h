#pragma once
// A serial chain as kernels see it: numbers of the nominal model, the same for all lanes, or each lane's own
// (lane_number.h). Filled by Chain (chain.h).

#include "engine/lanes/lane_number.h"

namespace graze {

inline constexpr int kMaxChainJoints = 12;

/// A joint and the body that it moves. The body's frame in the frame of the body before (the base for the first) at q
/// is
///   revolute   turned by fixed + cos(q) cosine + sin(q) sine, at `offset`
///   prismatic  turned by fixed, at offset + q axis.
template <class Number>
struct ChainJointOf {
  bool prismatic;
  int actuator;                         // row in na-sized arrays
  Number lower, upper;                  // rad or m
  Number fixed[9], cosine[9], sine[9];  // row-major
  Number offset[3];                     // m
  Number axis[3];                       // unit, in the frame of the body before
  Number mass;                          // kg
  Number com[3];                        // in the body's frame, m
  Number inertia[6];                    // about com, axes of the body's frame: xx, xy, xz, yy, yz, zz, kg m^2
  Number armature;                      // Body::armature
};

template <class Number>
struct ChainOf {
  int n;                              // joints, 1 … kMaxChainJoints
  const ChainJointOf<Number>* joint;  // from the base outward
  Number tip[3];                      // the frame's origin in the last body's frame, m
};

using ChainJointView = ChainJointOf<double>;
using ChainView = ChainOf<double>;

}  // namespace graze
