// Tracker `inverse_dynamics` (dissertation Chapter 7): torques that give the joints of the nominal robot, where it is
// sensed, the accelerations kp (q_des - q) + kd (v_des - v), with the contact forces that follow from them predicted by
// a convex program (§7.5) instead of sensed. The law stands in inverse_dynamics.h, its program in contact_program.h.
//
// Where the print has a friction pyramid here is Coulomb's cone, as in the engine: Newton's method projects on it as
// cheaply, and predictions agree with what happens. Where it minimises kinetic energy subject to N v >= -phi / h, the
// gap terms stand in the objective, as the engine's `complementarity_free` has them; both are one for phi = 0.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/control/contact_pivoting.h"
#include "engine/control/joint_values.h"
#include "engine/control/kernel.h"
#include "engine/control/nominal_robot.h"
#include "engine/control/policy.h"
#include "engine/control/rows.h"
#include "engine/control/sensed_history.h"
#include "engine/lanes/isa.h"
#include "engine/model/measures.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

/// Of the robot's weight: a foot that presses more than this touches, as published.
constexpr double kFeltShare = 0.1;
/// Control steps: no delay of a sensor is longer.
constexpr double kMostDelay = 1000;

/// s: with that of a control step of 1 ms a robot on rigid ground throws its own legs (our choice, docs/control.md).
constexpr double kHorizon = 20e-3;

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
       {"ki",
        {Form::joint_numbers(Quantity::dimensionless, Bound::not_negative)},
        Default::value("0"),
        "acceleration for each rad s (m s) that it was off, 1/s³; the sum stands still while the motor is at its "
        "limit"},
       {"model",
        {Form::word({"qp_coulomb", "qp_no_slip", "lcp_coulomb", "lcp_no_slip", "sensed", "none"})},
        Default::value("qp_coulomb"),
        "of contact: the convex program or the complementarity problem, with Coulomb's friction or without slip; "
        "forces "
        "as they were sensed; or as if the robot were in the air"},
       {"horizon",
        {Form::number(Quantity::time, Bound::positive)},
        Default::words("20 ms, or the control step if that is longer"),
        "in which contacts take up what moves against them: long ones leave impacts out"},
       {"regularization",
        {Form::number(Quantity::dimensionless, Bound::fraction)},
        Default::value("1e-6"),
        "weight of the torques against maximal dissipation; `1e-6`: two stages, least torques of all that dissipate "
        "most; 1e-3: one stage"},
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
        "what is known of contacts"}},
      {},
      {},
      "Contacts are of the policy's feet, or of all links if it has none, with what stands in the nominal world. It "
      "knows nominal masses, friction and world, and sensed joints, base, flags and forces."};
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
  InverseDynamics(const ControlContext& context, const Described& own, const std::vector<int>& effectors)
      : kernel_(GRAZE_KERNEL(chosen_isa(), find_control_kernel)), robot_(context.nominal), period_(context.period) {
    const Model& model = context.nominal;
    read_gains_of(model, own);
    const std::string word = own.word("model");
    const PredictedContact law = law_of(word);
    watch(model, own, word, effectors);
    view_ = robot_.view();
    view_.kp = kp_.data(), view_.kd = kd_.data(), view_.ki = ki_.data();
    view_.h = own.has("horizon") ? own.number("horizon") : std::max(kHorizon, context.period);
    view_.law = law;
    view_.stiffness = std::max(own.number("regularization"), 1e-9);  // below, rounding decides
    view_.within = 5e-3;
    if (law == PredictedContact::pivoted) {
      pivoting_ = ContactPivoting(word == "lcp_coulomb");
      pivoting_.serve(view_);
    }
    read_contacts(model, own);
    const bool sensed = law == PredictedContact::sensed;
    const int frames = static_cast<int>(model.frames.size());
    felt_ = SensedHistory(sensed ? 6 * frames : view_.told ? frames : 0, delay_);
  }

  TargetKind kind() const override { return TargetKind::joint; }
  unsigned reads() const override {
    const unsigned base = kBasePosition | kBaseRpy | kBaseVelocity | kBaseRate;
    const unsigned servo = servo_kp_.empty() ? 0u : kServoPosition | kServoVelocity;
    const unsigned push = view_.law == PredictedContact::sensed ? kLinkPush : 0u;
    return kJointPosition | kJointVelocity | servo | push | (view_.floating ? base : 0u) |
           (view_.told ? kLinkForce : 0u);
  }

  void start(int lane) override {
    felt_.start(lane);
    pivoting_.start(lane);
    for (int k = 0; k < error_sum_.rows(); ++k) error_sum_(k, lane) = 0;
  }
  void carry(int lane, LaneTape& tape) override {
    felt_.carry(lane, tape);
    pivoting_.carry(lane, tape);
    tape.carry(error_sum_, lane);
  }

  void track(const Observation& observation, const Targets& targets, LaneMask active,
             ActuatorCommand& command) override {
    const auto base = [&](const BlockArray& group) { return view_.floating ? group.row(0) : nullptr; };
    const bool sensed = view_.law == PredictedContact::sensed;
    const double* felt = felt_.pass(sensed ? observation.link_push : observation.link_force, active);
    const double* sum = error_sum_.rows() > 0 ? error_sum_.row(0) : nullptr;
    kernel_.inverse_dynamics(
        view_, {active.bits(), observation.joint_position.row(0), observation.joint_velocity.row(0),
                base(observation.base_position), base(observation.base_rpy), base(observation.base_velocity),
                base(observation.base_rate), sensed ? nullptr : felt, sensed ? felt : nullptr, sum, targets.q.row(0),
                targets.v.row(0), targets.tau.row(0), command.tau.row(0), command.kp.row(0), command.kd.row(0),
                command.ki.row(0)});
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
    kp_ = read_gains(model, own, "kp");
    kd_ = read_gains(model, own, "kd");
    ki_ = read_gains(model, own, "ki");
    if (std::any_of(ki_.begin(), ki_.end(), [](double k) { return k > 0; })) error_sum_ = BlockArray(model.na());
    for (const int body : model.actuated) effort_.push_back(model.bodies[body].effort);
    const auto servo = own.find("servo");
    if (!servo) return;
    static const Description text = *inverse_dynamics_description().find("servo")->forms.front().inner;
    const Described described(*servo, text);
    servo_kp_ = read_gains(model, described, "kp", Quantity::stiffness);
    servo_kd_ = read_gains(model, described, "kd", Quantity::damping);
  }

  void watch(const Model& model, const Described& own, const std::string& word, const std::vector<int>& effectors) {
    if (word == "none") return;
    if (!robot_.floating()) {
      own.settings().fail("model: " + word +
                          ": contact forces are found from how they move the base, and this one is "
                          "fixed to the world; here it is model: none");
    }
    std::vector<int> bodies;
    for (const int frame : effectors) bodies.push_back(model.frames[frame].body);
    robot_.watch(model, bodies);
    for (const TouchingLinkView& link : robot_.links()) {
      inside_.push_back({model.bodies[link.body].name + ".predicted_normal_force", "N"});
    }
    if (robot_.can_touch()) return;
    warn(own.settings(),
         "no part of the robot that counts can touch anything that stands in the world, so that no "
         "contact is predicted; if that is meant: model: none");
  }

  void read_contacts(const Model& model, const Described& own) {
    const auto written = own.find("contacts");
    if (!written) return;
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
    }
    const double steps = std::round(contacts.number("delay") / period_);
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
  NominalRobot robot_;
  double period_;
  std::vector<double> kp_, kd_, ki_, servo_kp_, servo_kd_, effort_;
  int delay_ = 0;  // control steps
  BlockArray error_sum_;
  SensedHistory felt_;
  ContactPivoting pivoting_;
  std::vector<Inside> inside_;
  InverseDynamicsView view_{};
};

const TrackerRegistration inverse_dynamics_registration(
    "inverse_dynamics", inverse_dynamics_description(), TargetKind::joint,
    [](const ControlContext& context, const Described& own, const std::vector<int>& effectors)
        -> std::unique_ptr<Tracker> { return std::make_unique<InverseDynamics>(context, own, effectors); });

}  // namespace

}  // namespace graze
