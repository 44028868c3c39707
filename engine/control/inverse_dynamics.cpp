// Tracker `inverse_dynamics` (dissertation Chapter 7): torques that give the joints of the nominal robot, where it is
// sensed, the accelerations kp (q_des - q) + kd (v_des - v), with the contact forces that follow from them predicted by
// a convex program (§7.5) instead of sensed. The law stands in inverse_dynamics.h, its program in contact_program.h.
//
// Where the print has a friction pyramid here is Coulomb's cone, as in the engine: Newton's method projects on it as
// cheaply, and predictions agree with what happens. Where it minimises kinetic energy subject to N v >= -phi / h, the
// gap terms stand in the objective, as the engine's `complementarity_free` has them; both are one for phi = 0.

#include <algorithm>

#include "engine/contact/hull_arrays.h"
#include "engine/control/joint_values.h"
#include "engine/control/kernel.h"
#include "engine/control/policy.h"
#include "engine/control/rows.h"
#include "engine/dynamics/dynamics_model.h"
#include "engine/lanes/isa.h"
#include "engine/model/hull.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

const Description& inverse_dynamics_description() {
  static const Description text = {
      "torques that give the nominal robot's joints the accelerations kp (q_des − q) + kd (q̇_des − q̇), with predicted "
      "contact forces",
      {{"kp",
        {Form::joint_numbers(Quantity::dimensionless, Bound::not_negative)},
        Default::required(),
        "acceleration for each rad (m) off the target, 1/s²"},
       {"kd",
        {Form::joint_numbers(Quantity::dimensionless, Bound::not_negative)},
        Default::value("0"),
        "acceleration for each rad/s (m/s) off its velocity, 1/s"},
       {"servo",
        {Form::map({"a servo in each joint beside", {servo_spring(), servo_damper()}})},
        Default::words("none"),
        "a servo in each joint beside, as `joint_pd` has it: for robots that are not what the model says"},
       {"model",
        {Form::word({"qp_coulomb", "none"})},
        Default::value("qp_coulomb"),
        "of contact: Coulomb's friction, or as if the robot were in the air"},
       {"regularization",
        {Form::number(Quantity::dimensionless, Bound::fraction)},
        Default::value("1e-6"),
        "weight of the torques against maximal dissipation; `1e-6`: two stages, least torques of all that dissipate "
        "most; 1e-3: one stage"},
       {"contacts",
        {Form::map({"which points count as contacts",
                    {{"from",
                      {Form::word({"distance", "flags"})},
                      Default::value("distance"),
                      "the nominal gap, or the contact sensors of the links"},
                     {"within", {Form::number(Quantity::length, Bound::positive)}, Default::value("5 mm"), "this gap"},
                     {"force",
                      {Form::number(Quantity::force, Bound::not_negative)},
                      Default::value("0 N"),
                      "a flag is up where a link is pressed by more than this"}}})},
        Default::words("by distance"),
        "which points count as contacts"}},
      {},
      {},
      "Contacts are of the policy's feet, or of all links if it has none, with what stands in the nominal world. It "
      "knows nominal masses, friction and world, and sensed joints, base and flags."};
  return text;
}

/// Bodies of the robot: movable objects stand behind them.
int robot_bodies(const Model& model) {
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
      frames_.emplace_back();
      for (std::size_t f = 0; f < model.frames.size(); ++f) {
        if (model.frames[f].body == own->body) frames_.back().push_back(static_cast<int>(f));
      }
      const bool floats = model.bodies[own->body].type == JointType::floating;
      pairs_.push_back({part_of(*own), part_of(*ground), own->body, model.bodies[own->body].v + (floats ? 5 : 0),
                        pair.friction, static_cast<int>(frames_.back().size()), nullptr});
      room_ += most_points(own->shape.kind, ground->shape.kind);
    }
    for (std::size_t i = 0; i < pairs_.size(); ++i) pairs_[i].frame = frames_[i].data();
  }

  bool floating() const { return view_.floating; }
  bool can_touch() const { return !pairs_.empty(); }

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
    return out;
  }

 private:
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
    return rows + 1;
  }

  void lay_out() {
    memory_ = BlockArray();
    memory_ = BlockArray(lay_out_rows());
    lay_out_rows();
    dofs_.resize(room_), lanes_.resize(room_);
    view_.memory.dof_of_contact = dofs_.data();
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
  std::vector<int> q_, v_, dofs_;
  std::vector<unsigned> lanes_;
  std::vector<FollowerView> followers_;
  std::vector<double> damping_;
  std::vector<GroundPairView> pairs_;
  std::vector<std::vector<int>> frames_;
  std::vector<HeightView> grids_;
  std::vector<HullArrays> hulls_;
  std::vector<HullView> hull_views_;
  int room_ = 0;
  BlockArray memory_;
};

class InverseDynamics : public Tracker {
 public:
  InverseDynamics(const ControlContext& context, const Described& own, const std::vector<int>& effectors)
      : kernel_(GRAZE_KERNEL(chosen_isa(), find_control_kernel)), robot_(context.nominal) {
    const Model& model = context.nominal;
    kp_ = read_gains(model, own, "kp");
    kd_ = read_gains(model, own, "kd");
    if (const auto servo = own.find("servo")) {
      static const Description text = *inverse_dynamics_description().find("servo")->forms.front().inner;
      const Described described(*servo, text);
      servo_kp_ = read_gains(model, described, "kp", Quantity::stiffness);
      servo_kd_ = read_gains(model, described, "kd", Quantity::damping);
    }
    const std::string law = own.word("model");
    const bool predicts = law != "none";
    if (predicts && !robot_.floating()) {
      own.settings().fail("model: " + law +
                          ": contact forces are found from how they move the base, and this one is "
                          "fixed to the world; here it is model: none");
    }
    std::vector<int> bodies;
    for (const int frame : effectors) bodies.push_back(model.frames[frame].body);
    if (predicts) robot_.watch(model, bodies);
    if (predicts && !robot_.can_touch()) {
      warn(own.settings(),
           "no part of the robot that counts can touch anything that stands in the world, so that no "
           "contact is predicted; if that is meant: model: none");
    }
    read_contacts(own);
    view_ = robot_.view();
    view_.kp = kp_.data(), view_.kd = kd_.data();
    view_.h = context.period;
    view_.law = predicts ? PredictedContact::coulomb : PredictedContact::none;
    view_.stiffness = std::max(own.number("regularization"), 1e-9);  // below, rounding decides
    view_.by_flags = by_flags_, view_.within = within_, view_.force = force_;
  }

  TargetKind kind() const override { return TargetKind::joint; }
  unsigned reads() const override {
    const unsigned base = kBasePosition | kBaseRpy | kBaseVelocity | kBaseRate;
    const unsigned servo = servo_kp_.empty() ? 0u : kServoPosition | kServoVelocity;
    return kJointPosition | kJointVelocity | servo | (view_.floating ? base : 0u) | (by_flags_ ? kLinkForce : 0u);
  }

  void track(const Observation& observation, const Targets& targets, LaneMask active,
             ActuatorCommand& command) override {
    const auto base = [&](const BlockArray& group) { return view_.floating ? group.row(0) : nullptr; };
    kernel_.inverse_dynamics(
        view_, {active.bits(), observation.joint_position.row(0), observation.joint_velocity.row(0),
                base(observation.base_position), base(observation.base_rpy), base(observation.base_velocity),
                base(observation.base_rate), by_flags_ ? observation.link_force.row(0) : nullptr, targets.q.row(0),
                targets.v.row(0), targets.tau.row(0), command.tau.row(0), command.kp.row(0), command.kd.row(0),
                command.ki.row(0)});
    for (std::size_t k = 0; k < servo_kp_.size(); ++k) {
      const int row = static_cast<int>(k);
      copy_lanes(command.q.row(row), targets.q.row(row), active);
      copy_lanes(command.v.row(row), targets.v.row(row), active);
      fill_lanes(command.kp.row(row), servo_kp_[k], active);
      fill_lanes(command.kd.row(row), servo_kd_[k], active);
    }
  }

 private:
  void read_contacts(const Described& own) {
    const auto written = own.find("contacts");
    if (!written) return;
    static const Description text = *inverse_dynamics_description().find("contacts")->forms.front().inner;
    const Described contacts(*written, text);
    by_flags_ = contacts.word("from") == "flags";
    within_ = contacts.number("within");
    force_ = contacts.number("force");
    if (!by_flags_ && contacts.has("force")) contacts.at("force").fail_key("goes with from: flags");
  }

  const ControlKernel& kernel_;
  NominalRobot robot_;
  std::vector<double> kp_, kd_, servo_kp_, servo_kd_;
  bool by_flags_ = false;
  double within_ = 5e-3, force_ = 0;
  InverseDynamicsView view_{};
};

const TrackerRegistration inverse_dynamics_registration(
    "inverse_dynamics", inverse_dynamics_description(), TargetKind::joint,
    [](const ControlContext& context, const Described& own, const std::vector<int>& effectors)
        -> std::unique_ptr<Tracker> { return std::make_unique<InverseDynamics>(context, own, effectors); });

}  // namespace

}  // namespace graze
