// Policy `tool_path`: a point of a tool (a gripper, a pen) goes along straight lines at constant speed, and other
// joints (fingers) turn meanwhile: the operational-space trajectories of §4.3.1. Joints follow by inverse kinematics of
// the nominal arm, position alone, from each control step to the next; the tool's attitude is what comes of it. All of
// it depends on time alone, so that it is computed once for all particles.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/control/joint_values.h"
#include "engine/control/leg_ik.h"
#include "engine/dynamics/chain.h"
#include "engine/model/placement.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

constexpr double kMostPathSteps = 1e6;     // control steps that a path may take
constexpr double kMostReach = 1e6;         // m: of a place that an arm may be sent to
constexpr double kOffThePath = 1e-3;       // m: farther off the inverse kinematics has failed
constexpr double kPathRoundingOff = 1e-9;  // s, of the times at which parts of a path begin

const Description& path_part_description() {
  static const Description text = {
      "one part of the path behind the other",
      {{"to", {Form::numbers(3, Quantity::length)}, {}, "where the point goes, `[x, y, z]` in the world"},
       {"by", {Form::numbers(3, Quantity::length)}, {}, "how far it goes from where it is, world axes"},
       {"wait", {Form::number(Quantity::time, Bound::not_negative)}, {}, "how long it stays where it is"},
       {"joints",
        {Form::joint_numbers(Quantity::angle), Form::joint_numbers(Quantity::length)},
        {},
        "where other joints go from the beginning of this part on, such as fingers"}},
      {{"to", "by", "wait"}}};
  return text;
}

const Description& tool_path_description() {
  static const Description text = {
      "moves a point of a tool along straight lines, and other joints such as fingers",
      {{"link", {Form::text("LINK")}, Default::required(), "the tool; its arm is all joints from there to the base"},
       {"point", {Form::numbers(3, Quantity::length)}, Default::value("[0, 0, 0] m"), "in the link's frame"},
       {"speed", {Form::number(Quantity::velocity, Bound::positive)}, Default::required(), "of the point on its way"},
       {"rate",
        {Form::joint_numbers(Quantity::angular_velocity, Bound::positive),
         Form::joint_numbers(Quantity::velocity, Bound::positive)},
        Default::value("1 rad/s"),
        "at which the other joints go"},
       {"path", {Form::maps(path_part_description())}, Default::required(), path_part_description().help}}};
  return text;
}

/// A straight line of the point, or a pause, with what other joints begin to do.
struct PathPart {
  double begin, end;           // s
  Vec3 from, to;               // in the base's frame, m
  std::vector<double> joints;  // [na] goals, rad or m; NaN: stays as it is
  Settings settings;
};

/// Joint targets at each control step.
struct JointSamples {
  int joints = 0;
  std::vector<double> q, v;  // [step][joint]
  std::size_t steps() const { return q.size() / static_cast<std::size_t>(joints); }
};

/// Reads a path and follows it by inverse kinematics.
class PathPlan {
 public:
  PathPlan(const ControlContext& context, const Described& own)
      : context_(context), own_(own), frame_(find_tool()), chain_(make_chain()), view_(chain_.view()) {
    const std::vector<double> point =
        own.has("point") ? own.at("point").numbers(3, Quantity::length) : std::vector<double>(3, 0.0);
    if (!(Vec3::Map(point.data()).cwiseAbs().maxCoeff() <= kMostReach)) {
      own.at("point").fail(fmt::format("must lie within {:g} m of the link", kMostReach));
    }
    Vec3::Map(view_.tip) = context.nominal.frames[frame_].X_BF * Vec3::Map(point.data());
    rates_ = read_joint_values_or(context.nominal, own, "rate", Quantity::velocity);
    read_parts();
  }

  JointSamples follow() const {
    const double period = context_.period, length = std::min(parts_.back().end, context_.end);
    const double steps = std::ceil(length / period - kPathRoundingOff) + 1;
    if (!(steps <= kMostPathSteps)) {
      own_.at("path").fail(
          fmt::format("takes {:.4g} s, {:.4g} control steps; at most {:g}", length, steps, kMostPathSteps));
    }
    JointSamples out;
    out.joints = context_.nominal.na();
    std::vector<double> q = actuated_positions(context_.nominal, context_.initial), goal = q;
    std::size_t part = 0;
    for (double step = 0; step < steps; ++step) {
      const double t = step * period;
      while (part < parts_.size() && t >= parts_[part].begin - kPathRoundingOff) take_goals(parts_[part++], goal);
      move_arm(parts_[std::max<std::size_t>(part, 1) - 1], t, q);
      if (step > 0) move_others(goal, q);
      out.q.insert(out.q.end(), q.begin(), q.end());
    }
    out.v.assign(out.q.size(), 0.0);
    for (std::size_t i = 0; i + out.joints < out.q.size(); ++i) out.v[i] = (out.q[i + out.joints] - out.q[i]) / period;
    return out;
  }

 private:
  int find_tool() const {
    const Model& model = context_.nominal;
    if (model.floating_base) {
      own_.settings().fail_key("moves the tool of a robot whose base is fixed to the world; this one's is free");
    }
    const Settings link = own_.at("link");
    const int frame = model.frame(link.text());
    if (frame >= 0) return frame;
    std::vector<std::string> names;
    for (const Frame& one : model.frames) names.push_back(one.name);
    link.fail(fmt::format("'{}' is no link of the robot; {}", link.text(), nearest_or_all(link.text(), names)));
  }

  Chain make_chain() const try { return Chain(context_.nominal, frame_); } catch (const std::invalid_argument& error) {
    own_.at("link").fail(error.what());
  }

  bool moves_tool(int joint) const {
    return std::any_of(chain_.joints().begin(), chain_.joints().end(),
                       [&](const ChainJointView& one) { return one.actuator == joint; });
  }

  /// Goals of the other joints; NaN for those that are not named.
  std::vector<double> read_goals(const Settings& part) const {
    const Model& model = context_.nominal;
    const double none = std::numeric_limits<double>::quiet_NaN();
    const std::optional<Settings> joints = part.find("joints");
    if (!joints) return std::vector<double>(model.na(), none);
    const std::vector<double> goals = read_joint_values(model, *joints, Quantity::angle, none, Quantity::length);
    for (int k = 0; k < model.na(); ++k) {
      if (std::isnan(goals[k])) continue;
      const Settings typed = joint_entry(model, *joints, k);
      if (moves_tool(k)) {
        typed.fail_key(fmt::format("joint {} is one of those that move {}, which follows the path; name others only",
                                   model.bodies[model.actuated[k]].joint, own_.at("link").text()));
      }
      if (!(rates_[k] > 0)) {
        own_.at("rate").fail(fmt::format("must be > 0 for joint {}, which is sent to {:g}",
                                         model.bodies[model.actuated[k]].joint, goals[k]));
      }
      doubt_targets(model, k, goals[k], goals[k], typed);
    }
    return goals;
  }

  void read_parts() {
    const Pose X_base_world = fixed_base_pose(context_.nominal).inverse();
    const Chain::Values q = chain_.select(context_.initial.q);
    const Vec3T<double> tip = chain_tip<double, 0>(view_, q.data());
    Vec3 here(tip.x, tip.y, tip.z);
    double time = 0;
    const double speed = own_.number("speed");
    for (const Settings& item : own_.at("path").items()) {
      const Described part(item, path_part_description());
      PathPart next{time, time, here, here, read_goals(item), item};
      if (part.has("wait")) {
        next.end += part.number("wait");
      } else {
        const std::vector<double> numbers = item.at(part.has("to") ? "to" : "by").numbers(3, Quantity::length);
        const Vec3 given = Vec3::Map(numbers.data());
        if (!(given.cwiseAbs().maxCoeff() <= kMostReach)) {
          item.at(part.has("to") ? "to" : "by").fail(fmt::format("must lie within {:g} m", kMostReach));
        }
        next.to = part.has("to") ? Vec3(X_base_world * given) : Vec3(here + X_base_world.linear() * given);
        next.end += (next.to - here).norm() / speed;
      }
      here = next.to;
      time = next.end;
      parts_.push_back(std::move(next));
    }
    if (parts_.empty()) own_.at("path").fail("has no parts; at least one of {to: …}, {by: …}, {wait: …} must be there");
    if (time > context_.end + kPathRoundingOff) {
      warn(own_.at("path"), fmt::format("takes {:.4g} s, and no trace is longer than {:g} s", time, context_.end));
    }
  }

  static void take_goals(const PathPart& part, std::vector<double>& goal) {
    for (std::size_t k = 0; k < goal.size(); ++k) {
      if (!std::isnan(part.joints[k])) goal[k] = part.joints[k];
    }
  }

  /// The arm's joints such that the point is where it shall be at t, from where they are.
  void move_arm(const PathPart& part, double t, std::vector<double>& q) const {
    const double share = t < part.end ? std::max(0.0, (t - part.begin) / (part.end - part.begin)) : 1.0;
    const Vec3 x = part.from + share * (part.to - part.from);
    double own[kMaxChainJoints];
    for (int i = 0; i < chain_.size(); ++i) own[i] = q[chain_.joints()[i].actuator];
    const double off = solve_damped(view_, Vec3T<double>{x.x(), x.y(), x.z()}, own);
    if (!(off <= kOffThePath)) {
      const double way = 1e3 * (part.to - part.from).norm();
      part.settings.fail(
          fmt::format("the arm follows {:.4g} mm of this part's {:.4g} mm: from there on the point is off, by "
                      "{:.3g} mm; it must end nearer to the base, come by another way, or, where the arm begins "
                      "stretched, begin with bent joints (robot.initial.joints)",
                      share * way, way, 1e3 * off));
    }
    for (int i = 0; i < chain_.size(); ++i) q[chain_.joints()[i].actuator] = own[i];
  }

  void move_others(const std::vector<double>& goal, std::vector<double>& q) const {
    for (int k = 0; k < static_cast<int>(q.size()); ++k) {
      const double most = std::max(0.0, rates_[k]) * context_.period;
      if (!moves_tool(k)) q[k] += std::clamp(goal[k] - q[k], -most, most);
    }
  }

  const ControlContext& context_;
  const Described& own_;
  const int frame_;
  const Chain chain_;
  ChainView view_;             // of chain_, its tip the point
  std::vector<double> rates_;  // [na], rad/s or m/s
  std::vector<PathPart> parts_;
};

class ToolPath : public Policy {
 public:
  ToolPath(JointSamples samples, double period) : samples_(std::move(samples)), period_(period) {}

  void start(int) override {}
  void carry(int, LaneTape&) override {}
  unsigned reads() const override { return 0; }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      const double step =
          std::clamp(std::round(observation.time[lane] / period_), 0.0, static_cast<double>(samples_.steps() - 1));
      const std::size_t row = static_cast<std::size_t>(step) * static_cast<std::size_t>(samples_.joints);
      for (int k = 0; k < samples_.joints; ++k) {
        targets.q(k, lane) = samples_.q[row + k];
        targets.v(k, lane) = samples_.v[row + k];
        targets.tau(k, lane) = 0;
      }
    }
  }

 private:
  JointSamples samples_;
  double period_;  // s
};

const PolicyRegistration tool_path_registration("tool_path", tool_path_description(),
                                                [](const ControlContext& context, const Described& own,
                                                   TargetKind kind) -> std::unique_ptr<Policy> {
                                                  need_joint_targets(own, kind, "tool_path");
                                                  return std::make_unique<ToolPath>(PathPlan(context, own).follow(),
                                                                                    context.period);
                                                });

}  // namespace

}  // namespace graze
