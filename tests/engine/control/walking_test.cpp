// LINKS walks: policy, lag, tracker, actuators, sensors and physics together.

#include <fmt/format.h>

#include "tests/engine/control/closed_loop.h"

namespace graze {
namespace {

// Table 1's walk and its trotting sibling (Table 2's timing in Table 1's stance); the published robot walks by the
// published law with the published 3 cm (walk-mc, circle-mc).
std::string walk_gait(const std::string& velocity, const std::string& step_height = "4 cm") {
  return "gait: {velocity: " + velocity +
         ", duration: 0.3 s, duty: 75 %, liftoff: '[25, 75, 0, 50] %', step_height: " + step_height +
         ", stance: {length: 120 %, width: 200 %, height: 90 %}}";
}
std::string trot_gait(const std::string& velocity) {
  return "gait: {velocity: " + velocity +
         ", duration: 0.3 s, duty: 60 %, liftoff: '[25, 75, 75, 25] %', step_height: 3 cm, "
         "stance: {length: 120 %, width: 200 %, height: 90 %}}";
}
const char* const kOperational = "control: {operational_pd: {kp: 1000, kd: 20}}";                // published gains
const char* const kExplicit = "control: {operational_pd: {kp: 1000, kd: 20, implicit: false}}";  // published law
const char* const kJoint = "control: {joint_pd: {kp: 20, kd: 0.1}}";                             // published gains
// With the published kd of 0.1 the robot bounces as it trots, and nothing steers its heading: it drifts by 0.07 rad/s.
const char* const kStiffJoint = "control: {joint_pd: {kp: 20, kd: 0.3}}";

struct Case {
  const char* name;
  const char* robot;
  std::string gait, control;
  double forward, turn;  // commanded, m/s and rad/s
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Walking : public ::testing::TestWithParam<Case> {};

// The unperturbed robot goes where it is told: forward speed and yaw rate within 30 % of the command (the feet sweep
// back faster than they stand just before touchdown, and carry by then, which the original shows as well: 12 to 25 %),
// no drift sideways or in heading beyond a tenth of a typical command, upright, at the commanded height less the
// spring's give, each foot carrying for about its duty.
TEST_P(Walking, GoesWhereItIsTold) {
  const Case& c = GetParam();
  const Scene scene(links_world(c.robot));
  ClosedLoop loop(scene, "{" + c.gait + ", " + c.control + "}");
  loop.start(0, scene.particle());
  const Walk out = walk(loop, scene, 1.5, 4 * 0.3 * 3);
  RecordProperty("walk", fmt::format("forward {:.4f} m/s, turn {:.4f} rad/s, height {:.4f} m, tilt {:.4f} rad",
                                     out.forward, out.turn, out.height, out.tilt));
  ASSERT_FALSE(out.fault);
  EXPECT_NEAR(out.forward, c.forward, 0.3 * c.forward);
  EXPECT_NEAR(out.turn, c.turn, c.turn == 0 ? 0.05 : 0.3 * std::abs(c.turn));
  EXPECT_NEAR(out.strafe, 0, 0.02);
  EXPECT_LT(out.tilt, 0.2);
  // Commanded height: 0.9 of the reach 0.95 (0.077 + 0.1) m, plus the foot's radius of 8.5 to 10 mm.
  const double foot = std::string(c.robot) == "links.urdf" ? 0.0085 : 0.010;
  const double commanded = 0.9 * 0.95 * 0.177 + foot;
  EXPECT_NEAR(out.height, commanded, 0.1 * commanded);
  for (const double share : out.stance) {
    EXPECT_GT(share, 0.3);
    EXPECT_LT(share, 0.95);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Links, Walking,
    ::testing::Values(
        Case{"walk", "links.urdf", walk_gait("[0.2, 0, 0]"), kOperational, 0.2, 0},
        Case{"walk_turning", "links.urdf", walk_gait("[0.2, 0, -0.5]"), kOperational, 0.2, -0.5},
        Case{"circle", "links.urdf", walk_gait("[0.1, 0, -0.5]"), kOperational, 0.1, -0.5},
        Case{"trot", "links.urdf", trot_gait("[0.2, 0, 0]"), kOperational, 0.2, 0},
        Case{"trot_turning", "links.urdf", trot_gait("[0.2, 0, 0.5]"), kOperational, 0.2, 0.5},
        Case{"walk_by_joints", "links.urdf", walk_gait("[0.2, 0, 0]"), kJoint, 0.2, 0},
        Case{"walk_published", "links_published.urdf", walk_gait("[0.2, 0, 0]", "3 cm"), kExplicit, 0.2, 0},
        Case{"circle_published", "links_published.urdf", walk_gait("[0.1, 0, -0.5]", "3 cm"), kExplicit, 0.1, -0.5},
        Case{"trot_by_joints", "links_published.urdf", trot_gait("[0.2, 0, 0]"), kStiffJoint, 0.2, 0},
        Case{"trot_turning_by_joints", "links_published.urdf", trot_gait("[0.2, 0, 0.5]"), kStiffJoint, 0.2, 0.5}),
    [](const auto& info) { return std::string(info.param.name); });

// What a lane does is the same bits alone or beside other lanes that start at other times, for the whole loop.
TEST(WalkingLanes, NeighboursDoNotMatter) {
  const Scene scene(links_world());
  const std::string policy = "{" + walk_gait("[0.2, 0, -0.5]") + ", " + kOperational + "}";
  Particle particle = scene.particle(7);
  particle.control_lag = 0.004;
  ClosedLoop alone(scene, policy), crowd(scene, policy);
  alone.start(0, particle);
  for (int k = 0; k < 300; ++k) alone.advance();
  Particle other = scene.particle(8);
  other.control_lag = 0.15;
  crowd.start(2, other);
  for (int k = 0; k < 100; ++k) crowd.advance();
  crowd.start(5, particle);
  crowd.start(2, scene.particle(9));
  for (int k = 0; k < 300; ++k) crowd.advance();
  EXPECT_EQ(alone.physics().state().q.column(0), crowd.physics().state().q.column(5));
  EXPECT_EQ(alone.physics().state().v.column(0), crowd.physics().state().v.column(5));
  EXPECT_EQ(alone.tau().column(0), crowd.tau().column(5));
}

// A control lag is felt: with 30 ms between planner and servo the same robot walks another way.
TEST(WalkingLanes, LagMatters) {
  const Scene scene(links_world());
  ClosedLoop loop(scene, "{" + walk_gait("[0.2, 0, 0]") + ", " + kOperational + "}");
  Particle late = scene.particle();
  late.control_lag = 0.03;
  loop.start(0, scene.particle());
  loop.start(1, late);
  for (int k = 0; k < 500; ++k) loop.advance();
  EXPECT_GT((loop.physics().state().position(0, 0) - loop.physics().state().position(0, 1)).norm(), 1e-4);
}

}  // namespace
}  // namespace graze
