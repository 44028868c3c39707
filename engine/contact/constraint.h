#pragma once
// Contact points as the solver sees them, in factored coordinates: with M = L^T D L and Y = L^-T J^T, contact
// velocities are u = J v = Y^T (L v), an impulse lambda changes L v by D^-1 Y lambda, and Delassus' matrix is A = Y^T
// D^-1 Y. Y has the sparsity of the path to the base, so the cost of a sweep is linear in the number of contacts. Each
// contact has its own axes (ContactFrameT); impulses on a, velocities of a relative to b.

#include "engine/contact/mimic_row.h"
#include "engine/dynamics/articulated.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// How contact behaves, per lane.
template <class T>
struct ContactLawT {
  T convex;      // 1: complementarity_free, 0: the others
  T compliance;  // 1: compliant, 0: rigid
  T correction;  // fraction of a penetration that a step takes back, rigid
  T recovery;    // m/s, fastest recovery from penetration, rigid
};

/// What carries a point of a compliant contact, per lane.
template <class T>
struct ContactSpringT {
  T stiffness;  // N/m
  T damping;    // N s/m
};

/// A contact point over one step, all lanes.
template <class T>
struct ContactT : ContactFrameT<T> {
  // Set by the narrow phase, with the frame.
  T phi;                            // gap, m
  T friction, restitution;          // coefficients of Coulomb and Newton
  const ContactSpringT<T>* spring;  // of the pair; read where the law is compliant in some lane
  T feature_a, feature_b;           // Feature as numbers
  T deep;                           // m: what overlaps by more is not parted by impulses (push_out.h)
  Vec3T<T> lambda;                  // impulse, local, N s; in: warm start
  T slip_rate;                      // alpha of solver.h, 1/kg; in: warm start
  // Set by set_up_contact.
  Vec3T<T> b;  // J v at the beginning, plus the gap term along n, m/s: u = b + Y^T dz + R lambda_n n
  T ann, ass, att, ans, ant, ast;  // A of this contact, 1/kg
  T inverse_ann;                   // kg
  T bnn, bss, btt, bns, bnt, bst;  // A^-1 of this contact, kg
  T guard;                         // compliance that keeps A regular, 1/kg; contained in ann, ass and att
  T compliance;                    // R, 1/kg, with the guard; contained in ann
  T target;                        // speed at which the solve parts the bodies (recovery, restitution) or 0, m/s
  T recovery;                      // likewise, of it what may give energy: without restitution
  T slips;                         // 1 where the impulse lies on the cone
  T free;                          // normal velocity that the step would end with but for constraints, m/s
  unsigned lanes;                  // where the point is valid
  T slot;                          // of the manifold, per lane
  unsigned slots;                  // bit k: some lane's is k
  bool warm;                       // some lane has a warm start
  int pair;                        // index into the pairs
  int path;                        // index into the paths
  Vec3T<T>* y;                     // Y, local rows in the order of the path's dofs; then D^-1 Y
};

/// Takes the rows of Y one by one; sums A = sum of y_k y_k^T / D_k in registers.
template <class T>
struct RowSinkT {
  Vec3T<T>*y, *scaled;
  T nn{0.0}, ss{0.0}, tt{0.0}, ns{0.0}, nt{0.0}, st{0.0};

  RowSinkT(const ContactT<T>& c, int rows) : y(c.y), scaled(c.y + rows) {}
  void put(int i, const Vec3T<T>& a, const T& inverse_D) {
    const Vec3T<T> b = inverse_D * a;
    y[i] = a;
    scaled[i] = b;
    nn = fma(a.x, b.x, nn), ss = fma(a.y, b.y, ss), tt = fma(a.z, b.z, tt);
    ns = fma(a.x, b.y, ns), nt = fma(a.x, b.z, nt), st = fma(a.y, b.z, st);
  }
  void finish(ContactT<T>& c) const { c.ann = nn, c.ass = ss, c.att = tt, c.ans = ns, c.ant = nt, c.ast = st; }
};

template <class T>
inline Vec3T<T> minus_scaled(const Vec3T<T>& a, const T& l, const Vec3T<T>& y) {
  return {fnma(l, y.x, a.x), fnma(l, y.y, a.y), fnma(l, y.z, a.z)};
}

/// y of dof k and what it takes from its ancestors at depth `from` and deeper.
template <class T>
inline Vec3T<T> finish_row(const TreeT<T>& tree, int k, int from, Vec3T<T>* scratch) {
  const TopologyView& top = tree.topology;
  const Vec3T<T> y = scratch[k];
  const T* row = tree.M + top.row[k];
  const int* chain = top.chain + top.row[k];
  for (int d = from; d < top.dof_depth[k]; ++d) scratch[chain[d]] = minus_scaled(scratch[chain[d]], row[d], y);
  return y;
}

/// factor_contact of a path to one floating base, whose rows, which every joint updates, stay in registers.
template <class T>
inline void factor_contact_floating(const TreeT<T>& tree, const PathView& path, ContactT<T>& c, Vec3T<T>* scratch) {
  const TopologyView& top = tree.topology;
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  Vec3T<T> B[6] = {zero, zero, zero, zero, zero, zero};
  int first = 0;  // moving bodies ascend: the base comes first, if it moves one side only
  if (path.moving_count > 0 && top.kind[path.bodies[0]] == kFloating) {
    base_jacobian(tree, path.bodies[0], path.signs[0], c, B);
    first = 1;
  }
  for (int i = first; i < path.moving_count; ++i) {
    scratch[top.v[path.bodies[i]]] = joint_jacobian(tree, path.bodies[i], path.signs[i], c);
  }
  RowSinkT<T> sink(c, path.count);
  const int joints = path.count - 6;
  for (int i = 0; i < joints; ++i) {
    const int k = path.dofs[i];
    const Vec3T<T> y = finish_row(tree, k, 6, scratch);
    const T* row = tree.M + top.row[k];
    GRAZE_UNROLL
    for (int d = 0; d < 6; ++d) B[d] = minus_scaled(B[d], row[d], y);
    sink.put(i, y, tree.inverse_D[k]);
  }
  const T* rows = tree.M + top.row[path.base];
  GRAZE_UNROLL
  for (int k = 5; k >= 0; --k) {
    GRAZE_UNROLL
    for (int d = 0; d < k; ++d) B[d] = minus_scaled(B[d], rows[base_entry(k, d)], B[k]);
    sink.put(joints + 5 - k, B[k], tree.inverse_D[path.base + k]);
  }
  sink.finish(c);
}

/// Y of a contact into c.y, from scratch space of one Vec3T per dof; A.
template <class T>
inline void factor_contact(const TreeT<T>& tree, const PathView& path, ContactT<T>& c, Vec3T<T>* scratch) {
  if (path.shared) {
    for (int i = 0; i < path.count; ++i) scratch[path.dofs[i]] = {T(0.0), T(0.0), T(0.0)};
  }
  if (path.base >= 0) {
    factor_contact_floating(tree, path, c, scratch);
    return;
  }
  for (int i = 0; i < path.moving_count; ++i) jacobian_rows(tree, path.bodies[i], path.signs[i], c, scratch);
  RowSinkT<T> sink(c, path.count);
  for (int i = 0; i < path.count; ++i) {
    const int k = path.dofs[i];
    sink.put(i, finish_row(tree, k, 0, scratch), tree.inverse_D[k]);
  }
  sink.finish(c);
}

/// Makes the contact leave the mimic rows alone; A follows. Returns the part of its velocity that they hold.
template <class T>
inline Vec3T<T> leave_mimics_alone(const TreeT<T>& tree, const MimicsT<T>& mimics, const PathView& path,
                                   ContactT<T>& c) {
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  const T before = c.ann + c.ass + c.att;
  const Vec3T<T> held = leave_alone<T>(mimics, path.count, path.dofs, zero, c.y);
  RowSinkT<T> sink(c, path.count);
  for (int i = 0; i < path.count; ++i) sink.put(i, c.y[i], tree.inverse_D[path.dofs[i]]);
  sink.finish(c);
  const auto moves = c.ann + c.ass + c.att > T(kNothingLeft) * before;
  for (int i = 0; i < 2 * path.count; ++i) c.y[i] = select(moves, c.y[i], zero);
  const auto keep = [&](T& a) { a = select(moves, a, T(0.0)); };
  keep(c.ann), keep(c.ass), keep(c.att), keep(c.ans), keep(c.ant), keep(c.ast);
  return held;
}

/// The gap term along n, m/s, and what it is without restitution.
template <class T>
struct GapTermT {
  T all, at_rest;
};

/// The gap term along n (Eq. 67 and its kin): the solver makes n . u + term >= 0.
///   rigid, apart:        N v+ >= -phi/h, contact may close the gap and no more
///   rigid, overlapping:  a fraction of phi is taken back, at bounded speed
///   any, overlapping deep: not to close further, which a body at rest satisfies; push_out.h takes it back
///   restitution:         N v+ >= -e N v-, when the gap would close within the step (Newton's law)
///   compliant:           lambda = -h (k (phi + h u) + d u) >= 0, which is u + k phi / (h k + d) + R lambda = 0 with
///                        R = 1 / (h (h k + d)): a spring and damper, integrated implicitly
template <class T>
inline GapTermT<T> gap_term(const ContactLawT<T>& law, const ContactT<T>& c, const T& h, const T& before,
                            const T& free) {
  const T rate = c.phi * recip(h);
  const auto deep = c.phi < -c.deep;
  T rigid = select(rate < T(0.0), max(law.correction * rate, -law.recovery), rate);
  rigid = select(deep, T(0.0), rigid);
  const auto bounces = (c.restitution > T(0.0)) & (before < T(0.0)) & (fma(h, free, c.phi) < T(0.0));
  const T bouncing = select(bounces, min(rigid, c.restitution * before), rigid);
  const auto soft = (law.compliance > T(0.0)) & !deep;
  if (!any(soft)) return {bouncing, rigid};
  const ContactSpringT<T>& spring = *c.spring;
  const T compliant = spring.stiffness * c.phi * recip(fma(h, spring.stiffness, spring.damping));
  return {select(soft, compliant, bouncing), select(soft, compliant, rigid)};
}

/// A^-1 by elimination of the normal, which is the best conditioned way: A is nearly singular where fewer than three
/// directions can move.
template <class T>
inline void invert_A(ContactT<T>& c) {
  const T ks = c.ans * c.inverse_ann, kt = c.ant * c.inverse_ann;
  const T ss = fnma(c.ans, ks, c.ass), st = fnma(c.ans, kt, c.ast), tt = fnma(c.ant, kt, c.att);
  const T inverse = recip(fnma(st, st, ss * tt));
  c.bss = tt * inverse, c.bst = -(st * inverse), c.btt = ss * inverse;
  c.bns = -fma(c.bst, kt, c.bss * ks);
  c.bnt = -fma(c.btt, kt, c.bst * ks);
  c.bnn = fnma(c.bnt, kt, fnma(c.bns, ks, c.inverse_ann));
}

/// Compliance that keeps A regular. Joints may leave fewer than three directions to move in; what gap or overlap ask of
/// the others ends in impulses without effect but for their rounding. 1e-6 of A's trace, less than a thousandth of
/// steel's compliance, keeps these small where det A = 0; where A is regular, 1e-12 and less.
template <class T>
inline T guard_of(const ContactT<T>& c) {
  const T trace = c.ann + c.ass + c.att;
  const T nn = fnma(c.ast, c.ast, c.ass * c.att), ns = fnma(c.ant, c.ast, c.ans * c.att);
  const T nt = fnma(c.ant, c.ass, c.ans * c.ast);
  const T det = fma(c.ant, nt, fnma(c.ans, ns, c.ann * nn));
  const T cube = trace * trace * trace;
  return T(1e-14) * trace * cube * recip(fma(T(1e-8), cube, max(det, T(0.0))));
}

/// The same share of A's trace where bodies overlap deep: joints often leave them no way to part or to slide, and what
/// such a contact holds back but for a thousandth is pushed out anyhow (our choice).
inline constexpr double kDeepGuard = 1e-3;

/// Least A along the normal, in units of what a free body of the lighter mass has: a lever of 1e-7 of its radius of
/// gyration (our choice). What is less is rounding, as where a ball lies on its joint's axis, and what an overlap asks
/// of it ends in impulses of 1e17 N s.
inline constexpr double kImmovable = 1e-14;

template <class T>
inline T lighter_of(const TreeT<T>& tree, const PathView& path) {
  if (path.body_a < 0) return tree.body[path.body_b].mass;
  const T mass = tree.body[path.body_a].mass;
  return path.body_b < 0 ? mass : min(mass, tree.body[path.body_b].mass);
}

/// factor_contact of a path to one body, from what articulate() has made of the tree: where that is deep, by far
/// cheaper.
template <class T>
GRAZE_OUT_OF_LINE void factor_contact_of_body(const TreeT<T>& tree, const SpatialT<T>* U, const PathView& path,
                                              ContactT<T>& c) {
  const bool a = path.body_a >= 0;
  RowSinkT<T> sink(c, path.count);
  int i = 0;
  visit_rows(tree, U, a ? path.body_a : path.body_b, a ? 1.0 : -1.0, c,
             [&](int k, const Vec3T<T>& y) { sink.put(i++, y, tree.inverse_D[k]); });
  sink.finish(c);
}

/// Everything about a contact that holds during the step. `dz`: change of L v by all but contacts and joint rows (nv).
/// U: of articulate(), or null.
template <class T>
inline void set_up_contact(const TreeT<T>& tree, const SpatialT<T>* U, const PathView& path, const MimicsT<T>& mimics,
                           const ContactLawT<T>& law, const T& h, const T* dz, ContactT<T>& c, Vec3T<T>* scratch) {
  if (U && (path.body_a < 0 || path.body_b < 0)) {
    factor_contact_of_body(tree, U, path, c);
  } else {
    factor_contact(tree, path, c, scratch);
  }
  Vec3T<T> u{T(0.0), T(0.0), T(0.0)};
  if (path.body_a >= 0) u = point_velocity(tree, path.body_a, c.p);
  if (path.body_b >= 0) u -= point_velocity(tree, path.body_b, c.p);
  c.b = to_local(c, u);
  const T before = c.b.x;
  if (path.mimics) c.b += leave_mimics_alone(tree, mimics, path, c);
  T free = c.b.x;
  for (int i = 0; i < path.count; ++i) free = fma(dz[path.dofs[i]], c.y[i].x, free);
  c.free = free;
  const GapTermT<T> gap = gap_term(law, c, h, before, free);
  c.b.x += gap.all;
  c.target = max(-gap.all, T(0.0));
  c.recovery = max(-gap.at_rest, T(0.0));
  // Where nothing can move (prescribed joints hold both sides, or none turns it) no impulse helps, and none is sought.
  const auto held = !(c.ann * lighter_of(tree, path) > T(kImmovable));
  c.ann = select(held, T(1.0), c.ann);
  c.b.x = select(held, T(1e30), c.b.x);
  const auto deep = c.phi < -c.deep;
  c.guard = select(deep, T(kDeepGuard) * (c.ann + c.ass + c.att), guard_of(c));
  c.compliance = c.guard;
  const auto soft = (law.compliance > T(0.0)) & !deep;
  if (any(soft)) c.compliance += select(soft, recip(h * fma(h, c.spring->stiffness, c.spring->damping)), T(0.0));
  c.ann += c.compliance;
  c.ass += c.guard;
  c.att += c.guard;
  c.inverse_ann = recip(c.ann);
  invert_A(c);
  c.slips = T(0.0);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
