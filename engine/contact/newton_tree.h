#pragma once
// Newton's method (newton.h) on joint velocities of all lanes at once, for long limbs whose contacts couple no two
// bodies: where each is between a body and the world, Newton's matrix M + J^T G J is that of an articulated body whose
// links have contacts' stiffnesses beside their inertias, and is eliminated without being formed (Featherstone 2008,
// §7.3; of G's unsymmetric part see newton.h), at a cost that grows with the number of joints and contacts. The same
// problem, proximal steps and ends as there, per lane; what it does not finish is left to it.

#include "engine/contact/newton.h"
#include "engine/dynamics/articulated.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// A contact of TreeNewton.
template <class T>
struct TreeContactT : ProximalContactT<T> {
  Vec3T<T> b;  // velocity that the step ends with but for constraints, m/s
  Vec3T<T> r;  // from O, m
};

/// A joint's row of TreeNewton.
template <class T>
struct TreeJointT : NewtonJointT<T> {
  T b;  // likewise
};

/// Working memory per body.
template <class T>
struct TreeBodyT {
  SpatialT<T> V, F;  // twist and wrench
  SpatialT<T> W;     // of the joint's share
  T inverse, u;
};

/// Where the working memory lies. A, U: per body, of articulate(); A is then working memory of TreeNewton.
template <class T>
struct TreeRowsT {
  SpatialMatrixT<T>* A;
  SpatialT<T>* U;
  T* rest;  // kTreeBody - 42 per body, and all else

  TreeRowsT(const NewtonMemory& memory, int bodies) {
    T* place = reinterpret_cast<T*>(memory.rows);
    A = reinterpret_cast<SpatialMatrixT<T>*>(place);
    U = reinterpret_cast<SpatialT<T>*>(place + 36 * bodies);
    rest = place + 42 * bodies;
  }
};

static_assert(sizeof(TreeBodyT<Eight>) == (kTreeBody - 48) * sizeof(Eight));
static_assert(sizeof(TreeContactT<Eight>) == kTreeContact * sizeof(Eight));
static_assert(sizeof(TreeJointT<Eight>) == kTreeJoint * sizeof(Eight));

template <class T>
class TreeNewton {
 public:
  TreeNewton(const NewtonT<T>& newton, double tolerance, double accepted, ConstraintsT<T>& set)
      : tree_(*newton.tree), newton_(newton), set_(set), tolerance_(tolerance), accepted_(max(accepted, tolerance)) {
    const TreeRowsT<T> memory(newton.memory, tree_.topology.bodies);
    A_ = memory.A, U_ = memory.U;
    T* place = memory.rest;
    const auto take = [&](int count) {
      T* rows = place;
      place += count;
      return rows;
    };
    const int nv = newton.nv;
    T** rows[] = {&y_, &start_, &trial_, &step_, &gradient_, &scratch_};
    for (T** row : rows) *row = take(nv);
    wrenches_ = reinterpret_cast<SpatialT<T>*>(take(6 * tree_.topology.bodies));
    bodies_ = reinterpret_cast<TreeBodyT<T>*>(take((kTreeBody - 48) * tree_.topology.bodies));
    contacts_ = reinterpret_cast<TreeContactT<T>*>(take(kTreeContact * set.contact_count));
    joints_ = reinterpret_cast<TreeJointT<T>*>(take(kTreeJoint * set.joint_count));
  }

  /// Of `lanes`, those whose matrix is a tree's: no contact between two bodies, no joint that is held or follows.
  unsigned eligible(const ContactLawT<T>& law, unsigned lanes) const {
    lanes &= ~bits(law.convex > T(0.0));
    for (int k = 0; k < newton_.nv; ++k) lanes &= bits(newton_.inverse_D[k] > T(0.0));
    for (int i = 0; i < set_.contact_count && lanes != 0; ++i) {
      const PathView& path = set_.paths[set_.contacts[i].path];
      if ((path.body_a >= 0 && path.body_b >= 0) || path.mimics) lanes &= ~set_.contacts[i].lanes;
    }
    return lanes;
  }

  /// From the impulses and dz as they are, at most so many steps. Returns the lanes that converge; theirs are the
  /// results then, and `residual` (m/s) what is left of the laws; others keep what they have. `steps`: of all `lanes`.
  unsigned run(unsigned lanes, int most, T* dz, T& steps, T& residual) {
    begin(dz, mask_from_bits<T>(lanes));
    going_ = mask_from_bits<T>(lanes);
    converged_ = mask_from_bits<T>(0);
    copy(start_, y_, going_);
    merit_ = evaluate(y_);
    for (int n = 0; n < most && any(going_); ++n) advance();
    converged_ = converged_ | (going_ & is_accepted());
    steps = select(mask_from_bits<T>(lanes), steps_, steps);
    if (!any(converged_)) return 0;
    take_impulses(dz);
    residual = select(converged_, left_, residual);
    return bits(converged_);
  }

 private:
  using Mask = mask_of<T>;

  void copy(T* to, const T* from, const Mask& where) const {
    for (int k = 0; k < newton_.nv; ++k) to[k] = select(where, from[k], to[k]);
  }

  /// The dof of a joint's row.
  static int dof_of(const JointRowT<T>& row) { return row.dofs[row.count - 1]; }
  static int body_of(const PathView& path) { return path.body_a >= 0 ? path.body_a : path.body_b; }
  static T side_of(const PathView& path) { return T(path.body_a >= 0 ? 1.0 : -1.0); }

  void begin(const T* dz, const Mask& lanes) {
    const TopologyView& t = tree_.topology;
    const int nv = newton_.nv;
    // Velocities that the step ends with but for constraints, less those that it begins with.
    for (int k = 0; k < nv; ++k) trial_[k] = newton_.free[k], y_[k] = dz[k] - newton_.free[k];
    solve_L<T>(tree_, trial_);
    solve_L<T>(tree_, y_);
    find_twists(trial_);
    T stiffest(1e-300);
    for (int i = 0; i < set_.contact_count; ++i) {
      const ContactT<T>& c = set_.contacts[i];
      const PathView& path = set_.paths[c.path];
      const Mask here = lanes & mask_from_bits<T>(c.lanes);
      TreeContactT<T>& own = contacts_[i];
      const int body = body_of(path);
      const int root = t.root[body];
      own.r = root < 0 ? c.p : c.p - tree_.origin[root];
      own.b = c.b + velocity(c, own, path, bodies_[body].V);
      own.kept = c.lambda;
      own.rn = c.ann, own.rt = max(c.ass, c.att);
      const T trace = c.ann + c.ass + c.att - c.compliance - T(2.0) * c.guard;
      stiffest = select(here, max(stiffest, trace), stiffest);
    }
    for (int i = 0; i < set_.joint_count; ++i) {
      const JointRowT<T>& row = set_.joints[i];
      TreeJointT<T>& own = joints_[i];
      own.b = row.b + trial_[dof_of(row)];
      own.r = recip(row.inverse_a);
      own.kept[0] = row.lower, own.kept[1] = row.upper, own.kept[2] = row.dry;
      stiffest = select(lanes & mask_from_bits<T>(row.lanes), max(stiffest, own.r), stiffest);
    }
    stiffest_ = stiffest;
    goal_ = T(kNewtonError * kNewtonError * tolerance_ * tolerance_) * recip(stiffest);
    T energy(0.0), mass(0.0);
    for (int k = 0; k < nv; ++k) {
      const T D = recip(newton_.inverse_D[k]), before = newton_.start[k], after = before + newton_.free[k];
      energy = fma(D, max(before * before, after * after), energy);
      mass += D;
    }
    momentum_ = sqrt(energy * mass);
  }

  /// Twists of all bodies at joint velocities v.
  void find_twists(const T* v) {
    const TopologyView& t = tree_.topology;
    for (int i = 0; i < t.bodies; ++i) {
      SpatialT<T>& V = bodies_[i].V;
      const T* vi = v + t.v[i];
      if (t.kind[i] == kFloating) {
        V = {{vi[0], vi[1], vi[2]}, {vi[3], vi[4], vi[5]}};
        continue;
      }
      const SpatialT<T>& S = tree_.motion[i].S;
      const SpatialT<T> rate{*vi * S.w, *vi * S.l};
      V = t.parent[i] < 0 ? rate : bodies_[t.parent[i]].V + rate;
    }
  }

  static Vec3T<T> velocity(const ContactT<T>& c, const TreeContactT<T>& own, const PathView& path,
                           const SpatialT<T>& V) {
    return side_of(path) * to_local(c, cross_add(V.w, own.r, V.l));
  }

  /// All lambda and G at y and the gradient M y - J^T lambda; returns f^T M f with f = M^-1 gradient.
  GRAZE_OUT_OF_LINE T evaluate(const T* y) {
    const TopologyView& t = tree_.topology;
    find_twists(y);
    for (int i = 0; i < t.bodies; ++i) bodies_[i].F = tree_.motion[i].I * bodies_[i].V;
    for (int i = 0; i < set_.contact_count; ++i) visit(i);
    for (int k = 0; k < newton_.nv; ++k) gradient_[k] = newton_.diagonal[k] * y[k];
    for (int i = t.bodies - 1; i >= 0; --i) {
      const SpatialT<T>& F = bodies_[i].F;
      T* own = gradient_ + t.v[i];
      if (t.kind[i] == kFloating) {
        own[0] = F.w.x, own[1] = F.w.y, own[2] = F.w.z, own[3] = F.l.x, own[4] = F.l.y, own[5] = F.l.z;
        continue;
      }
      own[0] += dot(tree_.motion[i].S, F);
      if (t.parent[i] >= 0) bodies_[t.parent[i]].F = bodies_[t.parent[i]].F + F;
    }
    for (int i = 0; i < set_.joint_count; ++i) visit_joint(i, y);
    T merit(0.0);
    visit_forces(tree_, U_, gradient_, wrenches_,
                 [&](int k, const T& x) { merit = fma(x * newton_.inverse_D[k], x, merit); });
    return merit;
  }

  /// Impulse and G of a contact at the twist of its body, and what the impulse takes from the wrench.
  void visit(int i) {
    const ContactT<T>& c = set_.contacts[i];
    const PathView& path = set_.paths[c.path];
    TreeContactT<T>& own = contacts_[i];
    TreeBodyT<T>& body = bodies_[body_of(path)];
    find_impulses<T>(false, eps_, own.b + velocity(c, own, path, body.V), c, own);
    const Mask here = mask_from_bits<T>(c.lanes);
    const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
    own.lambda = select(here, own.lambda, none);
    own.n = select(here, own.n, none), own.s = select(here, own.s, none), own.t = select(here, own.t, none);
    const Vec3T<T> force = side_of(path) * to_world(c, own.lambda);
    body.F.l -= force;
    body.F.w -= cross(own.r, force);
  }

  void visit_joint(int i, const T* y) {
    const JointRowT<T>& c = set_.joints[i];
    TreeJointT<T>& own = joints_[i];
    find_impulses<T>(eps_, own.b + y[dof_of(c)], c, own);
    const Mask here = mask_from_bits<T>(c.lanes);
    for (T& lambda : own.lambda) lambda = select(here, lambda, T(0.0));
    own.g = select(here, own.g, T(0.0));
    gradient_[dof_of(c)] -= own.lambda[0] - own.lambda[1] + own.lambda[2];
  }

  /// A += the contact's stiffness: with P = [r]x, ((-P G P, P G), (-G P, G)) of G in world axes.
  static void add_stiffness(const ContactT<T>& c, const TreeContactT<T>& own, SpatialMatrixT<T>& A) {
    const Vec3T<T> axes[3] = {c.n, c.s, c.t}, rows[3] = {own.n, own.s, own.t};
    // half[a]: row a of G R, world axes
    Vec3T<T> half[3], G[3];
    for (int a = 0; a < 3; ++a) half[a] = axpy(rows[a].x, c.n, axpy(rows[a].y, c.s, rows[a].z * c.t));
    const auto weigh = [&](const T& n, const T& s, const T& t) {
      return axpy(n, half[0], axpy(s, half[1], t * half[2]));
    };
    G[0] = weigh(axes[0].x, axes[1].x, axes[2].x);
    G[1] = weigh(axes[0].y, axes[1].y, axes[2].y);
    G[2] = weigh(axes[0].z, axes[1].z, axes[2].z);
    const Vec3T<T>& r = own.r;
    // -G P: row g becomes r x g.
    Vec3T<T> H[3];
    for (int a = 0; a < 3; ++a) H[a] = cross(r, G[a]);
    const auto put = [&](int row, int column, const Vec3T<T>& x) {
      T* at = A.at + 6 * row + column;
      at[0] += x.x, at[1] += x.y, at[2] += x.z;
    };
    for (int a = 0; a < 3; ++a) put(3 + a, 3, G[a]), put(3 + a, 0, H[a]);
    const auto turned = [&](const Vec3T<T>* X, int a) {  // row a of P X
      if (a == 0) return axpy(r.y, X[2], -(r.z * X[1]));
      if (a == 1) return axpy(r.z, X[0], -(r.x * X[2]));
      return axpy(r.x, X[1], -(r.y * X[0]));
    };
    for (int a = 0; a < 3; ++a) put(a, 3, turned(G, a)), put(a, 0, turned(H, a));
  }

  /// step = -(M + J^T G J)^-1 gradient.
  GRAZE_OUT_OF_LINE void find_step() {
    const TopologyView& t = tree_.topology;
    const T zero(0.0);
    for (int i = 0; i < t.bodies; ++i) {
      set_inertia(tree_.motion[i].I, A_[i]);
      bodies_[i].F = {{zero, zero, zero}, {zero, zero, zero}};
    }
    for (int i = 0; i < set_.contact_count; ++i) {
      const ContactT<T>& c = set_.contacts[i];
      if (any(contacts_[i].n.x > zero)) add_stiffness(c, contacts_[i], A_[body_of(set_.paths[c.path])]);
    }
    for (int k = 0; k < newton_.nv; ++k) scratch_[k] = newton_.diagonal[k];
    for (int i = 0; i < set_.joint_count; ++i) scratch_[dof_of(set_.joints[i])] += joints_[i].g;
    for (int i = t.bodies - 1; i >= 0; --i) {
      if (t.kind[i] == kFloating) {
        solve_base(i);
      } else {
        eliminate_joint(i);
      }
    }
    for (int i = 0; i < t.bodies; ++i) {
      if (t.kind[i] == kFloating) continue;  // solve_base has its twist
      TreeBodyT<T>& body = bodies_[i];
      const SpatialT<T>& S = tree_.motion[i].S;
      T& x = step_[t.v[i]];
      if (t.parent[i] < 0) {
        x = body.u * body.inverse;
        body.V = {x * S.w, x * S.l};
        continue;
      }
      const SpatialT<T>& above = bodies_[t.parent[i]].V;
      x = (body.u - dot(body.W, above)) * body.inverse;
      body.V = above + SpatialT<T>{x * S.w, x * S.l};
    }
  }

  void eliminate_joint(int i) {
    const TopologyView& t = tree_.topology;
    TreeBodyT<T>& body = bodies_[i];
    const SpatialT<T>& S = tree_.motion[i].S;
    const JointShareT<T> share = share_of_joint(A_[i], S);
    body.W = share.W;
    body.inverse = recip(share.d + scratch_[t.v[i]]);
    body.u = -gradient_[t.v[i]] - dot(S, body.F);
    if (t.parent[i] < 0) return;
    add_through_joint(A_[i], share, body.inverse, A_[t.parent[i]]);
    SpatialT<T>& above = bodies_[t.parent[i]].F;
    const T given = body.u * body.inverse;
    above.w += axpy(given, share.U.w, body.F.w), above.l += axpy(given, share.U.l, body.F.l);
  }

  void solve_base(int i) {
    const T* g = gradient_ + tree_.topology.v[i];
    TreeBodyT<T>& body = bodies_[i];
    T x[6];
    to_array(body.F, x);
    for (int k = 0; k < 6; ++k) x[k] = -g[k] - x[k];
    solve_in_place(A_[i], x);
    for (int k = 0; k < 6; ++k) step_[tree_.topology.v[i] + k] = x[k];
    body.V = to_spatial(x);
  }

  /// The largest R |lambda - kept|, m/s.
  T left() const {
    T most(0.0);
    for (int i = 0; i < set_.contact_count; ++i) {
      const TreeContactT<T>& c = contacts_[i];
      const Vec3T<T> off = c.lambda - c.kept;
      const T each = max(c.rn * abs(off.x), c.rt * sqrt(fma(off.y, off.y, off.z * off.z)));
      most = select(mask_from_bits<T>(set_.contacts[i].lanes), max(most, each), most);
    }
    for (int i = 0; i < set_.joint_count; ++i) {
      const TreeJointT<T>& c = joints_[i];
      const T off = max(abs(c.lambda[0] - c.kept[0]), abs(c.lambda[1] - c.kept[1]));
      const T each = c.r * max(off, abs(c.lambda[2] - c.kept[2]));
      most = select(mask_from_bits<T>(set_.joints[i].lanes), max(most, each), most);
    }
    return eps_ * most;
  }

  /// As NewtonProblem has them, of lambda, which is to be kept.
  T squeezed() const {
    T most(0.0);
    for (int i = 0; i < set_.contact_count; ++i) {
      const ContactT<T>& c = set_.contacts[i];
      const Vec3T<T>& at = contacts_[i].lambda;
      const T felt = select(c.phi < -c.deep, T(0.0), c.guard);
      most = select(mask_from_bits<T>(c.lanes), max(most, felt * max(at.x, max(abs(at.y), abs(at.z)))), most);
    }
    return most;
  }
  void keep(const Mask& where) {
    for (int i = 0; i < set_.contact_count; ++i) {
      contacts_[i].kept = select(where, contacts_[i].lambda, contacts_[i].kept);
    }
    for (int i = 0; i < set_.joint_count; ++i) {
      for (int k = 0; k < 3; ++k) joints_[i].kept[k] = select(where, joints_[i].lambda[k], joints_[i].kept[k]);
    }
  }
  Mask bears() const {
    T most(0.0);
    for (int i = 0; i < set_.contact_count; ++i) {
      most = select(mask_from_bits<T>(set_.contacts[i].lanes), max(most, contacts_[i].kept.x), most);
    }
    return most <= T(kMostSqueeze) * momentum_;
  }
  Mask is_accepted() const {
    const Mask kept = max(left_, squeezed_) <= T(accepted_), usual = least_ >= T(kLeastEps), bearing = bears();
    return kept & (usual | bearing);
  }

  /// One step of Newton's method in all lanes that are going; where it ends a proximal step, the next begins.
  void advance() {
    find_step();
    T share(1.0), next = merit_;
    Mask trying = going_, good = mask_from_bits<T>(0);
    for (int k = 0; k < kHalvings && any(trying); ++k) {
      // Lanes that have found theirs are evaluated where they are, and stay as they are.
      for (int d = 0; d < newton_.nv; ++d) trial_[d] = select(trying, fma(share, step_[d], y_[d]), trial_[d]);
      const T merit = evaluate(trial_);
      next = select(trying, merit, next);
      good = good | (trying & ((merit <= fnma(T(0.1) * share, merit_, merit_)) | (merit < goal_)));
      trying = trying & !good;
      share = select(trying, T(0.5) * share, share);
    }
    const Mask taken = going_ & (good | (next <= merit_));
    steps_ = select(going_, steps_ + T(1.0), steps_);
    since_ = select(going_, since_ + T(1.0), since_);
    merit_ = select(going_, next, merit_);
    copy(y_, trial_, taken);
    const T now = left();
    const Mask there = taken & ((next < goal_) | ((now > T(accepted_)) & (next * stiffest_ < now * now)));
    const Mask ends = there | (going_ & !(taken & (since_ < T(kNewtonSteps))));
    if (!any(ends)) return;
    end_proximal(there, ends, now);
  }

  void end_proximal(const Mask& there, const Mask& ends, const T& now) {
    const Mask falls = there & (now < T(kFalls) * left_);
    left_ = select(there, now, left_);
    squeezed_ = select(there, squeezed(), squeezed_);
    keep(there);
    copy(start_, y_, there);
    copy(y_, start_, ends & !there);
    const Mask exact = there & (max(left_, squeezed_) <= T(tolerance_));
    const Mask finest = least_ < T(kLeastEps);
    const Mask bearing = bears();
    converged_ = converged_ | (exact & ((!finest) | bearing));
    going_ = going_ & !exact;
    const Mask on = ends & !exact;
    const Mask ended = on & there & ((left_ <= T(tolerance_)) | ((eps_ <= least_) & !falls));
    const Mask finer = ended & (left_ > T(accepted_)) & (least_ > T(kLastEps));
    const Mask stops = on & (!finer) & (ended | ((!there) & ((eps_ >= T(kLargestEps)) | finest)));
    converged_ = converged_ | (stops & is_accepted());
    going_ = going_ & !stops;
    const T usual = select(there, max(T(kShrink) * eps_, least_), T(kGrow) * eps_);
    eps_ = select(finer, T(0.1) * eps_, select(on & !stops, usual, eps_));
    least_ = select(finer, T(kLastEps), least_);
    since_ = select(on, T(0.0), since_);
    if (!any(on & going_)) return;
    // Of all lanes: those that are within a proximal step find again what they have.
    const T merit = evaluate(y_);
    merit_ = select(going_, merit, merit_);
  }

  /// Of the lanes that have converged.
  void take_impulses(T* dz) {
    for (int k = 0; k < newton_.nv; ++k) scratch_[k] = newton_.free[k];
    for (int i = 0; i < set_.joint_count; ++i) {
      JointRowT<T>& row = set_.joints[i];
      const Mask here = converged_ & mask_from_bits<T>(row.lanes);
      const TreeJointT<T>& own = joints_[i];
      // The sum with 0 turns -0 into +0; here and below.
      const T lower = own.kept[0] + T(0.0), upper = own.kept[1] + T(0.0), dry = own.kept[2] + T(0.0);
      row.lower = select(here, lower, row.lower), row.upper = select(here, upper, row.upper);
      row.dry = select(here, dry, row.dry);
      apply_row(row, select(here, lower - upper + dry, T(0.0)), scratch_);
    }
    const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
    for (int i = 0; i < set_.contact_count; ++i) {
      ContactT<T>& c = set_.contacts[i];
      const Mask here = converged_ & mask_from_bits<T>(c.lanes);
      if (!any(here)) continue;
      const Vec3T<T> kept = contacts_[i].kept + zero;
      c.lambda = select(here, kept, c.lambda);
      const PathView& path = set_.paths[c.path];
      const Vec3T<T>* scaled = c.y + path.count;
      const Vec3T<T> impulse = select(here, kept, zero);
      for (int d = 0; d < path.count; ++d) scratch_[path.dofs[d]] = dot_add(scaled[d], impulse, scratch_[path.dofs[d]]);
    }
    copy(dz, scratch_, converged_);
    for (int i = 0; i < set_.contact_count; ++i) take_slip(i, dz);
  }

  /// Where a contact slips, and at what rate.
  void take_slip(int i, const T* dz) {
    ContactT<T>& c = set_.contacts[i];
    const Mask here = converged_ & mask_from_bits<T>(c.lanes);
    if (!any(here)) return;
    const PathView& path = set_.paths[c.path];
    Vec3T<T> u = c.b;
    for (int d = 0; d < path.count; ++d) u = axpy(dz[path.dofs[d]], c.y[d], u);
    const SlipT<T> slip = slip_of<T>(c.friction, c.guard, c.lambda, u);
    c.slips = select(here, select(slip.slips, T(1.0), T(0.0)), c.slips);
    c.slip_rate = select(here & slip.slips, slip.rate, c.slip_rate);
  }

  const TreeT<T>& tree_;
  const NewtonT<T>& newton_;
  ConstraintsT<T>& set_;
  double tolerance_, accepted_;
  T *y_, *start_, *trial_, *step_, *gradient_, *scratch_;  // y: change of v by the constraints; m/s, rad/s
  SpatialMatrixT<T>* A_;
  const SpatialT<T>* U_;
  SpatialT<T>* wrenches_;
  TreeBodyT<T>* bodies_;
  TreeContactT<T>* contacts_;
  TreeJointT<T>* joints_;
  Mask going_, converged_;
  T stiffest_, goal_, momentum_, merit_;
  T eps_{kFirstEps}, least_{kLeastEps}, left_{1e300}, squeezed_{1e300};
  T steps_{0.0}, since_{0.0};  // of all, and of this proximal step
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
