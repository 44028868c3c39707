// Trackers `inverse_dynamics` and `operational_inverse_dynamics` (dissertation Chapter 7): torques that give the joints
// of the nominal robot, where it is sensed, the accelerations kp (q_des - q) + kd (v_des - v), or those that pull its
// effectors to their targets (operational_wish.h), with the contact forces that follow from them predicted by a convex
// program (§7.5) instead of sensed. The law stands in inverse_dynamics.h, its program in contact_program.h.
//
// Where the print has a friction pyramid here is Coulomb's cone, as in the engine: Newton's method projects on it as
// cheaply, and predictions agree with what happens. Where it minimises kinetic energy subject to N v >= -phi / h, the
// gap terms stand in the objective, as the engine's `complementarity_free` has them; both are one for phi = 0.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/control/contact_pivoting.h"
#include "engine/control/inverse_dynamics_doubts.h"
#include "engine/control/joint_values.h"
#include "engine/control/kernel.h"
#include "engine/control/nominal_robot.h"
#include "engine/control/policy.h"
#include "engine/control/rows.h"
#include "engine/control/sensed_history.h"
#include "engine/dynamics/chain.h"
#include "engine/lanes/isa.h"
#include "engine/model/measures.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

/// Of the robot's weight: a foot that presses more than this touches, as published.
constexpr double kFeltShare = 0.1;
/// Control steps: no delay of a sensor is longer.
constexpr double kMostDelay = 1000;
/// m: a gap that no foot closes within a control step.
constexpr double kFarContact = 0.2;

/// s: with that of a control step of 1 ms a robot on rigid ground throws its own legs (our choice, docs/control.md).
constexpr double kHorizon = 20e-3;

// Weights of the torques against maximal dissipation, our choice. Joints move as they are told, so that feet which the
// ground keeps from it by a velocity of u press against each other by u / (weight A): at the published second stage's
// 1e-6 a biped that stands on its feet is thrown into the air by what contact solvers leave of a velocity, 1e-6 m/s.
// Without friction's bound they press along the ground as well, and a light robot hops at 1e-3. Where hands grip,
// joints move as the contacts let them, so that nothing contradicts them; but at 1e-3 a joint whose lever is short
// would count on what is only near, so far it gives way there to its torque.
constexpr double kWithSlip = 1e-3, kWithoutSlip = 1e-2, kGripping = 1e-6;

double default_weight(bool grips, bool slips) {
  if (grips) return kGripping;
  return slips ? kWithSlip : kWithoutSlip;
}

/// What is known of contacts, and how their forces are predicted.
std::vector<Key> contact_keys() {
  return {
      {"model",
       {Form::word({"qp_coulomb", "qp_no_slip", "lcp_coulomb", "lcp_closest", "lcp_no_slip", "sensed", "none"})},
       Default::value("qp_coulomb"),
       "of contact: the convex program or the complementarity problem, with Coulomb's friction or without slip; forces "
       "as they were sensed; or as if the robot were in the air"},
      {"objects",
       {Form::texts(-1, "OBJECT")},
       Default::words("none"),
       "movable objects whose poses and velocities it is told of, exactly, as by a camera that sees all: they count "
       "among "
       "what the robot may touch, move as contacts make them, and have their nominal masses"},
      {"horizon",
       {Form::number(Quantity::time, Bound::positive)},
       Default::words("20 ms, or the control step if that is longer"),
       "in which contacts take up what moves against them: long ones leave impacts out"},
      {"regularization",
       {Form::number(Quantity::dimensionless, Bound::fraction)},
       Default::words(
           fmt::format("{:g}, {:g} without slip, and {:g} with `objects`", kWithSlip, kWithoutSlip, kGripping)),
       "weight of the torques against maximal dissipation; `1e-6`: two stages, least torques of all that dissipate "
       "most, for robots on points alone; 1e-3: one stage. Where a complementarity problem has no solution, of the "
       "program whose forces stand"},
      {"contacts",
       {Form::map({"what is known of contacts",
                   {{"from",
                     {Form::word({"distance", "flags", "force"})},
                     Default::value("distance"),
                     "points count by the nominal gap, by the links' contact flags, or by the force that is felt"},
                    {"within", {Form::number(Quantity::length, Bound::positive)}, Default::value("5 mm"), "this gap"},
                    {"force",
                     {Form::number(Quantity::force, Bound::not_negative), Form::text("% of the robot's weight")},
                     Default::words(fmt::format("{:g} % of the robot's weight", 100 * kFeltShare)),
                     "a link touches where it is pressed by more than this (with `from: force`)"},
                    {"delay",
                     {Form::number(Quantity::time, Bound::not_negative)},
                     Default::value("0 s"),
                     "of flags and sensed forces, in whole control steps"}}})},
       Default::words("by distance"),
       "what is known of contacts"}};
}

const char* const kKnows =
    "Contacts are of the policy's feet, or of all links if it has none, with what stands in the nominal world, and of "
    "all "
    "links with `objects`. It knows nominal masses, friction and world, and sensed joints, base, objects, flags and "
    "forces.";

const Description& inverse_dynamics_description() {
  static const Description text = [] {
    Description out = {
        "torques that give the nominal robot's joints the accelerations kp (q_des − q) + kd (q̇_des − q̇), with "
        "predicted "
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
         {"ki",
          {Form::joint_numbers(Quantity::dimensionless, Bound::not_negative)},
          Default::value("0"),
          "acceleration for each rad s (m s) that it was off, 1/s³; the sum stands still while the motor is at its "
          "limit"}},
        {},
        {},
        kKnows};
    for (Key& key : contact_keys()) out.keys.push_back(std::move(key));
    return out;
  }();
  return text;
}

const Description& operational_description() {
  static const Description text = [] {
    Description out = {
        "torques that pull the nominal robot's feet to their targets by accelerations, with predicted contact forces, "
        "and "
        "by a spring and a damper beside",
        {{"kp",
          {Form::number(Quantity::dimensionless, Bound::not_negative)},
          Default::required(),
          "acceleration for each metre off the target, 1/s²"},
         {"kd",
          {Form::number(Quantity::dimensionless, Bound::not_negative)},
          Default::value("0"),
          "acceleration for each m/s off its velocity, 1/s"},
         {"map",
          {Form::word({"inverse", "transposed"})},
          Default::value("inverse"),
          "joint accelerations that give a foot that acceleration, by least squares; `transposed`: Jᵀ times it, as "
          "published: kp and kd are then per kg m² in effect"},
         {"servo",
          {Form::map({"a spring and a damper between each foot and its target",
                      {{"kp", {Form::number(Quantity::stiffness, Bound::not_negative)}, Default::required(), "spring"},
                       {"kd",
                        {Form::number(Quantity::damping, Bound::not_negative)},
                        Default::value("0 N s/m"),
                        "damper, by the velocity that follows"}}})},
          Default::words("none"),
          "a spring and a damper between each foot and its target beside, as `operational_pd` has them"}},
        {},
        {},
        std::string("Joints that move no foot keep their velocities. ") + kKnows};
    for (Key& key : contact_keys()) out.keys.push_back(std::move(key));
    return out;
  }();
  return text;
}

/// What law of contact a word means.
PredictedContact law_of(const std::string& word) {
  if (word == "none") return PredictedContact::none;
  if (word == "sensed") return PredictedContact::sensed;
  if (word == "qp_no_slip") return PredictedContact::no_slip;
  return word == "qp_coulomb" ? PredictedContact::coulomb : PredictedContact::pivoted;
}

class InverseDynamics : public Tracker {
 public:
  /// kind: what has targets, the joints or the effectors.
  InverseDynamics(const ControlContext& context, const Described& own, const std::vector<int>& effectors,
                  TargetKind kind)
      : kernel_(GRAZE_KERNEL(chosen_isa(), find_control_kernel)),
        kind_(kind),
        robot_(context.nominal),
        period_(context.period) {
    const Model& model = context.nominal;
    if (kind == TargetKind::joint) {
      read_gains_of(model, own);
    } else {
      read_effectors(context, own, effectors);
    }
    const std::string word = own.word("model");
    const PredictedContact law = law_of(word);
    watch(model, own, word, effectors);
    view_ = robot_.view();
    view_.kp = kp_.data(), view_.kd = kd_.data(), view_.ki = ki_.data();
    view_.operational = operational_;
    view_.h = own.has("horizon") ? own.number("horizon") : std::max(kHorizon, context.period);
    view_.law = law;
    view_.stiffness = own.has("regularization")
                          ? std::max(own.number("regularization"), 1e-9)  // rounding decides below
                          : default_weight(view_.grips(), !word.ends_with("no_slip"));
    view_.within = 5e-3;
    if (law == PredictedContact::pivoted) {
      pivoting_ = ContactPivoting(word == "lcp_no_slip"   ? Pivoting::no_slip
                                  : word == "lcp_closest" ? Pivoting::closest
                                                          : Pivoting::coulomb);
      pivoting_.serve(view_);
    }
    read_contacts(model, own);
    doubt_horizon(own, law, word);
    if (law != PredictedContact::none) doubt_efforts(model, own);
    const bool sensed = law == PredictedContact::sensed;
    const int frames = static_cast<int>(model.frames.size());
    felt_ = SensedHistory(sensed ? 6 * frames : view_.told ? frames : 0, delay_);
  }

  TargetKind kind() const override { return kind_; }
  unsigned reads() const override {
    const unsigned base = kBasePosition | kBaseRpy | kBaseVelocity | kBaseRate;
    const unsigned servo = servo_kp_.empty() ? 0u : kServoPosition | kServoVelocity;
    const unsigned push = view_.law == PredictedContact::sensed ? kLinkPush : 0u;
    return kJointPosition | kJointVelocity | servo | push | (view_.floating ? base : 0u) |
           (view_.told ? kLinkForce : 0u) | (told_of_.empty() ? 0u : kObjectState);
  }

  void start(int lane) override {
    felt_.start(lane);
    pivoting_.start(lane);
    for (int k = 0; k < robot_.impulses().rows(); ++k) robot_.impulses()(k, lane) = 0;
    for (int k = 0; k < error_sum_.rows(); ++k) error_sum_(k, lane) = 0;
  }
  void carry(int lane, LaneTape& tape) override {
    felt_.carry(lane, tape);
    pivoting_.carry(lane, tape);
    tape.carry(robot_.impulses(), lane);
    tape.carry(error_sum_, lane);
  }

  void track(const Observation& observation, const Targets& targets, LaneMask active,
             ActuatorCommand& command) override {
    const auto base = [&](const BlockArray& group) { return view_.floating ? group.row(0) : nullptr; };
    const bool sensed = view_.law == PredictedContact::sensed;
    const double* felt = felt_.pass(sensed ? observation.link_push : observation.link_force, active);
    kernel_.inverse_dynamics(view_, {active.bits(),
                                     observation.joint_position.row(0),
                                     observation.joint_velocity.row(0),
                                     base(observation.base_position),
                                     base(observation.base_rpy),
                                     base(observation.base_velocity),
                                     base(observation.base_rate),
                                     told_of_.empty() ? nullptr : observation.object_state.row(0),
                                     sensed ? nullptr : felt,
                                     sensed ? felt : nullptr,
                                     error_sum_.row(0),
                                     targets.q.row(0),
                                     targets.v.row(0),
                                     targets.tau.row(0),
                                     targets.x.row(0),
                                     targets.xd.row(0),
                                     command.tau.row(0),
                                     command.kp.row(0),
                                     command.kd.row(0),
                                     command.ki.row(0)});
    if (spring_.effectors > 0) {
      kernel_.operational_pd(
          spring_, {active.bits(), observation.joint_position.row(0), observation.joint_velocity.row(0),
                    command.tau.row(0), targets.x.row(0), targets.xd.row(0), command.tau.row(0), command.kp.row(0),
                    command.kd.row(0), command.ki.row(0)});
    }
    sum_errors(observation, targets, active, command);
    for (std::size_t k = 0; k < servo_kp_.size(); ++k) {
      const int row = static_cast<int>(k);
      copy_lanes(command.q.row(row), targets.q.row(row), active);
      copy_lanes(command.v.row(row), targets.v.row(row), active);
      fill_lanes(command.kp.row(row), servo_kp_[k], active);
      fill_lanes(command.kd.row(row), servo_kd_[k], active);
    }
  }

  std::vector<Inside> inside() const override { return inside_; }
  void look_inside(int lane, double* out) const override {
    for (std::size_t k = 0; k < inside_.size(); ++k) out[k] = view_.memory.normal_force[kLanes * k + lane];
  }

 private:
  void read_gains_of(const Model& model, const Described& own) {
    doubt_unnamed(model, own.at("kp"), "accelerate by no error");
    kp_ = read_gains(model, own, "kp");
    kd_ = read_gains(model, own, "kd");
    ki_ = read_gains(model, own, "ki");
    doubt_gains(model, own, kp_, kd_, period_);
    if (std::any_of(ki_.begin(), ki_.end(), [](double k) { return k > 0; })) error_sum_ = BlockArray(model.na());
    for (const int body : model.actuated) effort_.push_back(model.bodies[body].effort);
    const auto servo = own.find("servo");
    if (!servo) return;
    static const Description text = *inverse_dynamics_description().find("servo")->forms.front().inner;
    const Described described(*servo, text);
    servo_kp_ = read_gains(model, described, "kp", Quantity::stiffness);
    servo_kd_ = read_gains(model, described, "kd", Quantity::damping);
  }

  void read_effectors(const ControlContext& context, const Described& own, const std::vector<int>& effectors) {
    for (const int frame : effectors) chains_.emplace_back(context.nominal, frame);
    for (const Chain& chain : chains_) chain_views_.push_back(chain.view());
    const int count = static_cast<int>(chain_views_.size());
    operational_ = {count, chain_views_.data(), own.number("kp"), own.number("kd"), own.word("map") == "transposed"};
    const auto servo = own.find("servo");
    if (!servo) return;
    static const Description text = *operational_description().find("servo")->forms.front().inner;
    const Described spring(*servo, text);
    spring_ = {count,          chain_views_.data(), spring.number("kp"), spring.number("kd"),
               context.period, context.nominal.na()};
  }

  void watch(const Model& model, const Described& own, const std::string& word, const std::vector<int>& effectors) {
    read_objects(model, own, word);
    if (word == "none") return;
    if (!robot_.floating() && told_of_.empty() && word != "sensed") {
      own.settings().fail("model: " + word +
                          ": contact forces count by how they move the base or objects, and this base is fixed to the "
                          "world; name what the robot grips as objects: [OBJECT, …], or say model: none");
    }
    std::vector<int> bodies;
    for (const int frame : effectors) bodies.push_back(model.frames[frame].body);
    robot_.watch(model, bodies, word == "sensed");
    for (const TouchingLinkView& link : robot_.links()) {
      inside_.push_back({model.bodies[link.body].name + ".predicted_normal_force", "N"});
    }
    if (robot_.can_touch()) return;
    warn(own.settings(),
         "no part of the robot that counts can touch anything that stands in the world, so that no "
         "contact is predicted; if that is meant: model: none");
  }

  /// The movable objects that the robot is told of.
  void read_objects(const Model& model, const Described& own, const std::string& word) {
    const auto list = own.find("objects");
    if (!list) return;
    if (word == "none" || word == "sensed") {
      list->fail_key("takes part in predicted contact, and model: " + word + " predicts none");
    }
    std::vector<std::string> names;
    for (std::size_t i = robot_bodies(model); i < model.bodies.size(); ++i) names.push_back(model.bodies[i].name);
    if (list->is_scalar()) list->fail(fmt::format("{0}: must be a list of movable objects: [{0}]", list->text()));
    for (const Settings& item : list->items()) {
      const auto at = std::find(names.begin(), names.end(), item.text());
      if (at == names.end()) {
        item.fail(fmt::format("'{}' is no movable object; {}", item.text(), nearest_or_all(item.text(), names)));
      }
      const int body = robot_bodies(model) + static_cast<int>(at - names.begin());
      if (std::find(told_of_.begin(), told_of_.end(), body) != told_of_.end()) {
        item.fail(fmt::format("'{}' stands twice", item.text()));
      }
      told_of_.push_back(body);
    }
    if (told_of_.empty()) list->fail("is empty; name at least one movable object");
    robot_.tell_of(model, told_of_);
  }

  /// Keys that say how forces are predicted go with a model that predicts some.
  void doubt_horizon(const Described& own, PredictedContact law, const std::string& word) const {
    const bool predicts = law != PredictedContact::none && law != PredictedContact::sensed;
    if (!predicts && own.has("regularization")) {
      own.at("regularization")
          .fail_key(fmt::format("weighs predicted contact forces, and model '{}' predicts none", word));
    }
    if (!own.has("horizon")) return;
    constexpr double kLong = 0.5;  // s: a walk's step
    const Settings horizon = own.at("horizon");
    if (view_.h < period_ * (1 - 1e-9)) {
      warn(horizon, fmt::format("{:g} s: is shorter than a control step of {:g} s, at whose end joints move on",
                                view_.h, period_));
    } else if (view_.h > kLong) {
      warn(horizon,
           fmt::format(
               "{:g} s: contacts take up nothing for so long{}", view_.h,
               is_bare(horizon) && view_.h <= 1000 * kLong ? fmt::format("; did you mean {:g} ms?", view_.h) : ""));
    }
  }

  void read_contacts(const Model& model, const Described& own) {
    const auto written = own.find("contacts");
    if (!written) return;
    if (view_.law == PredictedContact::none)
      written->fail_key("says what is known of contacts, and model: none has none");
    static const Description text = *inverse_dynamics_description().find("contacts")->forms.front().inner;
    const Described contacts(*written, text);
    const std::string from = contacts.word("from");
    const bool sensed = view_.law == PredictedContact::sensed;
    for (const char* key : {"from", "within", "force"}) {
      if (sensed && contacts.has(key))
        contacts.at(key).fail_key("says what is predicted, and model: sensed predicts nothing");
    }
    view_.told = from != "distance" && !sensed;
    view_.within = contacts.number("within");
    if (from == "force") view_.force = kFeltShare * robot_weight(model);
    if (const auto force = contacts.find("force")) {
      if (from != "force") force->fail_key("goes with from: force");
      view_.force = (force->is_scalar() && force->text().ends_with('%')) ? force->non_negative() * robot_weight(model)
                                                                         : contacts.number("force");
      if (view_.force > robot_weight(model) && robot_weight(model) > 0) {
        warn(*force,
             fmt::format("{:g} N: is more than the robot's weight, {:g} N: links count as touching in blows alone",
                         view_.force, robot_weight(model)));
      }
    }
    if (view_.within > kFarContact && contacts.has("within")) {
      warn(contacts.at("within"),
           fmt::format("{:g} m: feet count as in contact that far above the ground{}", view_.within,
                       is_bare(contacts.at("within")) ? "; did you mean mm?" : ""));
    }
    const double exact = contacts.number("delay") / period_, steps = std::round(exact);
    if (std::abs(exact - steps) > 1e-6 * std::max(1.0, steps)) {
      contacts.at("delay").fail(fmt::format("{:g} s: is no whole number of control steps of {:g} s; nearest: {:g} s",
                                            contacts.number("delay"), period_, steps * period_));
    }
    if (steps > 0 && !view_.told && !sensed) {
      contacts.at("delay").fail_key(
          "goes with from: flags, from: force or model: sensed: what is predicted is not late");
    }
    if (steps > kMostDelay) {
      contacts.at("delay").fail(
          fmt::format("{:g} s is more than {:g} control steps of {:g} s, the longest delay of a sensor",
                      contacts.number("delay"), kMostDelay, period_));
    }
    delay_ = static_cast<int>(steps);
  }

  /// A sum of errors stands still while the motor can do no more, and where the robot is lost.
  void sum_errors(const Observation& observation, const Targets& targets, LaneMask active,
                  const ActuatorCommand& command) {
    for (int k = 0; k < error_sum_.rows(); ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!active[lane] || !(std::abs(command.tau(k, lane)) < effort_[k])) continue;
        error_sum_(k, lane) += period_ * (targets.q(k, lane) - observation.joint_position(k, lane));
      }
    }
  }

  const ControlKernel& kernel_;
  TargetKind kind_;
  std::vector<Chain> chains_;  // of the effectors that have targets
  std::vector<ChainView> chain_views_;
  OperationalWishView operational_{};
  OperationalPdOf<double> spring_{};
  NominalRobot robot_;
  std::vector<int> told_of_;  // movable objects, bodies
  double period_;
  std::vector<double> kp_, kd_, ki_, servo_kp_, servo_kd_, effort_;
  int delay_ = 0;  // control steps
  BlockArray error_sum_;
  SensedHistory felt_;
  ContactPivoting pivoting_;
  std::vector<Inside> inside_;
  InverseDynamicsView view_{};
};

/// Makes the tracker for targets of that kind.
template <TargetKind kKind>
std::unique_ptr<Tracker> make_inverse_dynamics(const ControlContext& context, const Described& own,
                                               const std::vector<int>& effectors) {
  return std::make_unique<InverseDynamics>(context, own, effectors, kKind);
}

const TrackerRegistration inverse_dynamics_registration("inverse_dynamics", inverse_dynamics_description(),
                                                        TargetKind::joint, make_inverse_dynamics<TargetKind::joint>);
const TrackerRegistration operational_registration("operational_inverse_dynamics", operational_description(),
                                                   TargetKind::effector, make_inverse_dynamics<TargetKind::effector>);

}  // namespace

}  // namespace graze
