#pragma once
// A serial chain as kernels see it: numbers of the nominal model, the same for all lanes. Filled by Chain (chain.h).

namespace graze {

inline constexpr int kMaxChainJoints = 12;

/// A joint and the body that it moves. The body's frame in the frame of the body before (the base for the first) at q
/// is
///   revolute   turned by fixed + cos(q) cosine + sin(q) sine, at `offset`
///   prismatic  turned by fixed, at offset + q axis.
struct ChainJointView {
  bool prismatic;
  int actuator;                         // row in na-sized arrays
  double lower, upper;                  // rad or m
  double fixed[9], cosine[9], sine[9];  // row-major
  double offset[3];                     // m
  double axis[3];                       // unit, in the frame of the body before
  double mass;                          // kg
  double com[3];                        // in the body's frame, m
  double inertia[6];                    // about com, axes of the body's frame: xx, xy, xz, yy, yz, zz, kg m^2
  double armature;                      // Body::armature
};

struct ChainView {
  int n;                        // joints, 1 … kMaxChainJoints
  const ChainJointView* joint;  // from the base outward
  double tip[3];                // the frame's origin in the last body's frame, m
};

}  // namespace graze
