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
  }

  /// `bodies`: those whose contacts count; empty: all. Pairs with what stands in the world.
  void watch(const Model& model, const std::vector<int>& bodies) {
    grids_.reserve(model.colliders.size());
    hulls_.reserve(2 * model.colliders.size());
    hull_views_.reserve(2 * model.colliders.size());
    for (const ColliderPair& pair : model.pairs) {
      const Collider *own = &model.colliders[pair.a], *ground = &model.colliders[pair.b];
      if (own->body < 0) std::swap(own, ground);
      if (own->body < 0 || own->body >= view_.topology.bodies || ground->body >= 0 || !ground->is_object) continue;
      if (!bodies.empty() && std::find(bodies.begin(), bodies.end(), own->body) == bodies.end()) continue;
      pairs_.push_back({part_of(*own), part_of(*ground), link_of(model, own->body), pair.friction});
      room_ += most_points(own->shape.kind, ground->shape.kind);
    }
    int pushed = 0;
    for (std::size_t i = 0; i < links_.size(); ++i) {
      links_[i].frame = frames_[i].data();
      pushed += links_[i].frames;
    }
    room_ = std::max(room_, pushed);
  }

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
    out.pair_count = static_cast<int>(pairs_.size());
    out.pairs = pairs_.data();
    out.link_count = static_cast<int>(links_.size());
    out.links = links_.data();
    return out;
  }

 private:
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
      out.terrain = &grids_.emplace_back(HeightView{shape.grid->nx, shape.grid->ny, shape.grid->height.data()});
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
    m.M = take(t.row[t.nv], rows), m.H = take(t.row[t.nv], rows);
    m.q = take(t.nq, rows);
    for (double** at :
         {&m.inverse_D, &m.bias, &m.v, &m.want, &m.free, &m.z, &m.step, &m.trial, &m.gradient, &m.torque, &m.weight}) {
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
    dofs_.resize(room_), link_of_contact_.resize(room_), lanes_.resize(room_);
    view_.memory.dof_of_contact = dofs_.data();
    view_.memory.link_of_contact = link_of_contact_.data();
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
  std::vector<int> q_, v_, dofs_, link_of_contact_;
  std::vector<unsigned> lanes_;
  std::vector<FollowerView> followers_;
  std::vector<double> damping_;
  std::vector<GroundPairView> pairs_;
  std::vector<TouchingLinkView> links_;
  std::vector<std::vector<int>> frames_;  // of each link
  std::vector<HeightView> grids_;
  std::vector<HullArrays> hulls_;
  std::vector<HullView> hull_views_;
  int room_ = 0;
  BlockArray memory_;
};

}  // namespace graze
