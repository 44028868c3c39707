// Claim: a scenario file becomes the scenario that it describes.
#include "scenarios/scenario.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "sampling/stream.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::hopper;
using ::testing::Not;
using testing::read;

const UncertainParameter& parameter(const Scenario& scenario, const std::string& name) {
  for (const UncertainParameter& one : scenario.space.parameters) {
    if (one.name == name) return one;
  }
  throw std::out_of_range(name);
}

std::vector<std::string> names_of(const std::vector<PolicySpec>& policies) {
  std::vector<std::string> out;
  for (const PolicySpec& policy : policies) out.push_back(policy.name);
  return out;
}

TEST(Scenario, DefaultsOfTheSmallestFile) {
  const Scenario s = read(
      "graze: 1\nrobot: {urdf: robots/hopper.urdf}\npolicies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}\n");
  EXPECT_EQ(s.physics, "lanes");
  EXPECT_EQ(s.timing.steps(), 1000);
  EXPECT_EQ(s.timing.steps_per_control(), 1);
  EXPECT_EQ(s.design, Design::random);
  EXPECT_EQ(s.seed, 1u);
  EXPECT_EQ(s.particles, 100u);
  EXPECT_EQ(s.recording.telemetry, Telemetry::none);
  EXPECT_FALSE(s.recording.events);
  EXPECT_TRUE(s.recording.phases);
  EXPECT_EQ(s.recording.rules.gap, 0.02);
  EXPECT_EQ(s.recording.rules.dwell, 0.002);
  EXPECT_FALSE(s.torque_speed);
  EXPECT_EQ(s.space.size(), 0);
  EXPECT_TRUE(s.task.requirements.empty());
  EXPECT_DOUBLE_EQ(s.world->gravity.z(), -9.81);
  EXPECT_TRUE(s.world->robot.floating_base);
}

TEST(Scenario, ReadsTheWorld) {
  const Scenario s = read(
      "graze: 1\n"
      "robot:\n"
      "  urdf: robots/hopper.urdf\n"
      "  initial: {position: [1, 2, 50 cm], rpy: [0, 0, 90 deg], velocity: [1, 0, 0], joints: {\"*\": 0.1, hip: 10 "
      "deg, "
      "slide: 1 cm}}\n"
      "environment:\n"
      "  ball: {sphere: 10 cm, movable: true, mass: 2 kg, friction: 0.5, position: [0, 0, 1]}\n"
      "  hill: {heightfield: {size: [2, 3], heights: [[0, 1 cm], [2, 3], [4, 5]], scale: 0.5}}\n"
      "  wall: {plane: x}\n"
      "  rod: {cylinder: [1 cm, 20 cm], movable: true, density: 1 g/cm^3}\n"
      "gravity: 1.62\n"
      "contact: {friction: 0.7, restitution: 0.2, pairs: [{between: [foot, \"{ball,rod}\"], friction: 0.1}], ignore: "
      "[[base, hill]]}\n"
      "time: {end: 2 s, step: 0.5 ms, control: 2 ms}\n"
      "control: {lag: 3 ms}\n"
      "actuators: {torque_speed: true}\n"
      "policies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}\n");
  const World& w = *s.world;
  EXPECT_EQ(w.initial.position, Vec3(1, 2, 0.5));
  EXPECT_DOUBLE_EQ(w.initial.rpy.z(), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(w.initial.joint_position.at("hip"), 10 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(w.initial.joint_position.at("slide"), 0.01);
  EXPECT_DOUBLE_EQ(w.initial.joint_position.at("wheel"), 0.1);
  ASSERT_EQ(w.objects.size(), 4u);
  EXPECT_NEAR(w.objects[0].inertia.mass, 2, 1e-12);  // volume times mass over volume
  EXPECT_DOUBLE_EQ(w.objects[0].friction, 0.5);
  EXPECT_TRUE(std::isnan(w.objects[1].friction)) << "as the contact settings say";
  EXPECT_EQ(w.objects[1].shape.size, Vec3(2, 3, 0.5));
  EXPECT_EQ(w.objects[1].shape.grid->nx, 2);
  EXPECT_EQ(w.objects[1].shape.grid->ny, 3);
  EXPECT_THAT(w.objects[1].shape.grid->height, ElementsAre(0, 0.01, 2, 3, 4, 5));
  // A plane's normal is its own z axis.
  EXPECT_LT((w.objects[2].X_WO.linear().col(2) - Vec3::UnitX()).norm(), 1e-15);
  EXPECT_NEAR(w.objects[3].inertia.mass, 1000 * std::numbers::pi * 1e-4 * 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(w.gravity.z(), -1.62);
  EXPECT_DOUBLE_EQ(w.contact.friction, 0.7);
  EXPECT_EQ(w.contact.pairs.at(0).b, "{ball,rod}");
  EXPECT_DOUBLE_EQ(w.control_lag, 0.003);
  EXPECT_TRUE(s.torque_speed);
  EXPECT_EQ(s.timing.steps(), 4000);
  EXPECT_EQ(s.timing.steps_per_control(), 4);
}

// Claim: a plane's normal may have any length, also one whose square no number holds.
TEST(Scenario, TakesNormalsOfAnyLength) {
  for (const std::string length : {"1", "1e308", "1e-160"}) {
    std::string text = hopper("");
    text.replace(text.find("plane: z"), 8, "plane: [" + length + ", 0, " + length + "]");
    const Scenario s = read(text);
    const Vec3 normal = s.world->objects.at(0).X_WO.linear().col(2);
    EXPECT_LT((normal - Vec3(std::sqrt(0.5), 0, std::sqrt(0.5))).norm(), 1e-15) << length;
  }
}

// Claim: a distribution that stands where the world has a number is the same as an entry of `uncertain`, and its mean
// is what the controller believes.
TEST(Scenario, TakesDistributionsInTheWorld) {
  const Scenario s =
      read(hopper("control: {lag: {normal: {mean: 5 ms, std: 1 ms, min: 0}}}\n"
                  "contact: {friction: {uniform: [0.5, 0.7]}}\n"));
  ASSERT_EQ(s.space.size(), 2);
  EXPECT_DOUBLE_EQ(parameter(s, "contact.friction").nominal, 0.6);
  EXPECT_DOUBLE_EQ(s.world->contact.friction, 0.6);
  EXPECT_NEAR(s.world->control_lag, 0.005, 1e-8);  // cut at 5 standard deviations below the mean
}

// Claim: gears and rotors are read by joint globs with their units, later entries win, and what the joint feels, gear^2
// times rotor, is compiled and drawn as every other number of the robot.
TEST(Scenario, ReadsRotors) {
  const Scenario s =
      read(hopper("actuators: {gear: {\"*\": 50, hip: 100}, rotor_inertia: {hip: 20 g cm^2, \"sl*\": 1e-6}}\n"
                  "uncertain: {robot.joint.hip.rotor_inertia: {normal: {std: 10 %}}, robot.joint.*.gear: {uniform: "
                  "[90, 110]}}\n"));
  const Joint& hip = s.world->robot.joint("hip");
  EXPECT_EQ(hip.gear, 100);
  EXPECT_DOUBLE_EQ(hip.rotor_inertia, 2e-6);
  EXPECT_EQ(s.world->robot.joint("slide").gear, 50);
  EXPECT_DOUBLE_EQ(s.model.bodies[s.model.joint("hip")].armature, 0.02);
  EXPECT_DOUBLE_EQ(s.model.bodies[s.model.joint("slide")].armature, 2.5e-3);
  EXPECT_EQ(s.model.bodies[s.model.joint("wheel")].armature, 0) << "its rotor has no inertia";
  EXPECT_DOUBLE_EQ(parameter(s, "robot.joint.hip.rotor_inertia").persistent.std(), 2e-7);
  const Fabricator fabricator(s.world, {"robot.joint.hip.gear", "robot.joint.hip.rotor_inertia"});
  const Model drawn = fabricator.fabricate(1, std::vector<double>{90, 3e-6}).model;
  EXPECT_DOUBLE_EQ(drawn.bodies[drawn.joint("hip")].armature, 90 * 90 * 3e-6);
  EXPECT_EQ(read(hopper("")).model.bodies[s.model.joint("hip")].armature, 0);
}

// Claim: a gear alone does nothing, fixed or drawn, and that is told.
TEST(Scenario, DoubtsGearsWithoutRotors) {
  const auto doubts = [](const std::string& more) {
    const std::vector<std::string> warnings = read(hopper(more)).warnings;
    return std::count_if(warnings.begin(), warnings.end(), [](const std::string& one) {
      return one.find("gear: does nothing without rotor_inertia") != std::string::npos;
    });
  };
  const std::string drawn = "uncertain: {robot.joint.hip.gear: {uniform: [1, 100]}";
  EXPECT_EQ(doubts("actuators: {gear: 50}\n"), 1);
  EXPECT_EQ(doubts(drawn + "}\n"), 1);
  EXPECT_EQ(doubts(drawn + "}\nactuators: {rotor_inertia: 1e-6}\n"), 0);
  EXPECT_EQ(doubts(drawn + ", robot.joint.*.rotor_inertia: {uniform: [1e-6, 2e-6]}}\n"), 0);
}

// Claim: wrong gears and rotors are refused with their place, also by a back end that would leave them out.
TEST(Scenario, RefusesRotors) {
  const std::vector<std::array<std::string, 2>> cases = {
      {"actuators: {gear: 0}", "actuators.gear: 0"},
      {"actuators: {gear: {hipp: 3}}", "hipp: matches no driven joint; did you mean 'hip'?"},
      {"actuators: {rotor_inertia: -1}", "actuators.rotor_inertia: -1"},
      {"actuators: {rotor_inertia: 1e4 kg m^2}", "at most 1000 kg m^2"},
      {"actuators: {rotor_inertia: 1 kg}", "kg m^2, kgm^2"},
      {"actuators: {rotor: 1}", "rotor_inertia"},
      {"physics: bullet\nactuators: {rotor_inertia: 1e-6}", "did you mean physics: lanes?"},
      {"physics: bullet\nuncertain: {robot.joint.*.rotor_inertia: {uniform: [0, 1e-6]}}", "physics: bullet"}};
  for (const auto& [keys, message] : cases) {
    try {
      read(hopper(keys + "\n"));
      ADD_FAILURE() << keys << ": taken";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(message));
    }
  }
  EXPECT_THAT(read(hopper("actuators: {gear: 3}\n")).warnings, Contains(HasSubstr("does nothing without")));
  EXPECT_THAT(read(hopper("actuators: {rotor_inertia: 30}\n")).warnings, Contains(HasSubstr("did you mean 30 g cm^2")));
}

// Claim: springs of contacts are read into the world with their units, and drawn as every other number of it; % of one
// that is not given is of the one derived from the mass of all that moves, objects that stand further down included.
TEST(Scenario, ReadsSprings) {
  const Scenario s =
      read(hopper("contact: {model: compliant, stiffness: 20000, damping: {normal: {mean: 30 N s/m, std: 10 %}},\n"
                  "  pairs: [{between: [foot, block], stiffness: 5e3 N/m, damping: 7}]}\n"
                  "uncertain: {environment.ground.stiffness: {normal: {std: 5 %}}}\n"));
  EXPECT_EQ(s.world->contact.spring.stiffness, 20000);
  EXPECT_DOUBLE_EQ(s.world->contact.spring.damping, 30);
  EXPECT_EQ(s.world->contact.pairs[0].spring.stiffness, 5000);
  EXPECT_EQ(s.world->contact.pairs[0].spring.damping, 7);
  EXPECT_TRUE(std::isnan(s.world->objects[0].spring.stiffness));
  EXPECT_NEAR(parameter(s, "contact.damping").persistent.std(), 3, 1e-9);
  EXPECT_NEAR(parameter(s, "environment.ground.stiffness").persistent.std(), 1000, 1e-9);
  std::string text = hopper("contact: {model: compliant, stiffness: {normal: {std: 5 %}}}\n");
  text.replace(text.find("block:"), 6, "rod: {sphere: 0.1, position: [9, 0, 1], movable: true, mass: 40}, block:");
  const Scenario derived = read(text);
  const double stiffness = moving_mass(derived.model) * 9.81 / 0.5e-3;
  EXPECT_NEAR(parameter(derived, "contact.stiffness").nominal, stiffness, 1e-9 * stiffness);
  EXPECT_NEAR(parameter(derived, "contact.stiffness").persistent.std(), 0.05 * stiffness, 1e-6 * stiffness);
}

// Claim: a back end without springs refuses them wherever they are written, and names one that has them.
TEST(Scenario, RefusesSpringsOfBullet) {
  const std::string rule =
      ": a spring goes with contact.model: compliant, which physics: bullet does not have; take it out, or did you "
      "mean "
      "physics: lanes?";
  for (const auto& [more, place] : std::initializer_list<std::pair<std::string, std::string>>{
           {"contact: {stiffness: 1e4}", "7:11: contact.stiffness"},
           {"contact: {pairs: [{between: [foot, ground], damping: 1}]}", "7:45: contact.pairs[0].damping"},
           {"uncertain: {contact.damping: {uniform: [1, 2]}}", "7:13: uncertain.contact.damping"},
           {"uncertain: {environment.*.stiffness: 5}", "7:13: uncertain.environment.*.stiffness"}}) {
    const std::string text = hopper("physics: bullet\n" + more + "\n");
    EXPECT_EQ(testing::message_of([&] { read(text); }), testing::kFolder + "test.yaml:" + place + rule);
  }
}

// Claim: in a distribution that stands where the world has a number, % is of the mean that is written there, which is
// then the nominal value; under `uncertain`, and without a mean, it is of the nominal value.
TEST(Scenario, TakesPercentOfItsOwnMean) {
  ScenarioOptions options;
  options.overrides = {
      {"control.lag", "{normal: {mean: 5 ms, std: 2 %}, jitter: {normal: {std: 1 %}}}"},
      {"contact.friction", "{normal: {mean: 0.5, std: 5 %}}"},
      {"contact.restitution", "{normal: {mean: 0.5, std: 2 %, max: 1}}"},
      {"environment.a", "{sphere: 1, position: [9, 0, 1], friction: {normal: {mean: 0.4, std: 5 %}}}"},
      {"environment.b", "{sphere: 1, position: [9, 0, 4], movable: true, mass: {normal: {mean: 3, std: 10 %}}}"},
      {"environment.c", "{sphere: 1, position: [9, 0, 8], movable: true, density: {normal: {mean: 3000, std: 10 %}}}"},
      {"environment.d", "{sphere: 1, position: [9, 9, 8], friction: {uniform: {spread: 10 %}}}"},
      {"environment.e", "{sphere: 1, position: [9, 5, 8], friction: {normal: {std: 10 %}}}"},
      {"uncertain", "{environment.e.restitution: {normal: {mean: 0.6, std: 2 %}}}"}};
  const Scenario s = parse_scenario(hopper(""), testing::kFolder + "a.yaml", options);
  const auto std = [&](const char* name) { return parameter(s, name).persistent.std(); };
  EXPECT_NEAR(std("control.lag"), 1e-4, 1e-12);
  EXPECT_NEAR(parameter(s, "control.lag").jitter->std(), 5e-5, 1e-12);
  EXPECT_NEAR(std("contact.friction"), 0.025, 1e-12);
  EXPECT_NEAR(std("contact.restitution"), 0.01, 1e-12);
  EXPECT_NEAR(std("environment.a.friction"), 0.02, 1e-12);
  EXPECT_NEAR(std("environment.b.mass"), 0.3, 1e-12);
  EXPECT_NEAR(std("environment.c.density"), 300, 1e-9);
  EXPECT_NEAR(std("environment.d.friction"), 0.05 / std::sqrt(3.0), 1e-12);  // of contact.friction, 0.5, on either side
  EXPECT_NEAR(std("environment.e.friction"), 0.05, 1e-12);
  EXPECT_NEAR(std("environment.e.restitution"), 0.01, 1e-12);
}

// Claim: a lag that outlasts the trace is warned of, where it stands and with what was probably meant; no other is.
TEST(Scenario, WarnsOfALagBeyondTheTrace) {
  const auto warnings = [](const std::string& more) { return ::testing::PrintToString(read(hopper(more)).warnings); };
  EXPECT_THAT(warnings("control: {lag: 5}\n"),
              AllOf(HasSubstr("test.yaml:6:16: control.lag: 5 s, and no trace is longer than 1 s"),
                    HasSubstr("did you mean 5 ms?")));
  EXPECT_THAT(warnings("uncertain: {control.lag: {uniform: [4, 6]}}\n"),
              AllOf(HasSubstr("test.yaml:6:26: uncertain.control.lag: 5 s"), HasSubstr("did you mean 6 ms?")));
  EXPECT_THAT(warnings("control: {lag: 1000}\n"), AllOf(HasSubstr("control.lag: 1000 s"), Not(HasSubstr("mean"))));
  EXPECT_THAT(warnings("control: {lag: 900 ms}\n"), Not(HasSubstr("control.lag")));
}

TEST(Uncertain, ReadsEveryDistribution) {
  const Scenario s =
      read(hopper("uncertain:\n"
                  "  robot.link.base.mass: {normal: {std: 5 %}}\n"
                  "  robot.link.thigh.mass: {normal: {mean: 600 g, std: 0.1, min: 0.3, max: 0.9}}\n"
                  "  robot.link.foot.mass: {uniform: {spread: 10 %}}\n"
                  "  robot.link.disc.mass: {log_normal: {log_std: 0.2}}\n"
                  "  robot.link.thigh.length: {uniform: [9 cm, 11 cm]}\n"
                  "  robot.link.thigh.radius: {log_uniform: [1, 2, cm]}\n"
                  "  robot.link.foot.radius: {triangular: {min: 2 cm, max: 4 cm}}\n"
                  "  robot.joint.hip.effort: {choice: {values: [8, 10, 12], weights: [1, 2, 1]}}\n"
                  "  robot.joint.hip.damping: {empirical: [0.1, 0.3]}\n"
                  "  contact.friction: 0.9\n"
                  "  control.lag: {jitter: {uniform: [-1, 1, ms]}}\n"));
  const auto text = [&](const char* name) { return parameter(s, name).persistent.describe(); };
  EXPECT_EQ(text("robot.link.base.mass"), "normal(mean=2, std=0.1)");
  EXPECT_EQ(text("robot.link.thigh.mass"), "truncated_normal(mean=0.6, std=0.1, min=0.3, max=0.9)");
  EXPECT_DOUBLE_EQ(parameter(s, "robot.link.foot.mass").persistent.mean(), 0.1);
  EXPECT_DOUBLE_EQ(parameter(s, "robot.link.disc.mass").persistent.median(), 0.1);
  EXPECT_EQ(text("robot.link.thigh.length"), "uniform(min=0.09, max=0.11)");
  EXPECT_EQ(text("robot.link.thigh.radius"), "log_uniform(min=0.01, max=0.02)");
  EXPECT_EQ(text("robot.link.foot.radius"), "triangular(min=0.02, mode=0.03, max=0.04)");
  EXPECT_EQ(text("robot.joint.hip.effort"), "discrete(values=[8, 10, 12], p=[0.25, 0.5, 0.25])");
  EXPECT_EQ(text("robot.joint.hip.damping"), "empirical(n=2, min=0.1, max=0.3)");
  EXPECT_EQ(text("contact.friction"), "constant(0.9)");
  EXPECT_EQ(text("control.lag"), "constant(0)");
  EXPECT_EQ(parameter(s, "control.lag").jitter->describe(), "uniform(min=-0.001, max=0.001)");
  EXPECT_EQ(parameter(s, "robot.link.thigh.length").unit, "m");
}

TEST(Uncertain, ConesStandForTwoScalars) {
  const Scenario s = read(hopper("uncertain: {robot.joint.*.axis: {cone: {std: 1 deg}}}\n"));
  ASSERT_EQ(s.space.size(), 6);
  EXPECT_DOUBLE_EQ(parameter(s, "robot.joint.hip.axis.tilt").persistent.std(), std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(parameter(s, "robot.joint.hip.axis.heading").persistent.highest(), 2 * std::numbers::pi);
}

TEST(Uncertain, LaterPatternsReplaceEarlierOnes) {
  const Scenario s =
      read(hopper("uncertain:\n"
                  "  robot.link.*.mass: {uniform: {spread: 10 %}}\n"
                  "  robot.link.foot.mass: {normal: {std: 1 %}}\n"));
  EXPECT_THAT(parameter(s, "robot.link.base.mass").persistent.describe(), HasSubstr("uniform"));
  EXPECT_THAT(parameter(s, "robot.link.foot.mass").persistent.describe(), HasSubstr("normal"));
}

TEST(Uncertain, CorrelatesGroups) {
  const Scenario s = read(
      hopper("uncertain:\n"
             "  robot.link.*.mass: {uniform: {spread: 10 %}}\n"
             "  contact.friction: {uniform: [1, 2]}\n"
             "  correlated:\n"
             "    - {parameters: [\"robot.link.{base,foot}.mass\"], correlation: 0.5}\n"
             "    - {parameters: [contact.friction, robot.link.thigh.mass], correlation: [[1, -0.2], [-0.2, 1]]}\n"));
  ASSERT_EQ(s.space.groups.size(), 2u);
  const CorrelationGroup& first = s.space.groups[0];
  EXPECT_EQ(s.space.parameters[first.members[1]].name, "robot.link.foot.mass");
  EXPECT_DOUBLE_EQ(first.correlation(0, 1), 0.5);
  const CorrelationGroup& second = s.space.groups[1];
  EXPECT_EQ(s.space.parameters[second.members[0]].name, "contact.friction");
  EXPECT_DOUBLE_EQ(second.correlation(1, 0), -0.2);
}

TEST(Uncertain, ReadsAColumn) {
  const std::string file = ::testing::TempDir() + "graze_column.csv";
  std::ofstream(file) << "# measured\nname,mu\na, 0.4\nb, 0.6\n";
  const Scenario s = read(hopper("uncertain: {contact.friction: {empirical: {file: " + file + ", column: mu}}}\n"));
  EXPECT_DOUBLE_EQ(parameter(s, "contact.friction").persistent.mean(), 0.5);
  EXPECT_THAT(testing::message_of([&] {
                read(hopper("uncertain: {contact.friction: {empirical: {file: " + file + ", column: nu}}}\n"));
              }),
              HasSubstr("has no such column; did you mean 'mu'?"));
  EXPECT_THAT(testing::message_of([&] {
                read(hopper("uncertain: {contact.friction: {empirical: {file: " + file + ", column: name}}}\n"));
              }),
              HasSubstr(file + ":3: column name: 'a': must be a number"));
  std::filesystem::remove(file);
}

// A table that is no text is refused for that, at the byte, rather than for what its bytes are taken for.
TEST(Uncertain, ABinaryTableIsNamed) {
  const std::string file = ::testing::TempDir() + "graze_binary.csv";
  const auto refusal = [&](const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
    return testing::message_of(
        [&] { read(hopper("uncertain: {contact.friction: {empirical: {file: " + file + ", column: mu}}}\n")); });
  };
  EXPECT_THAT(refusal(std::string(200, '\0')), HasSubstr(file + ":1:1: a NUL byte: tables are text"));
  EXPECT_THAT(refusal(std::string("mu\n0.4\n0.\0005\n", 12)), HasSubstr(file + ":3:3: a NUL byte"));
  EXPECT_THAT(refusal(std::string("m\0u\0\n\0", 6)), HasSubstr(file + ":1:2: a NUL byte"));
  std::filesystem::remove(file);
}

// Claim: the jitter that the sensors get is that of their channels, channel by channel.
TEST(Uncertain, GivesTheSensorsTheirNoise) {
  const Scenario s =
      read(hopper("uncertain:\n"
                  "  sensor.encoder.hip.velocity: {jitter: {normal: {std: 0.1}}}\n"
                  "  control.lag: {jitter: {normal: {std: 1 ms}}}\n"));
  const SensorNoise noise = sensor_noise(s, 7);
  const std::vector<std::string> channels = channel_names(s.world->robot);
  ASSERT_EQ(noise.jitter.size(), channels.size());
  EXPECT_EQ(noise.seed, 7u);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    EXPECT_EQ(noise.jitter[i].has_value(), channels[i] == "sensor.encoder.hip.velocity") << channels[i];
  }
}

/// Variance over 2000 particles of a sensor's noise, summed over 0.1 s, in a scenario with this jitter.
double drift_of(const std::string& jitter, const std::string& step, double control) {
  const std::string text = hopper("uncertain: {sensor.imu.angular.roll: {jitter: " + jitter + "}}\n");
  ScenarioOptions options;
  options.overrides = {{"time.control", step}};
  const Scenario s = parse_scenario(text, testing::kFolder + "test.yaml", options);
  const SensorNoise noise = sensor_noise(s, 3);
  const Distribution drawn =
      **std::find_if(noise.jitter.begin(), noise.jitter.end(), [](const auto& one) { return one; });
  double square = 0;
  for (std::uint32_t particle = 0; particle < 2000; ++particle) {
    double sum = 0;
    for (std::uint32_t k = 0; k < std::lround(0.1 / control); ++k) {
      sum += control * drawn.quantile(uniform(3, particle, name_hash("sensor.imu.angular.roll"), k));
    }
    square += sum * sum / 2000;
  }
  return square;
}

// Claim: noise of a given density adds up to density^2 T whatever the control step. The standard error of a variance
// over 2000 particles is 3.2 %; 5 sigma: 16 %. A jitter of fixed std adds up in proportion to the step.
TEST(Uncertain, NoiseDensityDoesNotDependOnTheStep) {
  const std::string density = "{noise: {density: 0.02 rad/s^2/sqrt(Hz)}}", fixed = "{normal: {std: 0.02}}";
  EXPECT_NEAR(drift_of(density, "1 ms", 0.001) / (4e-4 * 0.1), 1, 0.16);
  EXPECT_NEAR(drift_of(density, "4 ms", 0.004) / (4e-4 * 0.1), 1, 0.16);
  EXPECT_GT(drift_of(fixed, "4 ms", 0.004), 3 * drift_of(fixed, "1 ms", 0.001));
}

// Claim: a density is read in the channel's unit per root of frequency.
TEST(Uncertain, ReadsNoiseDensities) {
  const auto std_of = [](const std::string& density) {
    const Scenario s =
        read(hopper("uncertain: {sensor.imu.angular.*: {jitter: {noise: {density: " + density + "}}}}\n"));
    return s.space.parameters.front().jitter->std();
  };
  EXPECT_DOUBLE_EQ(std_of("0.1"), 0.1 / std::sqrt(1e-3));
  EXPECT_DOUBLE_EQ(std_of("60 deg/s^2/sqrt(Hz)"), 60 * std::numbers::pi / 180 / std::sqrt(1e-3));
  EXPECT_DOUBLE_EQ(std_of("1e-3 rad/s^2/sqrt(Hz)"), 1e-3 / std::sqrt(1e-3));
}

TEST(Policies, MultiplyOver) {
  const Scenario s = read(
      "graze: 1\nrobot: {urdf: robots/hopper.urdf}\npolicies:\n"
      "  a: {hold: {}, control: {joint_pd: {kp: 1}}}\n"
      "  b: {hold: {}, control: {joint_pd: {kp: {slide: 1}}}, over: {control.joint_pd.kp.slide: [10, 2e1 N/m], "
      "control.joint_pd.kd: [1, 2]}}\n");
  EXPECT_THAT(names_of(s.policies), ElementsAre("a", "b/10/1", "b/10/2", "b/2e1N_m/1", "b/2e1N_m/2"));
  const Settings gains = s.policies[3].settings.at("control").at("joint_pd");
  EXPECT_DOUBLE_EQ(gains.at("kp").at("slide").number(Quantity::stiffness), 20);
  EXPECT_DOUBLE_EQ(gains.at("kd").number(), 1);
  EXPECT_FALSE(s.policies[3].settings.has("over"));
}

// Claim: two scenarios have one hash exactly when their resolved texts are one; the text reads back to the same
// scenario.
TEST(Scenario, IsIdentifiedByItsResolvedText) {
  const Scenario a = read(hopper("name: x\n")), b = read("# a comment\n" + hopper("name:   x\n"));
  const Scenario c = read(hopper("name: y\n"));
  EXPECT_EQ(a.sha256, b.sha256);
  EXPECT_NE(a.sha256, c.sha256);
  EXPECT_EQ(a.sha256.size(), 64u);
  const Scenario again = parse_scenario(a.text, testing::kFolder + "again.yaml");
  EXPECT_EQ(again.sha256, a.sha256);
}

// Claim: sha256 is SHA-256 (FIPS 180-4): the digest of the resolved text agrees with that of sha256sum.
TEST(Scenario, HashIsSha256) {
  const Scenario s = read(hopper(""));
  const std::string file = ::testing::TempDir() + "graze_resolved.yaml";
  std::ofstream(file, std::ios::binary) << s.text;
  FILE* pipe = popen(("sha256sum '" + file + "'").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  char digest[65] = {};
  EXPECT_EQ(std::fread(digest, 1, 64, pipe), 64u);
  pclose(pipe);
  EXPECT_EQ(s.sha256, digest);
  std::filesystem::remove(file);
}

TEST(Shipped, ScenariosAreValid) {
  int found = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(GRAZE_SOURCE_DIR) + "/data/scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    ++found;
    EXPECT_EQ(testing::message_of([&] { load_scenario(entry.path().string()); }), "(accepted)") << entry.path();
  }
  EXPECT_GE(found, 5);
}

// Claim: the curb scenario has Figure 15's list: 97 numbers drawn once and 79 at every control step (a conical error
// counts once; docs/parameters.md).
TEST(Shipped, CurbHasTheListOfFigure15) {
  const Scenario s = load_scenario(std::string(GRAZE_SOURCE_DIR) + "/data/scenarios/quadruped_curb.yaml");
  int once = 0, each_step = 0;
  for (const UncertainParameter& p : s.space.parameters) {
    if (!p.persistent.is_constant() && !p.name.ends_with(".axis.heading")) ++once;
    if (p.jitter) ++each_step;
  }
  EXPECT_EQ(once, 17 + 12 + 16 + 12 + 3 + 36 + 1);
  EXPECT_EQ(each_step, 36 + 12 + 6 + 2 + 3 + 7 + 12 + 1);
  EXPECT_THAT(names_of(s.policies), ElementsAre("step/1cm", "step/2cm", "step/3cm", "step/4cm"));
  // Torso and feet collide with the world, legs do not.
  for (const ColliderPair& pair : s.model.pairs) {
    const Collider &a = s.model.colliders[pair.a], &b = s.model.colliders[pair.b];
    if (a.is_object || b.is_object) {
      EXPECT_THAT((a.is_object ? b : a).name, Not(HasSubstr("LEG")));
    }
  }
}

// Claim: the mean of every distribution of the curb's robot is its nominal value, so that the nominal robot is the mean
// robot (links.urdf). Rounding: the URDF has 12 digits.
TEST(Shipped, CurbRobotIsTheMeanRobot) {
  const Scenario s = load_scenario(std::string(GRAZE_SOURCE_DIR) + "/data/scenarios/quadruped_curb.yaml");
  for (const UncertainParameter& p : s.space.parameters) {
    if (!p.name.starts_with("robot.link.")) continue;
    EXPECT_NEAR(p.persistent.mean(), p.nominal, 1e-4 * p.nominal) << p.name;
  }
}

}  // namespace
}  // namespace graze
