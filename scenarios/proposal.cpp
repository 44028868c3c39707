#include "scenarios/proposal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "engine/dynamics/chain.h"
#include "engine/model/measures.h"
#include "engine/model/placement.h"
#include "scenarios/proposal_base.h"
#include "scenarios/proposal_ground.h"
#include "scenarios/proposal_words.h"
#include "scenarios/scenario.h"

namespace graze {
namespace {

/// The end of a limb; a foot, if it reaches down to the lowest quarter of the robot as it begins.
struct Foot {
  std::string link;
  Vec3 place;      // world, m
  int joints = 0;  // between it and the base
  int body = 0, frame = 0;
};

class Proposal {
 public:
  explicit Proposal(const ProposalRequest& request)
      : request_(request), read_(first_reading()), world_(*read_.world), model_(read_.model) {
    look();
    if (!four_legs()) {
      bend_limbs();
    } else {
      bend_all(feet_);
    }
  }

  HoldGains hold_gains() const { return {gain(), servo_damping()}; }

  std::string text() {
    std::vector<std::string> policies = {hold()};
    std::string why_not = why_no_feet();
    if (const auto trot = this->trot()) {
      policies.push_back(*trot);
      if (const std::string problem = problem_of(whole(policies, "")); !problem.empty()) {
        policies.pop_back();
        why_not = "a trot of its four legs was refused: " + problem;
      }
    }
    if (!why_not.empty() && request_.warn) request_.warn(request_.file + ": no trot: " + why_not);
    const std::string out = whole(policies, why_not.empty() ? "" : fmt::format("  # No trot: {}\n", why_not));
    read_own(out);
    return out;
  }

 private:
  Scenario read(const std::string& text) const {
    return parse_scenario(text, request_.file, {{}, request_.ignore_missing_meshes});
  }
  /// What is refused in it is no mistake of the user's, whose robot has been read.
  Scenario read_own(const std::string& text) const {
    try {
      return read(text);
    } catch (const InputError& e) {
      throw InputError(refused_proposal(request_, e.what()));
    }
  }
  std::string problem_of(const std::string& text) const {
    try {
      read(text);
    } catch (const InputError& e) {
      return without_place(request_.file, e.what());
    }
    return "";
  }

  std::string head() const {
    return fmt::format("graze: 1\nrobot:\n  urdf: {}\n{}{}", quoted(request_.urdf),
                       request_.repair ? "  repair: true\n" : "", bolted_ > 0 ? "  base: fixed\n" : "");
  }
  /// On the ground, or, fixed to the world by its URDF or by what it looks like, where the proposal has it.
  Scenario first_reading() {
    Scenario out = read_own(head() + body("  initial: {height: on_ground, clearance: 2 cm}\n"));
    bolted_ = joints_of_bolted_arm(out.world->robot, out.model, initial_state(*out.world, out.model));
    if (!out.model.floating_base || bolted_ > 0) out = read_own(head() + body(""));
    return out;
  }
  /// Enough to be read. No link is called as its ground.
  static std::string body(const std::string& initial) {
    return initial + "environment: {ground of this proposal: {plane: z}}\n" +
           "policies: {hold: {hold: {}, control: {joint_pd: {kp: 1}}}}\n";
  }

  /// At the robot as it begins.
  void look() {
    initial_ = initial_state(world_, model_);
    extent_ = robot_extent(model_, initial_);
    find_feet();
  }

  /// Bends the last two joints of a leg so that its foot is below its hip, at 0.85 of what the leg reaches down to.
  void bend(const Foot& foot) {
    const Chain chain(model_, foot.frame);
    if (chain.size() != 3) return;
    std::array<std::string, 2> names;
    std::array<double, 2> low, high;
    const int bodies[] = {model_.bodies[foot.body].parent, foot.body};
    for (int k = 0; k < 2; ++k) {
      const Body& one = model_.bodies[bodies[k]];
      if (one.type != JointType::revolute) return;
      names[k] = one.joint;
      low[k] = std::max(one.lower, -0.5 * std::numbers::pi);
      high[k] = std::min(one.upper, 0.5 * std::numbers::pi);
      if (!(low[k] < high[k])) low[k] = one.lower, high[k] = one.upper;  // a knee that cannot be straight
    }
    const std::array<double, 2> bent = bent_leg(chain, chain.select(initial_.q), low, high);
    for (int k = 0; k < 2; ++k) world_.initial.joint_position[names[k]] = std::round(100 * bent[k]) / 100;
  }

  void bend_all(const std::vector<Foot> legs) {  // a copy: looking finds them anew
    for (const Foot& leg : legs) bend(leg);
    look();
  }

  /// Legs that are stretched out as the URDF has them: four limbs of three joints each, on which the robot stands once
  /// they are bent.
  void bend_limbs() {
    const auto is_leg = [](const Foot& limb) { return limb.joints == 3; };
    if (!model_.floating_base || limbs_.size() != 4 || !std::all_of(limbs_.begin(), limbs_.end(), is_leg)) return;
    const auto before = world_.initial;
    bend_all(limbs_);
    if (four_legs()) return;
    world_.initial = before;
    look();
  }

  void find_feet() {
    feet_.clear();
    limbs_.clear();
    const std::vector<Pose> X_WB = place_bodies(model_, initial_.q);
    const double lowest = lowest_point(model_, X_WB);
    for (const int body : model_.actuated) {
      const auto hangs_on_it = [&](const Body& other) { return other.parent == body; };
      if (std::any_of(model_.bodies.begin(), model_.bodies.end(), hangs_on_it)) continue;
      int tip = -1;
      for (int f = 0; f < static_cast<int>(model_.frames.size()); ++f) {
        if (model_.frames[f].body != body) continue;
        const auto far = [&](int g) { return model_.frames[g].X_BF.translation().norm(); };
        if (tip < 0 || far(f) > far(tip)) tip = f;
      }
      if (tip < 0) continue;
      const Vec3 place = frame_pose(model_, X_WB, tip).translation();
      limbs_.push_back({model_.frames[tip].name, place, joints_of(tip), body, tip});
      if (!model_.floating_base || place.z() > lowest + 0.25 * extent_.z()) continue;
      feet_.push_back(limbs_.back());
    }
  }

  /// Joints of a limb, 0 of one that no gait can move.
  int joints_of(int frame) const {
    try {
      return Chain(model_, frame).size();
    } catch (const std::invalid_argument&) {
      return 0;
    }
  }

  bool four_legs() const {
    return feet_.size() == 4 &&
           std::all_of(feet_.begin(), feet_.end(), [](const Foot& foot) { return foot.joints >= 3; });
  }

  /// Why a robot of four limbs or more has no four legs to trot on; empty if it has, or has fewer limbs.
  std::string why_no_feet() const {
    if (!model_.floating_base || limbs_.size() < 4 || four_legs()) return "";
    if (feet_.size() > 4) return fmt::format("it stands on {} limbs, and a trot is for four", feet_.size());
    if (feet_.size() == 4) {
      const auto fewer = [](const Foot& a, const Foot& b) { return a.joints < b.joints; };
      const Foot& least = *std::min_element(feet_.begin(), feet_.end(), fewer);
      return fmt::format("between the base and {} are {} joints that a gait can move, and a trot needs 3 in each leg",
                         quoted(least.link), least.joints);
    }
    std::vector<std::string> high;
    for (const Foot& limb : limbs_) {
      const auto same = [&](const Foot& foot) { return foot.frame == limb.frame; };
      if (std::none_of(feet_.begin(), feet_.end(), same) && high.size() < 4) high.push_back(quoted(limb.link));
    }
    return fmt::format(
        "{} of its {} limbs end in the lowest quarter of the robot as it begins, and a trot is for four (too high: "
        "{}); if they are legs, let the robot begin on them: robot.initial.joints, rpy",
        feet_.size(), limbs_.size(), fmt::join(high, ", "));
  }

  bool slides(int body) const { return model_.bodies[body].type == JointType::prismatic; }
  std::vector<int> sliding() const {
    std::vector<int> out;
    std::copy_if(model_.actuated.begin(), model_.actuated.end(), std::back_inserter(out),
                 [&](int body) { return slides(body); });
    return out;
  }
  bool all_slide() const { return model_.na() > 0 && static_cast<int>(sliding().size()) == model_.na(); }

  /// Whether a joint moves `body`, itself or by what hangs on it.
  bool moves(int joint, int body) const {
    while (body >= 0 && body != joint) body = model_.bodies[body].parent;
    return body == joint;
  }

  /// kg: what moves with a joint, and with those that follow it.
  double moved_mass(int joint) const {
    double out = 0;
    for (int i = 0; i < static_cast<int>(model_.bodies.size()); ++i) {
      const Body& one = model_.bodies[i];
      if (moves(joint, i)) out += one.mass;
      if (one.mimics == joint && !moves(joint, i)) out += std::abs(one.multiplier) * moved_mass(i);
    }
    return out;
  }

  /// N/m, of a joint that slides: carries what it moves with an error of 1 cm, and the robot if it is in a leg.
  double sliding_gain(int joint) const {
    constexpr double kSink = 0.01;  // m
    const auto on_it = [&](const Foot& foot) { return moves(joint, foot.body); };
    const bool leg = std::any_of(feet_.begin(), feet_.end(), on_it);
    const double mass = leg ? robot_mass(model_) : moved_mass(joint);
    return std::max(0.1, rounded(9.81 * mass / kSink));
  }

  /// N s/m: 0.7 of the critical one of what it carries, and no more than what it moves bears in steps of 1 ms.
  double sliding_damping(int joint) const {
    const double stiffness = sliding_gain(joint), carried = stiffness * 0.01 / 9.81;
    return rounded(std::min(1.4 * std::sqrt(stiffness * carried), 0.5 * moved_mass(joint) / 1e-3));
  }

  /// N m/rad: carries the robot's weight at half its size with an error of 0.05 rad, shared by its feet.
  double gain() const {
    const double arm = 0.5 * (model_.floating_base ? extent_.z() : extent_.maxCoeff());
    const double weight = 9.81 * (model_.floating_base ? robot_mass(model_) : 0.5 * robot_mass(model_));
    return std::max(0.1, rounded(weight * arm / 0.05 / static_cast<double>(std::max<std::size_t>(1, feet_.size()))));
  }

  /// N m s/rad: the servos' damper, which brings a joint to its target in some twentieths of a second.
  double servo_damping() const { return rounded(0.05 * gain()); }

  /// N m s/rad, of the joints themselves: a twentieth of the servos'. More of it, and a foot lags behind its spring
  /// when it swings: as strong as the servos', it takes a tenth of a second, of the fifth that a small robot's swing
  /// has.
  double joint_damping() const { return rounded(0.05 * servo_damping()); }

  /// "{'*': 18, 'lift': 1200}": of the joints that turn, and of each that slides.
  template <typename Of>
  std::string by_joint(double turning, const Of& of) const {
    std::vector<std::string> parts;
    if (!all_slide()) parts.push_back(fmt::format("'*': {:g}", turning));
    for (const int joint : sliding()) {
      parts.push_back(fmt::format("{}: {:g}", quoted(model_.bodies[joint].joint), of(joint)));
    }
    return fmt::format("{{{}}}", fmt::join(parts, ", "));
  }

  std::string hold() const {
    if (model_.na() == 0) {
      return "  hold:  # there is no driven joint\n    hold: {}\n    control: {joint_pd: {kp: 0}}\n";
    }
    const std::string what = "  hold:  # keeps the joints where they begin\n    hold: {}\n    control:";
    if (sliding().empty()) {
      return what +
             fmt::format(" {{joint_pd: {{kp: {:g}, kd: {:g}}}}}  # N m/rad, N m s/rad\n", gain(), servo_damping());
    }
    const bool all = all_slide();
    return what + fmt::format("\n      joint_pd:\n        kp: {}  # {}\n        kd: {}  # {}\n",
                              by_joint(gain(), [&](int joint) { return sliding_gain(joint); }),
                              all ? "N/m" : "N m/rad; N/m of those that slide",
                              by_joint(servo_damping(), [&](int joint) { return sliding_damping(joint); }),
                              all ? "N s/m" : "N m s/rad; N s/m of those that slide");
  }

  /// kg
  double lightest_foot() const {
    double out = robot_mass(model_);
    for (const Foot& foot : feet_) out = std::min(out, model_.bodies[foot.body].mass);
    return out;
  }

  /// In the frame of the base, as the robot begins, m.
  Vec3 centre_of_mass() const {
    const std::vector<Pose> X_WB = place_bodies(model_, initial_.q);
    Vec3 moment = Vec3::Zero();
    for (std::size_t i = 0; i < model_.bodies.size(); ++i)
      moment += model_.bodies[i].mass * (X_WB[i] * model_.bodies[i].com);
    return X_WB[0].inverse() * (moment / robot_mass(model_));
  }

  /// Where the feet stand, if not below their hips: below the centre of mass, which a few files have aside, and at
  /// least half as far apart as the robot is high. A diagonal pair bears on a line, and what stands narrowly or beside
  /// that line has little time to step.
  std::string stance() const {
    constexpr double kWidth = 0.5, kAside = 2e-3;  // of the height; m, of the least that counts
    Vec3 middle = Vec3::Zero();
    double width = 0;
    for (const Foot& foot : feet_) {
      const Chain chain(model_, foot.frame);
      const Vec3 hip = chain.skeleton(chain.select(initial_.q)).origin[1];
      middle += hip / static_cast<double>(feet_.size());
      width += 2 * std::abs(hip.y()) / static_cast<double>(feet_.size());
    }
    const Vec3 offset = middle - centre_of_mass();
    std::vector<std::string> parts;
    if (width < kWidth * extent_.z()) parts.push_back(fmt::format("width: {:.2g} cm", 100 * kWidth * extent_.z()));
    if (offset.head<2>().norm() > kAside) {
      parts.push_back(fmt::format("offset: [{:.1f} cm, {:.1f} cm]", 100 * offset.x(), 100 * offset.y()));
    }
    return parts.empty() ? "" : fmt::format("      stance: {{{}}}\n", fmt::join(parts, ", "));
  }

  std::optional<std::string> trot() const {
    if (!four_legs()) return std::nullopt;
    std::vector<Foot> feet = feet_;
    const Vec3 base = place_bodies(model_, initial_.q)[0].translation();
    std::stable_sort(feet.begin(), feet.end(), [&](const Foot& a, const Foot& b) {
      const bool a_front = a.place.x() > base.x(), b_front = b.place.x() > base.x();
      return a_front != b_front ? a_front : a.place.y() > b.place.y();
    });
    std::vector<std::string> names;
    for (const Foot& foot : feet) names.push_back(quoted(foot.link));
    const double height = extent_.z();
    // As stiff as carries the robot on two of its feet with legs that give by 7.5 % of its height, more than half of a
    // step, and as damped as a light foot bears in steps of 1 ms.
    constexpr double kSag = 0.075;
    const double stiffness = 9.81 * robot_mass(model_) / (2 * kSag * height);
    const double damping = std::min(0.02 * stiffness, 0.15 * lightest_foot() / 1e-3);
    return fmt::format(
        "  trot:  # a gait of diagonal pairs; speed, stance and gains are guesses from its size and weight\n    gait:\n"
        "      feet: [{}]  # front before hind, left before right\n      velocity: [{:.2g}, 0, 0]\n"
        "      duration: {:.2g} s\n      touchdown: \"[25, 75, 75, 25] %\"\n      duty: 60 %\n      step_height: "
        "{:.2g} cm\n"
        "      settle: 0.5 s\n{}    control: {{operational_pd: {{kp: {:.2g}, kd: {:.2g}}}}}  # N/m, N s/m\n",
        fmt::join(names, ", "), rounded(0.15 * std::sqrt(9.81 * height)), rounded(std::sqrt(height / 9.81) * 2.2),
        rounded(100 * 0.12 * height), stance(), rounded(stiffness), rounded(damping));
  }

  std::string joints() const {
    std::string out;
    for (const int body : model_.actuated) {
      const Body& one = model_.bodies[body];
      out += fmt::format("      {}: {:.4g}  # {:.4g} … {:.4g} {}\n", quoted(one.joint), initial_.q[one.q], one.lower,
                         one.upper, one.type == JointType::prismatic ? "m" : "rad");
    }
    for (const Body& one : model_.bodies) {
      if (one.mimics < 0) continue;
      const std::string other = quoted(model_.bodies[one.mimics].joint);
      out += fmt::format("      # {} follows {} (<mimic>): {:g} times its position + {:g}\n", quoted(one.joint), other,
                         one.multiplier, one.offset);
    }
    return out.empty() ? "" : "    joints:  # where they begin, and how far they go\n" + out;
  }

  std::string task() const {
    if (model_.nv == 0) return "";
    const std::string base = quoted(model_.bodies.empty() ? "" : model_.bodies[0].name);
    if (feet_.size() < 2) {
      return "task:\n  objective:\n    rests: {speed: {link: \"*\", below: 2 cm/s}}\n";
    }
    const double z = place_bodies(model_, initial_.q)[0].translation().z();
    return fmt::format(
        "task:\n  requirements:\n    upright: {{tilt: {{link: {}, below: 60 deg}}}}\n  objective:\n"
        "    stands: {{position: {{link: {}, z: {{above: {:.2g} m}}}}}}  # half of the height at which it begins\n",
        base, base, 0.5 * z);
  }

  /// What brakes the joints. What the URDF says of one stands; where it says nothing the joint shall have some.
  std::string dampers() const {
    std::vector<int> turning, sliding, damped;
    for (int i = 0; i < static_cast<int>(model_.bodies.size()); ++i) {  // also of those that follow others
      const Body& body = model_.bodies[i];
      if (body.type != JointType::revolute && body.type != JointType::prismatic) continue;
      (body.damping > 0 ? damped : slides(i) ? sliding : turning).push_back(i);
    }
    const auto path = [&](int i) { return quoted(fmt::format("robot.joint.{}.damping", model_.bodies[i].joint)); };
    std::string out;
    if (!damped.empty()) {
      out += damped.size() > 1 ? "  # Dampers of the URDF stay.\n" : "  # The damper of the URDF stays.\n";
      for (const int i : turning) out += fmt::format("  {}: {:g}  # N m s/rad\n", path(i), joint_damping());
    } else if (!all_slide()) {
      out += fmt::format("  robot.joint.*.damping: {:g}  # N m s/rad, the same for all: what brakes the joints\n",
                         joint_damping());
    }
    for (const int i : sliding)
      out += fmt::format("  {}: {:g}  # N s/m\n", path(i), rounded(0.05 * sliding_damping(i)));
    return out;
  }

  std::string uncertain_joints() const {
    if (model_.na() == 0) return "";
    std::string out;
    const auto zero = [&](const std::string& path, bool slide) {
      out += fmt::format("  {}: {{normal: {{std: {}}}}}\n", path, slide ? "1 mm" : "0.01 rad");
    };
    const auto path = [&](int joint, const char* what) {
      return quoted(fmt::format("robot.joint.{}.{}", model_.bodies[joint].joint, what));
    };
    out += dampers();
    if (sliding().empty() || all_slide()) {
      zero("robot.joint.*.zero", all_slide());
      return out;
    }
    for (const int joint : model_.actuated) zero(path(joint, "zero"), slides(joint));
    return out;
  }

  /// Whether anything of the robot can touch anything.
  bool touches() const {
    const auto own = [&](const ColliderPair& pair) {
      return !model_.colliders[pair.a].is_object && !model_.colliders[pair.b].is_object;
    };
    return stands_clear(model_, initial_) || std::any_of(model_.pairs.begin(), model_.pairs.end(), own);
  }

  std::string uncertain() const {
    std::string out =
        "uncertain:  # what differs between particles; 'graze help uncertain', 'graze check' list what can\n";
    out += uncertain_joints();
    if (model_.nv == 0)
      return "# Nothing of the robot moves: there is nothing uncertain that would show, and no task.\n";
    out += "  robot.link.*.mass: {normal: {std: 5 %}}\n";
    if (touches()) out += "  contact.friction: {uniform: [0.5, 1.2]}\n";
    if (model_.floating_base) out += "  \"initial.base.{roll,pitch}\": {normal: {std: 2 deg}}\n";
    return out;
  }

  std::string whole(const std::vector<std::string>& policies, const std::string& note) const {
    const std::string name = in_comment(read_.world->robot.name.empty() ? "robot" : read_.world->robot.name);
    std::string out =
        fmt::format("# {}: {}, {}, {}, {:.3g} m high as it begins.\n", name, mass_text(read_.world->robot, model_),
                    counted(read_.world->robot.links.size(), "link"),
                    counted(static_cast<std::size_t>(model_.na()), "driven joint"), extent_.z());
    out += fmt::format("#\n#   graze run {0}{1}        then: graze report …, graze view …\n#   graze check {0}{1}\n",
                       std::filesystem::path(request_.file).filename().string(),
                       request_.ignore_missing_meshes ? " --ignore-missing-meshes" : "");
    out += fmt::format("graze: 1\nname: {}\n\nrobot:\n  urdf: {}\n{}", quoted(name), quoted(request_.urdf),
                       request_.repair ? "  repair: true  # what is mended: graze check\n" : "");
    if (bolted_ > 0) {
      out += fmt::format("  base: fixed  # a guess: {} joints in a row on {} are an arm; floating: it is free\n",
                         bolted_, in_comment(read_.world->robot.links.front().name));
    }
    out += model_.floating_base ? "  initial:\n    height: on_ground\n    clearance: 2 cm  # it is dropped from there\n"
           : joints().empty()   ? ""
                                : "  initial:\n    position: [0, 0, 0]\n";
    out += joints();
    out +=
        "\n" + proposed_ground(model_, initial_) + "\ncontact:\n  friction: 1.0\n" + ignored_overlaps(model_, initial_);
    out += "\ntime: {end: 4 s, step: 1 ms, control: 1 ms}\n\n" + uncertain();
    out += "\nsampling: {particles: 16}\n\npolicies:\n";
    for (const std::string& policy : policies) out += policy;
    return out + note + "\n" + task() + "\nrecord: {telemetry: failures, every: 10}\n";
  }

  const ProposalRequest request_;
  int bolted_ = 0;  // joints of the arm that it is taken for, which its URDF leaves floating; set by first_reading()
  const Scenario read_;
  World world_;  // as it is to begin
  const Model& model_;
  State initial_;
  Vec3 extent_ = Vec3::Zero();
  std::vector<Foot> limbs_, feet_;
};

}  // namespace

std::string propose_scenario(const ProposalRequest& request) { return Proposal(request).text(); }

std::string refused_proposal(const ProposalRequest& request, const std::string& refusal) {
  if (!refusal.starts_with(request.file + ":")) return refusal;
  return fmt::format(
      "{}: a scenario of {} was made and is refused by its own reading, so nothing is written: {}; this is a defect of "
      "graze new; please report it, with the robot",
      request.file, request.urdf, without_place(request.file, refusal));
}

HoldGains propose_hold(const ProposalRequest& request) { return Proposal(request).hold_gains(); }

}  // namespace graze
