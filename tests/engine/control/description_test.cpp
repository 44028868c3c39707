// Claim: what policies and trackers tell of themselves is what they do: with only what is required they command the
// same bits as with every default that is told written out; and any other key is refused.
#include <gmock/gmock.h>

#include "tests/engine/control/support.h"
#include "tests/engine/settings/spelled_out.h"

namespace graze {
namespace {

constexpr const char* kGait = "duration: 0.3 s, duty: 75 %, liftoff: \"[25, 75, 0, 50] %\", step_height: 2 cm";

/// Policies and trackers with only what is required, in every way in which they may be written.
std::vector<std::string> least() {
  const std::string gait = kGait, walks = "gait: {velocity: [0.2, 0, 0.1], " + gait + "}";
  const std::string table = std::string(GRAZE_SOURCE_DIR) + "/tests/scenarios/tables/";
  return {
      "{hold: {}, control: {joint_pd: {kp: 20}}}",
      "{hold: {}, control: {prescribed: {}}}",
      "{torque: {}, control: {torque: {}}}",
      "{hold: {}, control: {inverse_dynamics: {kp: 1000}}}",
      "{joint_trajectory: {sinusoid: {amplitude: 0.1, frequency: 3}}, control: {joint_pd: {kp: 20}}}",
      "{" + walks + ", control: {operational_pd: {kp: 1000, kd: 20}}}",
      "{" + walks + ", control: {operational_inverse_dynamics: {kp: 5e3}}}",
      "{" + walks + ", control: {joint_pd: {kp: 20, kd: 0.1}}}",
      "{gait: {stance: {}, waypoints: {points: [[1, 0.5]], speed: {forward: 0.2, turn: 0.5}}, " + gait +
          "}, control: {operational_pd: {kp: 1000}}}",
      "{gait_switch: {at: 0.1, from: {velocity: [0.2, 0, 0], " + gait + "}, to: {velocity: [0.3, 0, 0], " + gait +
          "}}, control: {operational_pd: {kp: 1000}}}",
      "{tool_path: {link: LF_FOOT, speed: 0.1, path: [{by: [0, 0, 1 cm], joints: {RF_Y_3: -1}}]}, control: {joint_pd: "
      "{kp: 20}}}",
  };
}

/// Commands of the first half second of a robot that stands still.
std::vector<double> commands(const Scene& scene, const Settings& policy) {
  Controller controller(scene.context(0.001), policy);
  FakePhysics physics(scene.model);
  Sensors sensors(scene.model, channel_names(scene.world.robot), SensorNoise{});
  ActuatorCommand command(scene.model.na());
  const BlockArray tau(scene.model.na());
  Observation observation;
  physics.start(0, scene.particle());
  sensors.start(0, scene.particle());
  controller.start(0, 0, 0);
  std::vector<double> out;
  for (std::uint32_t i = 0; i < 500; ++i) {
    std::array<std::uint32_t, kLanes> step{i};
    std::array<double, kLanes> time{i * 0.001};
    sensors.sense(physics, tau, 0.001, step, time, LaneMask::first(1), observation);
    controller.act(observation, nullptr, LaneMask::first(1), command);
    for (const BlockArray* rows : {&command.q, &command.v, &command.tau, &command.kp, &command.kd, &command.ki}) {
      for (int k = 0; k < rows->rows(); ++k) out.push_back((*rows)(k, 0));
    }
    for (int k = 0; k < command.prescribed.rows(); ++k) out.push_back(command.prescribed(k, 0));
  }
  return out;
}

TEST(ControlDescriptions, TellTheDefaultsThatAreUsed) {
  World fixed = links_world();
  fixed.robot.floating_base = false;
  const Scene free(links_world()), mounted(std::move(fixed));
  std::vector<std::string> seen;
  for (const std::string& yaml : least()) {
    SCOPED_TRACE(yaml);
    const Scene& scene = yaml.starts_with("{tool_path") ? mounted : free;
    const Settings required = Settings::parse(yaml, "least.yaml");
    Settings whole = required;
    int count = 0;
    for (const std::string& name : policy_names()) {
      if (required.has(name)) whole = spelled_out(whole, name, policy_text(name), count), seen.push_back(name);
    }
    for (const std::string& name : tracker_names()) {
      if (!required.at("control").has(name)) continue;
      whole = spelled_out(whole, "control." + name, tracker_text(name), count);
      seen.push_back(name);
    }
    EXPECT_EQ(commands(scene, required), commands(scene, whole)) << whole.resolved_text();
  }
  for (const auto& names : {policy_names(), tracker_names()}) {
    for (const std::string& name : names) {
      if (name == "tosses_dice") continue;                  // of the tests of draws, which share this program
      if (name == "library" || name == "python") continue;  // which need one: tests/controllers
      if (name == "network") continue;                      // the same: tests/engine/network
      EXPECT_THAT(seen, ::testing::Contains(name));
    }
  }
}

TEST(ControlDescriptions, RefuseOtherKeys) {
  const Scene scene(links_world());
  const auto message = [&](const std::string& yaml) {
    return input_error([&] { const Controller made(scene.context(), Settings::parse(yaml, "p.yaml")); });
  };
  const std::string end = ", control: {joint_pd: {kp: 1}}}", gait = "{gait: {" + std::string(kGait);
  EXPECT_THAT(message(gait + ", velocty: [0, 0, 0]}" + end), ::testing::HasSubstr("did you mean 'velocity'?"));
  EXPECT_THAT(message(gait + ", velocity: [0, 0, 0], stance: {lenght: 1}}" + end),
              ::testing::HasSubstr("gait.stance.lenght: unknown key; did you mean 'length'?"));
  EXPECT_THAT(message(gait + ", waypoints: {points: [[1, 0]], speed: {forwards: 1}}}" + end),
              ::testing::HasSubstr("gait.waypoints.speed.forwards: unknown key; did you mean 'forward'?"));
  EXPECT_THAT(message("{joint_trajectory: {sinusoid: {amplitude: 1, freqency: 1}}" + end),
              ::testing::HasSubstr("did you mean 'frequency'?"));
  EXPECT_THAT(message("{hold: {}, control: {prescribed: {limitd: true}}}"),
              ::testing::HasSubstr("did you mean 'limited'?"));
}

}  // namespace
}  // namespace graze
