#include "scenarios/proposal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "engine/dynamics/chain.h"
#include "engine/model/measures.h"
#include "engine/model/placement.h"
#include "scenarios/overlaps.h"
#include "scenarios/scenario.h"

namespace graze {
namespace {

/// A text as YAML has it in quotes.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

/// Two digits, as a person would write a gain.
double rounded(double x) { return std::stod(fmt::format("{:.1e}", x)); }

/// What a limb stands on that reaches down to the lowest quarter of the robot as it begins.
struct Foot {
  std::string link;
  Vec3 place;      // world, m
  int joints = 0;  // between it and the base
  int body = 0, frame = 0;
};

class Proposal {
 public:
  explicit Proposal(const ProposalRequest& request)
      : request_(request), read_(read(head() + body({}))), world_(*read_.world), model_(read_.model) {
    look();
    if (!four_legs()) return;
    for (const Foot& foot : feet_) bend(foot);
    look();
  }

  HoldGains hold_gains() const { return {gain(), servo_damping()}; }

  std::string text() {
    std::vector<std::string> policies = {hold()};
    std::string walks = "";
    if (const auto trot = this->trot()) {
      policies.push_back(*trot);
      if (const std::string problem = problem_of(whole(policies, "")); !problem.empty()) {
        policies.pop_back();
        walks = fmt::format("  # It has four legs, but a trot of them was refused: {}\n", problem);
      }
    }
    const std::string out = whole(policies, walks);
    read(out);
    return out;
  }

 private:
  Scenario read(const std::string& text) const {
    ScenarioOptions options;
    options.ignore_missing_meshes = request_.ignore_missing_meshes;
    return parse_scenario(text, request_.file, options);
  }
  std::string problem_of(const std::string& text) const {
    try {
      read(text);
    } catch (const InputError& e) {
      std::string out = e.what();
      return out.substr(0, out.find('\n'));
    }
    return "";
  }

  std::string head() const {
    return fmt::format("graze: 1\nrobot:\n  urdf: {}\n{}", quoted(request_.urdf),
                       request_.repair ? "  repair: true\n" : "");
  }
  /// Enough to be read.
  static std::string body(const std::string& more) {
    return more + "  initial: {height: on_ground, clearance: 2 cm}\nenvironment: {ground: {plane: z}}\n" +
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
    Chain::Values q = chain.select(initial_.q), best = q;
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
    constexpr int kSteps = 60;
    const auto try_all = [&](const auto& act) {
      for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; j <= kSteps; ++j) {
          q[1] = low[0] + (high[0] - low[0]) * i / kSteps;
          q[2] = low[1] + (high[1] - low[1]) * j / kSteps;
          const Chain::Skeleton at = chain.skeleton(q);
          act(Vec3(at.tip - at.origin[1]));
        }
      }
    };
    double reach = 0, least = std::numeric_limits<double>::infinity();
    try_all([&](const Vec3& leg) { reach = std::max(reach, -leg.z()); });
    try_all([&](const Vec3& leg) {
      const double down = -leg.z() - 0.85 * reach, off = leg.x() * leg.x() + down * down;
      if (off < least) least = off, best = q;
    });
    for (int k = 0; k < 2; ++k) world_.initial.joint_position[names[k]] = std::round(100 * best[k + 1]) / 100;
  }

  void find_feet() {
    feet_.clear();
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
      if (!model_.floating_base || place.z() > lowest + 0.25 * extent_.z()) continue;
      feet_.push_back({model_.frames[tip].name, place, joints_of(tip), body, tip});
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

  std::string hold() const {
    return fmt::format(
        "  hold:  # keeps the joints where they begin\n    hold: {{}}\n    control: {{joint_pd: {{kp: {:g}, kd: "
        "{:g}}}}}  "
        "# N m/rad, N m s/rad (N/m, N s/m of sliding joints)\n",
        gain(), servo_damping());
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

  std::string overlaps() const {
    std::vector<Clearance::Overlap> found =
        clearance_of_all_parts(model_).overlaps(beginning(model_, initial_), kBeginningLane);
    std::erase_if(found, [&](const Clearance::Overlap& one) {
      return model_.colliders[one.a].is_object || model_.colliders[one.b].is_object;
    });
    if (found.empty()) return "";
    std::string out =
        "  # Links that are in each other as the robot begins; they pass through each other.\n  ignore:\n";
    for (const Clearance::Overlap& one : found) {
      out += fmt::format("    - [{}, {}]  # by {:.2g} mm\n", quoted(model_.colliders[one.a].name),
                         quoted(model_.colliders[one.b].name), 1000 * one.depth);
    }
    return out;
  }

  std::string task() const {
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

  std::string uncertain() const {
    std::string out =
        "uncertain:  # what differs between particles; 'graze help uncertain', 'graze check' list what can\n";
    if (model_.na() > 0) {
      out += fmt::format("  robot.joint.*.damping: {:g}  # N m s/rad, the same for all: what brakes the joints\n",
                         joint_damping());
      const bool slides = std::all_of(model_.actuated.begin(), model_.actuated.end(),
                                      [&](int body) { return model_.bodies[body].type == JointType::prismatic; });
      out += fmt::format("  robot.joint.*.zero: {{normal: {{std: {}}}}}\n", slides ? "1 mm" : "0.01 rad");
    }
    out += "  robot.link.*.mass: {normal: {std: 5 %}}\n  contact.friction: {uniform: [0.5, 1.2]}\n";
    if (model_.floating_base) out += "  \"initial.base.{roll,pitch}\": {normal: {std: 2 deg}}\n";
    return out;
  }

  std::string whole(const std::vector<std::string>& policies, const std::string& note) const {
    const std::string name = read_.world->robot.name.empty() ? "robot" : read_.world->robot.name;
    std::string out = fmt::format("# {}: {:.3g} kg, {} links, {} driven joints, {:.3g} m high as it begins.\n", name,
                                  robot_mass(model_), read_.world->robot.links.size(), model_.na(), extent_.z());
    out += fmt::format("#\n#   graze run {0}        then: graze report …, graze view …\n#   graze check {0}\n",
                       std::filesystem::path(request_.file).filename().string());
    out += fmt::format("graze: 1\nname: {}\n\nrobot:\n  urdf: {}\n{}", quoted(name), quoted(request_.urdf),
                       request_.repair ? "  repair: true  # what is mended: graze check\n" : "");
    out += model_.floating_base ? "  initial:\n    height: on_ground\n    clearance: 2 cm  # it is dropped from there\n"
           : joints().empty()   ? ""
                                : "  initial:\n    position: [0, 0, 0]\n";
    out += joints();
    out += "\nenvironment:\n  ground: {plane: z}\n\ncontact:\n  friction: 1.0\n" + overlaps();
    out += "\ntime: {end: 4 s, step: 1 ms, control: 1 ms}\n\n" + uncertain();
    out += "\nsampling: {particles: 16}\n\npolicies:\n";
    for (const std::string& policy : policies) out += policy;
    return out + note + "\n" + task() + "\nrecord: {telemetry: failures, every: 10}\n";
  }

  const ProposalRequest request_;
  const Scenario read_;
  World world_;  // as it is to begin
  const Model& model_;
  State initial_;
  Vec3 extent_ = Vec3::Zero();
  std::vector<Foot> feet_;
};

}  // namespace

std::string propose_scenario(const ProposalRequest& request) { return Proposal(request).text(); }

HoldGains propose_hold(const ProposalRequest& request) { return Proposal(request).hold_gains(); }

}  // namespace graze
