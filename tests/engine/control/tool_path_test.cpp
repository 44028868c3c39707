// Policy tool_path: the point goes where its path says, at its speed, and other joints turn at their rate; what cannot
// be followed is refused at its place.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <numbers>

#include "engine/settings/warnings.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

using ::testing::HasSubstr;

/// The arm of the picking task at its start, its base 10 cm above the origin and turned by `yaw`.
World pick_world(double yaw = 0) {
  World world;
  world.robot = load_urdf(shipped_robot("pick_arm.urdf"));
  world.robot.floating_base = false;
  world.initial.position = Vec3(0, 0, 0.1);
  world.initial.rpy = Vec3(0, 0, yaw);
  const double right = std::numbers::pi / 2;
  for (const char* joint : {"X_1", "Z_3", "X_4", "X_7"}) world.initial.joint_position[joint] = right;
  for (const char* joint : {"Y_5", "Z_6"}) world.initial.joint_position[joint] = -right;
  return world;
}

/// With a tool path under joint_pd, and what it commands at times.
struct Hand {
  explicit Hand(World world = pick_world()) : scene(std::move(world)), command(scene.model.na()) {}

  Controller make(const std::string& keys, const std::string& tracker = "joint_pd: {kp: 1}") {
    const std::string yaml = "{tool_path: {" + keys + "}, control: {" + tracker + "}}";
    ControlContext context = scene.context();
    context.end = 2;
    return Controller(context, Settings::parse(yaml, "test.yaml"));
  }
  std::string error(const std::string& keys, const std::string& tracker = "joint_pd: {kp: 1}") {
    return input_error([&] { make(keys, tracker); });
  }
  void act(Controller& controller, double t) {
    observation.time[0] = t;
    controller.act(observation, nullptr, LaneMask::first(1), command);
  }
  /// Where the commanded joints put a point of the hand, in the world, by a way of its own.
  Vec3 point(const Vec3& p_hand) const {
    const Model& model = scene.model;
    Eigen::VectorXd q = scene.initial.q;
    for (int k = 0; k < model.na(); ++k) q[model.bodies[model.actuated[k]].q] = command.q(k, 0);
    const Frame& hand = model.frames[model.frame("HAND")];
    return reference_poses(model, q)[hand.body] * (hand.X_BF * p_hand);
  }
  int joint(const std::string& name) const {
    for (int k = 0; k < scene.model.na(); ++k) {
      if (scene.model.bodies[scene.model.actuated[k]].joint == name) return k;
    }
    ADD_FAILURE() << name;
    return 0;
  }

  Scene scene;
  Observation observation;
  ActuatorCommand command;
};

constexpr const char* kTool = "link: HAND, point: [4 cm, 0, 0], speed: 0.4 m/s, ";

// The point goes along the lines at its speed and rests behind the last; places are those of the world, however the
// base stands; the first target is where the arm is.
TEST(ToolPath, FollowsItsLines) {
  for (const double yaw : {0.0, 0.7}) {
    Hand hand(pick_world(yaw));
    const Vec3 point(0.04, 0, 0), ball = Eigen::AngleAxisd(yaw, Vec3::UnitZ()) * Vec3(0.3, 0.14, -0.02);
    Controller controller = hand.make(kTool + fmt::format("path: [{{to: [{}, {}, -2 cm]}}, {{wait: 0.1 s}}, "
                                                          "{{by: [0, 0, 10 cm]}}]",
                                                          ball.x(), ball.y()));
    controller.start(0, 0, 0);
    hand.act(controller, 0);
    const Vec3 begin = hand.point(point);
    EXPECT_LT((begin - Eigen::AngleAxisd(yaw, Vec3::UnitZ()) * Vec3(0.35, 0.14, 0.3)).norm(), 1e-9);
    const double way = (ball - begin).norm(), arrival = way / 0.4;
    for (const double t : {0.2, 0.5, 0.8}) {
      hand.act(controller, t);
      EXPECT_LT((hand.point(point) - (begin + t / arrival * (ball - begin))).norm(), 1e-8) << t;
    }
    for (const double t : {0.86, 0.9, 1.0, 1.1, 1.9}) {
      const Vec3 lift(0, 0, std::clamp(0.4 * (t - arrival - 0.1), 0.0, 0.1));
      hand.act(controller, t);
      EXPECT_LT((hand.point(point) - (ball + lift)).norm(), 1e-8) << t;
    }
    for (int k = 0; k < 11; ++k) EXPECT_EQ(hand.command.v(k, 0), 0) << "at rest";
  }
}

// Other joints turn from the beginning of their part on, at the rate, to where they are sent; target velocities are the
// differences of target positions.
TEST(ToolPath, TurnsOtherJoints) {
  Hand hand;
  Controller controller = hand.make(
      std::string(kTool) + "rate: {'F_*': 2 rad/s}, path: [{by: [0, 0, -4 cm]}, {wait: 0.5 s, joints: {'F_0?': 0.6}}]");
  controller.start(0, 0, 0);
  const int own = hand.joint("F_01"), other = hand.joint("F_10"), arm = hand.joint("Y_2");
  for (const auto& [t, q] : {std::pair{0.05, 0.0}, {0.1, 0.0}, {0.2, 0.2}, {0.45, 0.6}, {1.5, 0.6}}) {
    hand.act(controller, t);
    EXPECT_NEAR(hand.command.q(own, 0), q, 2.1e-3) << t;  // a step of the rate
    EXPECT_EQ(hand.command.q(other, 0), 0);
  }
  hand.act(controller, 0.05);
  const double before = hand.command.q(arm, 0), v = hand.command.v(arm, 0);
  hand.act(controller, 0.051);
  EXPECT_NEAR(hand.command.q(arm, 0) - before, 0.001 * v, 1e-12);
  EXPECT_GT(std::abs(v), 0.01);
}

// What cannot be is refused with its place and what would be right.
TEST(ToolPath, RefusesWhatCannotBeFollowed) {
  Hand hand;
  const auto told = [&](const std::string& keys, const std::string& word) {
    EXPECT_THAT(hand.error(keys), ::testing::AllOf(HasSubstr("test.yaml:1:"), HasSubstr(word))) << keys;
  };
  const std::string tool = kTool;
  told("link: HAN, speed: 1, path: [{wait: 1}]", "nearest: HAND");
  told("link: LINK_0, speed: 1, path: [{wait: 1}]", "LINK_0 does not move");
  told(tool + "path: []", "at least one of {to");
  told(tool + "path: [{to: [0, 0, 0], by: [0, 0, 0]}]", "by");
  told(tool + "path: [{to: [1 s, 0, 0]}]", "1 s");
  told(tool + "path: [{wait: 1, joints: {Y_2: 0}}]", "joint Y_2 is one of those that move HAND");
  told(tool + "path: [{to: [1, 0, 0.1]}]", "the arm follows");
  told(tool + "path: [{to: [1, 0, 0.1]}]", "where the arm begins stretched, begin with bent joints");
  told(tool + "path: [{to: [1e300, 0, 0]}]", "within 1e+06 m");
  told(tool + "path: [{by: [0, 1e155, 0]}]", "within 1e+06 m");
  told("link: HAND, speed: 0.5, point: [1e300, 0, 0], path: [{wait: 1}]", "within 1e+06 m");
  told("link: HAND, speed: 0, path: [{wait: 1}]", "speed");
  told(tool + "rate: {F_00: 1}, path: [{wait: 1, joints: {F_01: 1}}]", "must be > 0 for joint F_01");
  told(tool + "rate: 1 m/s, path: [{wait: 1}]", "1 m/s");
  EXPECT_THAT(hand.error(tool + "path: [{wait: 1}]", "operational_pd: {kp: 1}"), HasSubstr("joint_pd"));
  Hand links(links_world());
  EXPECT_THAT(links.error("link: LF_FOOT, speed: 1, path: [{wait: 1}]"), HasSubstr("whose base is fixed"));
}

// A path that no trace sees the end of is told.
TEST(ToolPath, WarnsOfWhatNeverHappens) {
  Hand hand;
  const Warnings warnings;
  hand.make(std::string(kTool) + "path: [{wait: 3}]");
  ASSERT_EQ(warnings.texts().size(), 1u);
  EXPECT_THAT(warnings.texts()[0], HasSubstr("takes 3 s, and no trace is longer than 2 s"));
}

}  // namespace
}  // namespace graze
