// joint_pd without servos: `implicit: false` asks for the torque of its law at what is sensed; and the tracker
// `torque`.

#include "engine/settings/warnings.h"
#include "tests/engine/control/support.h"
#include "tests/message_of.h"

namespace graze {
namespace {

class ExplicitJointPd : public ::testing::Test {
 protected:
  ExplicitJointPd() : command(scene.model.na()) {
    observation.joint_position = observation.joint_velocity = BlockArray(scene.model.na());
    for (int k = 0; k < scene.model.na(); ++k) {
      observation.joint_position(k, 0) = scene.initial.q[scene.model.bodies[scene.model.actuated[k]].q];
    }
  }
  Controller make(const std::string& gains) {
    return Controller(scene.context(), Settings::parse("{hold: {}, control: {joint_pd: " + gains + "}}", "test.yaml"));
  }

  Scene scene{links_world()};
  Observation observation;
  ActuatorCommand command;
};

// The law, with no servo behind it; a joint that no gain looks at may be NaN.
TEST_F(ExplicitJointPd, IsATorque) {
  Controller controller = make("{kp: {'*_Y_*': 20}, kd: {'LF_*': 0.1}, implicit: false}");
  controller.start(0, 0, 0);
  observation.joint_position(1, 0) += 0.25;
  observation.joint_velocity(0, 0) = 3, observation.joint_velocity(1, 0) = -2;
  observation.joint_position(0, 0) = std::nan("");
  controller.act(observation, nullptr, LaneMask::first(1), command);
  EXPECT_DOUBLE_EQ(command.tau(0, 0), -0.3);
  EXPECT_DOUBLE_EQ(command.tau(1, 0), -20 * 0.25 + 0.2);
  for (int k = 0; k < scene.model.na(); ++k) {
    EXPECT_EQ(command.kp(k, 0), 0);
    EXPECT_EQ(command.kd(k, 0), 0);
    EXPECT_EQ(command.tau(k, 1), 0) << "the lane was not active";
  }
}

// `from_start` shifts a sinusoid so that it begins where the robot stands, and with a phase of 90 degrees at rest.
TEST_F(ExplicitJointPd, FollowsASinusoidFromItsStart) {
  Controller controller(
      scene.context(),
      Settings::parse("{joint_trajectory: {sinusoid: {amplitude: {'LF_*': 0.1, '*_Y_3': -0.2}, frequency: "
                      "3, phase: 90 deg, from_start: true}}, control: {joint_pd: {kp: 10, implicit: "
                      "false}}}",
                      "test.yaml"));
  controller.start(0, 0, 0);
  controller.act(observation, nullptr, LaneMask::first(1), command);
  for (int k = 0; k < scene.model.na(); ++k) EXPECT_EQ(command.tau(k, 0), 0) << "the robot stands at its target";
  observation.time[0] = 0.4;
  controller.act(observation, nullptr, LaneMask::first(1), command);
  EXPECT_NEAR(command.tau(0, 0), 10 * 0.1 * (std::cos(1.2) - 1), 1e-12);
  EXPECT_NEAR(command.tau(5, 0), 10 * -0.2 * (std::cos(1.2) - 1), 1e-12);
}

TEST_F(ExplicitJointPd, ReadsWhatItsGainsLookAt) {
  EXPECT_EQ(make("{kp: 1, kd: 1, implicit: false}").reads(), kJointPosition | kJointVelocity);
  EXPECT_EQ(make("{kp: 1, implicit: false}").reads(), kJointPosition);
  EXPECT_EQ(make("{kp: 1}").reads(), kServoPosition);
}

TEST_F(ExplicitJointPd, HasNoIntegral) {
  EXPECT_NE(testing::message_of([&] { make("{kp: 1, ki: 1, implicit: false}"); }).find("there is no integral"),
            std::string::npos);
}

// Places that nobody goes to are told; `hold` under `torque` is how one says that a robot shall be limp.
TEST(TorqueTracker, DoesNotFollowPlaces) {
  const Scene scene(links_world());
  const auto warned = [&](const std::string& policy) {
    const Warnings warnings;
    Controller(scene.context(), Settings::parse("{" + policy + ", control: {torque: {}}}", "test.yaml"));
    return warnings.texts();
  };
  EXPECT_EQ(warned("hold: {}").size(), 0u);
  const std::vector<std::string> texts = warned("joint_trajectory: {sinusoid: {amplitude: 0.1, frequency: 1}}");
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_NE(texts[0].find("'joint_trajectory' wants positions, which the tracker 'torque' passes over"),
            std::string::npos);
}

}  // namespace
}  // namespace graze
