#pragma once
// What kernels see of a Topology: plain integers.

namespace graze {

enum BodyKind : int { kFloating, kRevolute, kPrismatic };

struct TopologyView {
  int bodies, nq, nv;
  // Per body; parents come before children.
  const int* parent;      // body, or -1
  const int* kind;        // BodyKind
  const int* q;           // first index in q
  const int* v;           // first index in v
  const int* end;         // one beyond the last body of the tree, for a floating body; their dofs are consecutive
  const int* last_child;  // highest index of a child, or -1
  const int* root;        // floating body at the base of its tree, or -1: the tree stands on the world, O is its origin
  const int* top;         // body without parent at the base of its tree
  // Per degree of freedom, a floating body's six in a chain (Featherstone's expanded tree).
  const int* dof_parent;  // or -1
  const int* dof_depth;   // number of ancestors
  // Lower triangle of M, rows one after the other: M(i, ancestor of i at depth d) stands at row[i] + d, the diagonal at
  // row[i] + dof_depth[i]. chain[row[i] + d] is that ancestor.
  const int* row;    // nv + 1 entries; the last is the number of entries
  const int* chain;  // row[nv] entries
};

}  // namespace graze
