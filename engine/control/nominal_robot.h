#pragma once
// The nominal robot as inverse dynamics computes with it: tables that its kernels read, and their working memory.

#include <algorithm>
#include <vector>

#include "engine/contact/hull_arrays.h"
#include "engine/control/kernel.h"
#include "engine/dynamics/dynamics_model.h"
#include "engine/lanes/block.h"
#include "engine/model/hull.h"
#include "engine/model/model.h"
#include "engine/sensing/sensors.h"

namespace graze {

/// Bodies of the robot: movable objects stand behind them.
inline int robot_bodies(const Model& model) {
  int count = 0;
  for (const Body& body : model.bodies) {
    if (body.type == JointType::floating && count > 0) break;
    if (body.type == JointType::floating && !model.floating_base) break;
    ++count;
  }
  return count;
}

/// The order in which the contact program eliminates degrees of freedom: those of free bodies, in a chain, above all
/// joints, because contacts couple any joint with any of them. As a topology of degrees of freedom alone.
class ProgramOrder {
 public:
  ProgramOrder() = default;
  ProgramOrder(const TopologyView& t, const std::vector<FreeBodyView>& free) {
    std::vector<int> above(t.nv, -1), depth(t.nv, 0);
    int last = -1;
    const auto add = [&](int dof, int parent) {
      order_.push_back(dof);
      above[dof] = parent;
      depth[dof] = parent < 0 ? 0 : depth[parent] + 1;
    };
    for (const FreeBodyView& body : free) {
      for (int k = 0; k < 6; ++k) add(body.dof + k, last), last = body.dof + k;
    }
    for (int i = 0; i < t.bodies; ++i) {
      if (t.kind[i] == kFloating) continue;
      const bool first = t.parent[i] < 0 || t.kind[t.parent[i]] == kFloating;
      add(t.v[i], first ? last : t.v[t.parent[i]]);
    }
    depth_ = depth;
    row_.push_back(0);
    for (int k = 0; k < t.nv; ++k) row_.push_back(row_.back() + depth[k] + 1);
    chain_.resize(row_.back());
    for (int k = 0; k < t.nv; ++k) {
      for (int at = k; at >= 0; at = above[at]) chain_[row_[k] + depth[at]] = at;
    }
    kind_.assign(t.nv, kRevolute), none_.assign(t.nv, -1);
  }

  TopologyView view() const {
    TopologyView out{};
    out.bodies = out.nq = out.nv = static_cast<int>(order_.size());
    out.kind = kind_.data();
    out.root = out.parent = none_.data();
    out.v = order_.data();
    out.dof_depth = depth_.data();
    out.row = row_.data(), out.chain = chain_.data();
    return out;
  }

 private:
  std::vector<int> order_, depth_, row_, chain_, kind_, none_;
};

/// The tables of the nominal robot that the kernels read, and their memory.
class NominalRobot {
 public:
  explicit NominalRobot(const Model& model) : numbers_(model) {
    const int bodies = robot_bodies(model);
    view_.topology = numbers_.topology();
    view_.topology.bodies = bodies;
    view_.topology.nq = view_.topology.nv = 0;
    for (int i = 0; i < bodies; ++i) {
      const bool floats = model.bodies[i].type == JointType::floating;
      view_.topology.nq += floats ? 7 : 1;
      view_.topology.nv += floats ? 6 : 1;
    }
    view_.floating = model.floating_base;
    view_.na = model.na();
    damping_.assign(view_.topology.nv, 0.0);
    for (int i = 0; i < bodies; ++i) {
      const Body& body = model.bodies[i];
      if (body.type != JointType::floating) damping_[body.v] = body.damping;
      if (body.mimics < 0) continue;
      const Body& other = model.bodies[body.mimics];
      followers_.push_back({body.q, body.v, other.q, other.v, body.multiplier, body.offset});
    }
    for (const int body : model.actuated) {
      q_.push_back(model.bodies[body].q);
      v_.push_back(model.bodies[body].v);
    }
    double mass = 0;
    for (int i = 0; i < bodies; ++i) mass += model.bodies[i].mass;
    view_.weight = mass * std::max(1.0, model.gravity.norm());  // a scale of forces, also in space
    if (view_.floating) free_.push_back({0, 0, 0, 0, -1});
    view_.joint_begin = view_.floating ? 6 : 0, view_.joint_end = view_.topology.nv;
    view_.program = view_.topology;
  }

  /// The robot is told of these movable objects (bodies), and of no others. At most once, before watch().
  void tell_of(const Model& model, const std::vector<int>& objects) {
    if (objects.empty()) return;
    const int robot = view_.topology.bodies;
    view_.topology = numbers_.topology();
    damping_.resize(view_.topology.nv, 0.0);
    seen_.assign(model.bodies.size(), false);
    for (const int body : objects) seen_[body] = true;
    for (int i = robot; i < view_.topology.bodies; ++i) {
      const Body& body = model.bodies[i];
      free_.push_back({i, body.q, body.v, view_.topology.row[body.v], seen_[i] ? kObjectRows * (i - robot) : -1});
    }
    order_ = ProgramOrder(view_.topology, free_);
    view_.program = order_.view();
  }

  /// `bodies`: those of the robot whose contacts with what stands in the world count; empty: all. Contacts with objects
  /// that it is told of count for all of its links. `felt`: forces count as they are sensed, whatever presses.
  void watch(const Model& model, const std::vector<int>& bodies, bool felt = false) {
    felt_ = felt;
    grids_.reserve(model.colliders.size());
    hulls_.reserve(2 * model.colliders.size());
    hull_views_.reserve(2 * model.colliders.size());
    for (const ColliderPair& pair : model.pairs) {
      const Collider *own = &model.colliders[pair.a], *other = &model.colliders[pair.b];
      if (own->body < 0 || (is_seen(own->body) && other->body >= 0)) std::swap(own, other);
      if (!counts(model, *own, *other, bodies)) continue;
      const int link = is_seen(own->body) ? -1 : link_of(model, own->body);
      pairs_.push_back({part_of(*own), part_of(*other), link, own->body, other->body, room_, pair.friction});
      room_ += most_points(own->shape.kind, other->shape.kind);
    }
    int pushed = 0;
    for (std::size_t i = 0; i < links_.size(); ++i) {
      links_[i].frame = frames_[i].data();
      pushed += links_[i].frames;
    }
    impulse_ = BlockArray(3 * room_);
    room_ = std::max(room_, pushed);
  }

  /// What a lane keeps from call to call; sized by watch().
  BlockArray& impulses() { return impulse_; }
  bool floating() const { return view_.floating; }
  bool can_touch() const { return !pairs_.empty(); }
  /// Bodies whose contacts count, in the order of InverseDynamicsMemory::normal_force.
  const std::vector<TouchingLinkView>& links() const { return links_; }

  /// With memory; points into this.
  InverseDynamicsView view() {
    lay_out();
    InverseDynamicsView out = view_;
    out.q = q_.data(), out.v = v_.data();
    out.follower_count = static_cast<int>(followers_.size());
    out.followers = followers_.data();
    out.damping = damping_.data();
    out.free_count = static_cast<int>(free_.size()), out.free = free_.data();
    out.pair_count = static_cast<int>(pairs_.size());
    out.pairs = pairs_.data();
    out.link_count = static_cast<int>(links_.size());
    out.links = links_.data();
    return out;
  }

 private:
  bool is_seen(int body) const { return body >= 0 && body < static_cast<int>(seen_.size()) && seen_[body]; }

  /// Whether contacts between two parts count. `own` is the robot's, or both are objects, or `other` stands in the
  /// world.
  bool counts(const Model& model, const Collider& own, const Collider& other, const std::vector<int>& bodies) const {
    if (is_seen(own.body)) return other.body < 0 || is_seen(other.body);
    if (own.body < 0 || own.body >= robot_bodies(model)) return false;
    const bool chosen = bodies.empty() || std::find(bodies.begin(), bodies.end(), own.body) != bodies.end();
    if (felt_) return chosen && (other.is_object || other.body < 0);
    if (other.body >= 0) return is_seen(other.body);
    return chosen && view_.floating && other.is_object;
  }

  /// Index into links_, where the body may be new.
  int link_of(const Model& model, int body) {
    for (std::size_t i = 0; i < links_.size(); ++i) {
      if (links_[i].body == body) return static_cast<int>(i);
    }
    frames_.emplace_back();
    for (std::size_t f = 0; f < model.frames.size(); ++f) {
      if (model.frames[f].body == body) frames_.back().push_back(static_cast<int>(f));
    }
    const int last = model.bodies[body].v + (model.bodies[body].type == JointType::floating ? 5 : 0);
    links_.push_back({body, last, static_cast<int>(frames_.back().size()), nullptr});
    return static_cast<int>(links_.size()) - 1;
  }

  static int most_points(ShapeKind own, ShapeKind ground) {
    const bool terrain = ground == ShapeKind::heightfield;
    if (own == ShapeKind::sphere) return ground == ShapeKind::mesh ? 8 : terrain ? 3 : 1;
    return 8;
  }

  GroundPairView::Part part_of(const Collider& collider) {
    const Shape& shape = collider.shape;
    GroundPairView::Part out{};
    out.kind = shape.kind;
    Pose X = collider.X_BG;
    if (shape.kind == ShapeKind::mesh) {
      hulls_.emplace_back(*hull_of(shape));
      X = hulls_.back().placed(X, shape.size);
      out.hull = &hull_views_.emplace_back(hulls_.back().view());
    }
    if (shape.kind == ShapeKind::heightfield) {
      const HeightView nominal{shape.grid->nx, shape.grid->ny, shape.grid->height.data()};  // whatever a particle has
      out.terrain = grids_.emplace_back(std::vector<HeightView>(kLanes, nominal)).data();
    }
    Vec3::Map(out.size) = shape.size;
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{out.pose} = X.linear();
    Vec3::Map(out.pose + 9) = X.translation();
    return out;
  }

  /// Room for `count` quantities of type S, which has lanes.
  template <class S = double>
  double* take(int count, int& rows) const {
    double* const at = memory_.rows() > 0 ? const_cast<double*>(memory_.row(0)) + kLanes * rows : nullptr;
    rows += count * static_cast<int>(sizeof(S) / sizeof(double));
    return at;
  }

  int lay_out_rows() {
    InverseDynamicsMemory& m = view_.memory;
    const TopologyView& t = view_.topology;
    int rows = 0;
    m.body = take<BodyT<double>>(t.bodies, rows);
    m.gravity = take(3, rows);
    m.motion = take<MotionT<double>>(t.bodies, rows);
    m.pose = take<PoseT<double>>(t.bodies, rows);
    m.origin = take<Vec3T<double>>(t.bodies, rows);
    m.M = take(t.row[t.nv], rows), m.H = take(view_.program.row[t.nv], rows);
    m.q = take(t.nq, rows);
    for (double** at : {&m.inverse_D, &m.bias, &m.v, &m.want, &m.free, &m.z, &m.step, &m.trial, &m.gradient, &m.torque,
                        &m.weight, &m.soft}) {
      *at = take(t.nv, rows);
    }
    m.contacts = take(room_ * kProgramContactRows, rows);
    m.jacobian = take<Vec3T<double>>(room_ * t.nv, rows);
    m.pivot = take(room_ * kPivotRows, rows);
    m.normal_force = take(static_cast<int>(links_.size()), rows);
    return rows + 1;
  }

  void lay_out() {
    memory_ = BlockArray();
    memory_ = BlockArray(lay_out_rows());
    lay_out_rows();
    dofs_.resize(room_), places_.resize(room_), link_of_contact_.resize(room_), lanes_.resize(room_);
    view_.memory.dof_of_contact = dofs_.data();
    view_.memory.link_of_contact = link_of_contact_.data();
    view_.memory.place_of_contact = places_.data();
    view_.memory.places = impulse_.rows() / 3;
    view_.memory.impulse = impulse_.row(0);
    view_.memory.lanes_of_contact = lanes_.data();
    view_.memory.room = room_;
    for (int i = 0; i < view_.topology.bodies; ++i) {
      constexpr int count = sizeof(BodyT<double>) / sizeof(double);
      const double* numbers = reinterpret_cast<const double*>(&numbers_.body(i));
      for (int k = 0; k < count; ++k) std::fill_n(view_.memory.body + kLanes * (i * count + k), kLanes, numbers[k]);
    }
    for (int k = 0; k < 3; ++k) std::fill_n(view_.memory.gravity + kLanes * k, kLanes, numbers_.gravity()[k]);
  }

  DynamicsModel numbers_;
  InverseDynamicsView view_{};
  std::vector<int> q_, v_, dofs_, places_, link_of_contact_;
  std::vector<unsigned> lanes_;
  std::vector<FollowerView> followers_;
  std::vector<FreeBodyView> free_;
  std::vector<bool> seen_;  // per body; empty: none
  bool felt_ = false;
  ProgramOrder order_;
  std::vector<double> damping_;
  std::vector<GroundPairView> pairs_;
  std::vector<TouchingLinkView> links_;
  std::vector<std::vector<int>> frames_;  // of each link
  std::vector<std::vector<HeightView>> grids_;
  std::vector<HullArrays> hulls_;
  std::vector<HullView> hull_views_;
  int room_ = 0;
  BlockArray memory_, impulse_;
};

}  // namespace graze
