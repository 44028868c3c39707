#pragma once
// The contacts that inverse dynamics counts on: what the nominal robot, and what it is told of, touches within the
// step, or what its links are sensed to be pressed by, as contacts of the program (contact_program.h).

#include "engine/contact/collide.h"
#include "engine/control/contact_program.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Gap terms as the lane engine's rigid contacts have them (gap_term in constraint.h): Eq. 67 where bodies are apart, a
/// fifth of an overlap and at most 0.1 m/s where they are not.
inline constexpr double kOverlapShare = 0.2, kOverlapSpeed = 0.1;
template <class T>
inline T* rows_of(double* p) {
  return reinterpret_cast<T*>(p);
}

template <class T>
inline ShapeT<T> shape_of(const GroundPairView::Part& part) {
  return {constant_vec3<T>(part.size), part.terrain, part.hull};
}

template <class T>
inline PoseT<T> pose_of(const GroundPairView::Part& part) {
  return {constant_matrix<T>(part.pose), constant_vec3<T>(part.pose + 9)};
}

/// Lanes in which a pair may have contacts.
template <class T>
inline unsigned watched(const InverseDynamicsView& view, const InverseDynamicsCall& call, const GroundPairView& pair) {
  if (!view.told || pair.link < 0) return call.active;
  const TouchingLinkView& link = view.links[pair.link];
  T force(0.0);
  for (int i = 0; i < link.frames; ++i) force += load<T>(call.link_force + link.frame[i] * kWidth<T>);
  return call.active & bits(force > T(view.force));
}

static_assert(sizeof(ProgramContactT<double>) == kProgramContactRows * sizeof(double));

template <class T>
inline ContactProgramT<T> program_of(const InverseDynamicsView& view, const TreeT<T>& tree) {
  const InverseDynamicsMemory& m = view.memory;
  ContactProgramT<T> out{};
  out.tree = tree;
  out.tree.topology = view.program;
  out.tree.M = rows_of<T>(m.H);
  out.A = tree.M;
  out.contacts = reinterpret_cast<ProgramContactT<T>*>(m.contacts);
  out.jacobian = reinterpret_cast<Vec3T<T>*>(m.jacobian);
  out.room = view.topology.nv;
  out.last_dof = m.dof_of_contact;
  out.lanes = m.lanes_of_contact;
  out.free = rows_of<T>(m.free), out.weight = rows_of<T>(m.weight);
  out.z = rows_of<T>(m.z), out.step = rows_of<T>(m.step), out.trial = rows_of<T>(m.trial);
  out.gradient = rows_of<T>(m.gradient);
  out.slips = view.law != PredictedContact::no_slip;
  out.free_count = view.free_count, out.bodies = view.free;
  out.joint_begin = view.joint_begin, out.joint_end = view.joint_end;
  return out;
}

/// The last degree of freedom that moves a body.
inline int last_dof_of(const TopologyView& t, int body) { return t.v[body] + (t.kind[body] == kFloating ? 5 : 0); }

/// +-J^T of a contact for what moves a body, by the depth in the program.
template <class T>
inline void add_columns(const TreeT<T>& tree, const TopologyView& program, int body, double side,
                        const ContactFrameT<T>& c, Vec3T<T>* J) {
  const TopologyView& t = tree.topology;
  for (; body >= 0; body = t.parent[body]) {
    Vec3T<T>* const own = J + program.dof_depth[t.v[body]];
    if (t.kind[body] != kFloating) {
      own[0] = joint_jacobian(tree, body, side, c);
      continue;
    }
    Vec3T<T> base[6];
    base_jacobian(tree, body, side, c, base);
    for (int k = 0; k < 6; ++k) own[k] = base[k];
  }
}

/// About the A, 1/kg, that a contact at p feels of the free body that carries `body`, if there is one. The robot's
/// weight tells its mass.
template <class T>
inline T felt_of(const InverseDynamicsView& view, const TreeT<T>& tree, int body, const Vec3T<T>& p) {
  const TopologyView& t = tree.topology;
  if (body < 0 || t.root[body] < 0) return T(0.0);
  const T* M = tree.M + t.row[t.v[t.root[body]]];
  const T moment = T(1.0 / 3.0) * (M[0] + M[2] + M[5]);
  const bool robot = view.floating && t.root[body] == 0;
  return fma(norm2(p - tree.origin[t.root[body]]), recip(moment), robot ? T(9.81 / view.weight) : recip(M[9]));
}

/// A contact of a body in some lanes, with another one or with the world (-1), about the frame whose normal and point
/// it has. What it says in other lanes does not matter, but that it is a number.
template <class T>
inline ProgramContactT<T>& add_program_contact(const InverseDynamicsView& view, const TreeT<T>& tree, int link,
                                               int body, int other, unsigned lanes, const Vec3T<T>& n,
                                               const Vec3T<T>& p, ContactProgramT<T>& program) {
  const int i = program.count++;
  const TopologyView& t = tree.topology;
  ProgramContactT<T>& c = program.contacts[i];
  const auto valid = mask_from_bits<T>(lanes);
  c.n = select(valid, n, Vec3T<T>{T(0.0), T(0.0), T(1.0)});
  c.p = select(valid, p, tree.origin[view.free_count > 0 ? view.free[0].body : 0]);
  make_tangents(c);
  Vec3T<T>* J = program.jacobian + program.room * i;
  int last = last_dof_of(t, body);
  if (other >= 0) {
    const int dof = last_dof_of(t, other);
    if (view.program.dof_depth[dof] > view.program.dof_depth[last]) last = dof;
  }
  if (view.free_count > 1 || !view.floating) {  // the way up leads through bodies that have no part in it
    for (int d = 0; d <= view.program.dof_depth[last]; ++d) J[d] = {T(0.0), T(0.0), T(0.0)};
  }
  add_columns(tree, view.program, body, 1.0, c, J);
  add_columns(tree, view.program, other, -1.0, c, J);
  c.a = felt_of(view, tree, body, c.p) + felt_of(view, tree, other, c.p);
  c.friction = c.gap = T(0.0);
  c.cone.kept = {T(0.0), T(0.0), T(0.0)};
  view.memory.place_of_contact[i] = -1;
  view.memory.dof_of_contact[i] = last;
  view.memory.link_of_contact[i] = link;
  view.memory.lanes_of_contact[i] = lanes;
  return c;
}

/// Gap term of a point. One that the controller is told of touches, whatever its own geometry says.
template <class T>
inline T gap_of(const InverseDynamicsView& view, const GroundPairView& pair, const ContactPointT<T>& point,
                unsigned lanes) {
  if (view.told && pair.link >= 0) return T(0.0);
  const T rate = T(1.0 / view.h) * select(mask_from_bits<T>(lanes), point.phi, T(0.0));
  return select(rate < T(0.0), max(T(kOverlapShare) * rate, T(-kOverlapSpeed)), rate);
}

/// All contacts that the nominal robot, and what it holds, may have within the step.
template <class T>
GRAZE_OUT_OF_LINE void find_program_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                             const TreeT<T>& tree, ContactProgramT<T>& program) {
  for (int k = 0; k < view.pair_count; ++k) {
    const GroundPairView& pair = view.pairs[k];
    const unsigned watch = watched<T>(view, call, pair);
    if (watch == 0) continue;
    ManifoldT<T> manifold;
    const PoseT<T> pose = tree.pose[pair.body] * pose_of<T>(pair.own);
    const PoseT<T> there = pair.other < 0 ? pose_of<T>(pair.ground) : tree.pose[pair.other] * pose_of<T>(pair.ground);
    collide<T>(pair.own.kind, shape_of<T>(pair.own), pose, pair.ground.kind, shape_of<T>(pair.ground), there,
               T(view.within), manifold);
    for (int i = 0; i < manifold.count && program.count < view.memory.room; ++i) {
      const ContactPointT<T>& point = manifold.point[i];
      const unsigned lanes = bits(point.valid) & watch;
      if (lanes == 0) continue;
      ProgramContactT<T>& c =
          add_program_contact(view, tree, pair.link, pair.body, pair.other, lanes, point.n, point.p, program);
      c.friction = T(pair.friction);
      c.gap = gap_of(view, pair, point, lanes);
      view.memory.place_of_contact[program.count - 1] = pair.place + i;
    }
  }
}

/// Forces on links as they were sensed become contacts with their impulses, each frame at its point.
template <class T>
GRAZE_OUT_OF_LINE void find_sensed_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                            const TreeT<T>& tree, ContactProgramT<T>& program) {
  const Vec3T<T> up{T(0.0), T(0.0), T(1.0)};
  for (int k = 0; k < view.link_count; ++k) {
    for (int i = 0; i < view.links[k].frames; ++i) {
      const double* row = call.link_push + 6 * kWidth<T> * view.links[k].frame[i];
      const Vec3T<T> force = load_vec3<T>(row);
      const unsigned lanes = call.active & bits(norm2(force) > T(0.0));
      if (lanes == 0) continue;
      ProgramContactT<T>& c = add_program_contact(view, tree, k, view.links[k].body, -1, lanes, up,
                                                  load_vec3<T>(row + 3 * kWidth<T>), program);
      const Vec3T<T> impulse = T(view.h) * select(mask_from_bits<T>(lanes), force, Vec3T<T>{T(0.0), T(0.0), T(0.0)});
      c.cone.kept = to_local(c, impulse);
    }
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
