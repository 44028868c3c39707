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
  bool shared;          // some joint moves both alike
  int base;  // dofs are joints of one floating tree and then its base's six, the first of which is this; or -1
};

}  // namespace graze
