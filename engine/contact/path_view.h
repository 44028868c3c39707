#pragma once
// What kernels see of the way from two bodies to their bases: plain integers.

namespace graze {

/// Which degrees of freedom a pair of bodies moves: those on the way from either body to its base.
struct PathView {
  int count;            // degrees of freedom below
  const int* dofs;      // descending
  int moving_count;     // bodies below
  const int* bodies;    // that move one side only (a joint above both moves both alike)
  const double* signs;  // +1: they carry a; -1: they carry b
  int body_a, body_b;   // or -1
  bool shared;          // some degree of freedom has no body below: a joint moves both alike, or a mimic row comes in
  int base;  // dofs are joints of one floating tree and then its base's six, the first of which is this; or -1
  bool mimics = false;  // dofs contain those of the mimic rows
};

/// Which degrees of freedom a row of one joint moves: its own and its ancestors, ascending; or, where joints of its
/// robot follow others, these with those of the mimic rows, descending.
struct JointPathView {
  int count;
  const int* dofs;
  bool mimics;
};

}  // namespace graze
