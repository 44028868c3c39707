// Claim: each doubt begins where its rule says, held against the robot or the trace: a number a little inside of the
// bound is let pass, a little beyond it is warned of, and one whose unit is written is believed.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/model/measures.h"
#include "engine/settings/warnings.h"
#include "sampling/constants.h"
#include "scenarios/doubts.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using Action = std::function<void()>;

std::vector<std::string> doubts_in(const Action& action) {
  const Warnings warnings;
  action();
  return warnings.texts();
}

Settings in_file(const std::string& yaml) { return Settings::parse(yaml, "d.yaml"); }

// ---- widths of distributions

struct WidthRule {
  const char* path;
  Quantity quantity;
  double normal, uniform;  // bounds of std and of half a width; infinite: none
  double distance = 0;
};

/// Of a robot of 3 m: extent (1, 2, 2).
const WidthRule kWidths[] = {
    {"sensor.encoder.hip.position", Quantity::angle, 0.5, 0.5},
    {"robot.joint.hip.zero", Quantity::angle, 0.5, 0.5},
    {"initial.base.yaw", Quantity::angle, std::numbers::pi / 2, std::numbers::pi},
    {"initial.joint.hip.position", Quantity::angle, std::numbers::pi / 2, std::numbers::pi},
    {"robot.link.foot.com.x", Quantity::length, 0.75, 0.75},
    {"initial.base.x", Quantity::length, 3, 15},
    {"environment.curb.position.y", Quantity::length, 6, kInfinity},
    {"environment.curb.position.y", Quantity::length, 11, kInfinity, 5},
    {"environment.curb.size.y", Quantity::length, kInfinity, kInfinity},
    {"robot.link.foot.radius", Quantity::length, kInfinity, kInfinity},
    {"robot.link.foot.mass", Quantity::mass, kInfinity, kInfinity},
};

class WidthDoubts : public ::testing::TestWithParam<WidthRule> {
 protected:
  std::vector<std::string> doubted(const std::string& yaml) const {
    Parameter parameter;
    parameter.path = GetParam().path;
    parameter.quantity = GetParam().quantity;
    const Settings value = in_file("s: " + yaml).at("s");
    return doubts_in([&] { doubt_width(value, parameter, Vec3(1, 2, 2), GetParam().distance); });
  }
  const char* unit() const { return GetParam().quantity == Quantity::angle ? "rad" : "m"; }
};

TEST_P(WidthDoubts, BeginAtTheirBound) {
  const auto& [path, quantity, normal, uniform, distance] = GetParam();
  if (quantity == Quantity::mass) {
    EXPECT_THAT(doubted("{normal: {std: 90}}"), IsEmpty());
    return;
  }
  for (const char* form : {"{{normal: {{mean: 0.1, std: {:.9g}}}}}", "{{jitter: {{normal: {{std: {:.9g}}}}}}}"}) {
    const double bound = std::isfinite(normal) ? normal : 90;
    EXPECT_THAT(doubted(fmt::format(fmt::runtime(form), 0.999 * bound)), IsEmpty()) << path;
    if (!std::isfinite(normal)) continue;
    const std::vector<std::string> beyond = doubted(fmt::format(fmt::runtime(form), 1.001 * bound));
    ASSERT_EQ(beyond.size(), 1u) << path;
    EXPECT_THAT(beyond[0], HasSubstr(fmt::format("std: {:g} {}: is a spread of ", 1.001 * bound, unit())));
    EXPECT_THAT(beyond[0], HasSubstr(quantity == Quantity::angle ? "deg?" : "cm?")) << "what is meant";
    EXPECT_THAT(beyond[0], EndsWith(fmt::format("(if not, write {:g} {})", 1.001 * bound, unit())));
    EXPECT_THAT(doubted(fmt::format("{{normal: {{std: {} {}}}}}", 1.001 * bound, unit())), IsEmpty());
  }
  // The same half width in its three forms, of which the middle does not matter.
  for (const char* form : {"{{uniform: {{spread: {0:.9g}}}}}", "{{uniform: [{1:.9g}, {2:.9g}]}}",
                           "{{uniform: {{min: {1:.9g}, max: {2:.9g}}}}}"}) {
    const double bound = std::isfinite(uniform) ? uniform : 90;
    const auto written = [&](double half) { return fmt::format(fmt::runtime(form), half, 0.25 - half, 0.25 + half); };
    EXPECT_THAT(doubted(written(0.999 * bound)), IsEmpty()) << path;
    EXPECT_EQ(doubted(written(1.001 * bound)).size(), std::isfinite(uniform) ? 1u : 0u) << written(1.001 * bound);
  }
  EXPECT_THAT(doubted("{uniform: [-6 rad, 6 rad]}"), IsEmpty()) << "with its unit";
  EXPECT_THAT(doubted("{uniform: [-50, 6, deg]}"), IsEmpty()) << "which may stand once";
  EXPECT_THAT(doubted("5"), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Rules, WidthDoubts, ::testing::ValuesIn(kWidths));

// What has been doubted where it was read, beyond a turn or 100 m, is not doubted twice.
TEST(Doubts, OfWidthsAreNotGivenTwice) {
  Parameter angle, length;
  angle.path = "initial.base.yaw", angle.quantity = Quantity::angle;
  length.path = "initial.base.x", length.quantity = Quantity::length;
  const auto count = [](const Parameter& parameter, double std) {
    const Settings value = in_file(fmt::format("s: {{normal: {{std: {:.9g}}}}}", std)).at("s");
    const std::vector<std::string> all = doubts_in([&] { doubt_width(value, parameter, Vec3(1, 2, 2), 0); });
    return std::count_if(all.begin(), all.end(),
                         [](const auto& one) { return one.find("is a spread of") != std::string::npos; });
  };
  EXPECT_EQ(count(angle, 6.283), 1);
  EXPECT_EQ(count(angle, 6.284), 0);
  EXPECT_EQ(count(length, 99.9), 1);
  EXPECT_EQ(count(length, 100.1), 0);
}

TEST(Doubts, OfConesBeginAtHalfARadian) {
  const auto count = [](const std::string& std) {
    const Settings value = in_file("std: " + std).at("std");
    return doubts_in([&] { doubt_cone(value); }).size();
  };
  EXPECT_EQ(count("0.5"), 0u);
  EXPECT_EQ(count("0.501"), 1u);
  EXPECT_EQ(count("0.501 rad"), 0u);
  EXPECT_EQ(count("29 deg"), 0u);
}

// ---- single keys

TEST(Doubts, OfAClearanceBeginAtTwiceTheRobot) {
  const auto said = [](const std::string& clearance) {
    const Settings scenario = in_file("robot: {initial: {height: on_ground, clearance: " + clearance + "}}");
    return doubts_in([&] { doubt_clearance(scenario, Vec3(0.5, 0.2, 0.4)); });
  };
  EXPECT_THAT(said("1"), IsEmpty());
  EXPECT_THAT(said("1.01"),
              ElementsAre(EndsWith("clearance: 1.01 m: a fall from 2.02 times the robot's size of 0.5 m; did "
                                   "you mean 1.01 cm? (if not, write 1.01 m)")));
  EXPECT_THAT(said("1.01 m"), IsEmpty());
  EXPECT_THAT(said("101"),
              Contains(HasSubstr("a fall from 202 times the robot's size of 0.5 m; did you mean 101 mm?")));
  EXPECT_THAT(said("2000000"), Not(Contains(HasSubstr("a fall from")))) << "no unit explains it";
  EXPECT_THAT(doubts_in([] { doubt_clearance(in_file("robot: {}"), Vec3(1, 1, 1)); }), IsEmpty());
}

TEST(Doubts, OfALagBeginWhereNoCommandArrives) {
  const auto said = [](const std::string& lag, double typical) {
    const Settings scenario = in_file("control: {lag: " + lag + "}");
    return doubts_in([&] { doubt_lag(scenario, scenario.at("control").at("lag"), typical, 2); });
  };
  EXPECT_THAT(said("1.99", 1.99), IsEmpty());
  EXPECT_THAT(said("2", 2),
              ElementsAre(EndsWith("lag: 2 s, and no trace is longer than 2 s: no command of a policy ever "
                                   "arrives; did you mean 2 ms?")));
  EXPECT_THAT(said("3 s", 3), ElementsAre(EndsWith("ever arrives")));
  EXPECT_THAT(said("2000", 2000), ElementsAre(EndsWith("ever arrives"))) << "2000 ms would be as long";
  EXPECT_THAT(said("1999", 1999), ElementsAre(EndsWith("did you mean 1999 ms?")));
  EXPECT_THAT(said("{triangular: [3, 4, 5]}", 4), ElementsAre(EndsWith("did you mean 5 ms?"))) << "the largest";
  EXPECT_THAT(said("{normal: {mean: 4 s, std: 1, min: 0}, jitter: {normal: {std: 9}}}", 4),
              ElementsAre(EndsWith("did you mean 1 ms?")))
      << "of those without a unit, and not the jitter";
  EXPECT_THAT(said("{choice: {values: [3 s, 4 s], weights: [1, 2]}}", 4), ElementsAre(EndsWith("ever arrives")));
  const Settings elsewhere = in_file("name: x");
  EXPECT_THAT(doubts_in([&] { doubt_lag(elsewhere, std::nullopt, 3, 2); }),
              ElementsAre(HasSubstr("control.lag: 3 s, and no trace")));
}

TEST(Doubts, OfPoliciesThatWaitBeginAtTheEnd) {
  const auto said = [](const std::string& policy) {
    const Settings written = in_file(policy);
    return doubts_in([&] { doubt_waits(written, 2); });
  };
  EXPECT_THAT(said("{gait: {settle: 1.9 s}, control: {joint_pd: {kp: 1}}}"), IsEmpty());
  EXPECT_THAT(said("{gait: {settle: 2 s}}"),
              ElementsAre(EndsWith("settle: 2 s, and no trace is longer than 2 s: no foot is ever lifted")));
  EXPECT_THAT(said("{hold: {}, control: {inverse_dynamics: {kp: 1, contacts: {from: flags, delay: 3}}}}"),
              ElementsAre(HasSubstr("delay: 3 s, and no trace is longer than 2 s: nothing that is sensed")));
  EXPECT_THAT(said("{hold: {}}"), IsEmpty());
}

TEST(Doubts, OfWhatIsKeptBeginAtTwiceTheTrace) {
  Timing timing;
  timing.end = 2;
  const auto said = [&](const std::string& record) {
    const Settings scenario = in_file("record: " + record);
    return doubts_in([&] { doubt_last(scenario, timing); });
  };
  EXPECT_THAT(said("{telemetry: last, last: 4}"), IsEmpty());
  EXPECT_THAT(said("{telemetry: last, last: 4.01}"), ElementsAre(HasSubstr("did you mean 4.01 ms?")));
  EXPECT_THAT(said("{telemetry: last, last: 4.01 s}"), ElementsAre(EndsWith("as 'telemetry: failures' does")));
  EXPECT_THAT(said("{telemetry: all, last: 9}"), IsEmpty());
  EXPECT_THAT(said("{last: 9}"), IsEmpty());
  EXPECT_THAT(said("{telemetry: last, last: 3000}"), Contains(EndsWith("did you mean 3000 us?")))
      << "3 s would be longer than the trace";
}

TEST(Doubts, OfGravityThatLifts) {
  const auto said = [](const std::string& gravity) {
    const Settings scenario = in_file("gravity: " + gravity);
    return doubts_in([&] { doubt_gravity(scenario); });
  };
  EXPECT_THAT(said("[0, 1, 9.81]"),
              ElementsAre(EndsWith("points upward: things fall up; did you mean [0, 1, -9.81]?")));
  EXPECT_THAT(said("[0, 0, 1e-9]"), Not(IsEmpty()));
  for (const char* fine : {"[0, 0, 0]", "[9.81, 0, 0]", "[0, 0, -9.81]", "9.81"})
    EXPECT_THAT(said(fine), IsEmpty()) << fine;
}

// ---- objects

TEST(Doubts, OfMassesBeginAtAirAndOsmium) {
  const auto said = [](double mass, double volume, const std::string& written = "5") {
    const Settings object = in_file(fmt::format("o: {{sphere: {}, mass: {:.9g}}}", written, mass)).at("o");
    return doubts_in([&] { doubt_mass(object.at("mass"), object.at("sphere"), mass, volume); });
  };
  EXPECT_THAT(said(1.2, 1), IsEmpty());
  EXPECT_THAT(said(23000, 1), IsEmpty());
  EXPECT_THAT(said(1.199, 1), ElementsAre(EndsWith("o.sphere: 1.199 kg in 1 m^3 are lighter than air")));
  EXPECT_THAT(said(23001, 1),
              ElementsAre(EndsWith("o.mass: 23001 kg in 1 m^3 are denser than any metal; did you mean 23001 g?")));
  const double ball = 4.0 / 3 * std::numbers::pi * 125;  // m^3 of 5 m
  EXPECT_THAT(said(1, ball), ElementsAre(EndsWith("are lighter than air; is its size meant in cm?")));
  EXPECT_THAT(said(0.001, ball), ElementsAre(EndsWith("is its size meant in cm?")));
  EXPECT_THAT(said(1e-5, ball), ElementsAre(EndsWith("is its size meant in mm?")))
      << "in cm it would weigh as air does";
}

TEST(Doubts, OfWeightsBeginAtAHundredRobots) {
  const auto said = [](const std::string& shape, double density, double volume) {
    const Settings object = in_file("o: {shape: " + shape + "}").at("o");
    return doubts_in([&] { doubt_weight(object.at("shape"), density, volume, 2); });
  };
  EXPECT_THAT(said("5", 200, 1), IsEmpty());
  EXPECT_THAT(said("5", 201, 1),
              ElementsAre(EndsWith("1 m^3 of 201 kg/m^3 weigh 201 kg, 100 times the robot's 2 kg; is its "
                                   "size meant in cm?")));
  for (const char* bare : {"[1, 2, 3]", "{radius: 1, length: 2 cm}", "{radius: 1, length: 2}", "[1 cm, 2]"}) {
    EXPECT_EQ(said(bare, 201, 1).size(), 1u) << bare;
  }
  for (const char* with_unit : {"5 m", "[1, 2, m]", "[1, 2, 3 m]", "{radius: 1 m, length: 2 m}", "[1 m, 2 m, 3 m]"}) {
    EXPECT_THAT(said(with_unit, 201, 1), IsEmpty()) << with_unit;
  }
  EXPECT_THAT(said("5", 1000, 4e5), ElementsAre(EndsWith("is its size meant in mm?"))) << "400 kg in cm are too many";
  EXPECT_THAT(said("5", 1000, 1e9), ElementsAre(EndsWith("the robot's 2 kg"))) << "no unit explains it";
}

/// Of the hopper with `environment`, whose base is put at z.
std::vector<std::string> doubts_of_height(const std::string& environment, double z) {
  const Settings scenario =
      in_file(fmt::format("robot: {{urdf: x, initial: {{height: {:.12g}}}}}\nenvironment: {}", z, environment));
  const Scenario s = testing::read(
      fmt::format("graze: 1\nrobot: {{urdf: robots/hopper.urdf, initial: {{height: {:.12g} m}}}}\nenvironment: {}\n"
                  "policies: {{rest: {{hold: {{}}, control: {{joint_pd: {{kp: 10}}}}}}}}\n",
                  z, environment));
  return doubts_in([&] { doubt_places(scenario, *s.world, s.model, initial_state(*s.world, s.model)); });
}

// A place is high when it is twenty robots above the top of all that is fixed, whatever shape that has.
TEST(Doubts, OfHeightsAreHeldAgainstWhatIsBelow) {
  const Scenario hopper = testing::read(testing::hopper(""));
  const double size = robot_extent(hopper.model, initial_state(*hopper.world, hopper.model)).norm();
  const std::pair<const char*, double> cases[] = {
      {"{g: {plane: z}}", 0},
      {"{g: {plane: z, position: [0, 0, -2]}}", -2},
      {"{g: {plane: z}, b: {box: [1, 1, 3], position: [9, 0, 2]}}", 3.5},
      {"{b: {box: [2, 1, 4], position: [9, 0, 2], rpy: [0, 30 deg, 0]}}", 2 + 2 * std::cos(std::numbers::pi / 6) + 0.5},
      {"{s: {sphere: 3, position: [9, 0, 2]}}", 5},
      {"{c: {cylinder: [1, 4], position: [9, 0, 2]}}", 5},
      {"{h: {heightfield: {size: [2, 2], heights: [[0, 1], [4, 2]], scale: 0.5}, position: [9, 0, 1]}}", 3},
      {"{m: {mesh: {file: robots/tetrahedron.obj, scale: 2}, position: [9, 0, 1]}}", 1 + 2 * std::sqrt(3.0)},
      {"{g: {plane: z}, b: {sphere: 1, position: [9, 0, 30], movable: true, mass: 1}}", 0},
  };
  for (const auto& [environment, top] : cases) {
    EXPECT_THAT(doubts_of_height(environment, top + 19.99 * size), IsEmpty()) << environment;
    EXPECT_THAT(doubts_of_height(environment, top + 20.01 * size),
                ElementsAre(HasSubstr("above all that the robot could")))
        << environment;
  }
  EXPECT_THAT(doubts_of_height("{w: {plane: x}}", 90), IsEmpty()) << "a wall is nothing to stand on";
}

TEST(Doubts, OfSupportAreOfWhatFallsForEver) {
  World world;
  world.robot.links.resize(1);
  world.objects.resize(1);
  const Settings scenario = in_file("robot: {urdf: x}");
  const auto said = [&] { return doubts_in([&] { doubt_support(scenario, world); }).size(); };
  EXPECT_EQ(said(), 1u);
  world.gravity = Vec3::Zero();
  EXPECT_EQ(said(), 0u) << "it floats";
  world.gravity = {0, 0, -9.81};
  world.robot.floating_base = false;
  EXPECT_EQ(said(), 0u) << "it hangs";
  world.robot.floating_base = true;
  world.objects.clear();
  EXPECT_EQ(said(), 0u) << "there is nothing to touch";
  world.objects.resize(1);
  world.robot.links[0].collisions.resize(1);
  EXPECT_EQ(said(), 0u);
}

// ---- tasks

TEST(Doubts, OfImpulsesAreHeldAgainstAllThatMoves) {
  const Scenario hopper = testing::read(testing::hopper(""));
  const double mass = moving_mass(hopper.model);
  const auto said = [&](double below, const std::string& during, double end) {
    const Settings written = in_file(fmt::format("i: {{below: {:.9g}{}}}", below, during)).at("i");
    return doubts_in([&] { doubt_impulse(written, hopper.model, end); });
  };
  const double whole = mass * (10 + 98.1 * 2), begin = mass * (10 + 98.1 * 0.01);
  EXPECT_THAT(said(0.999 * whole, "", 2), IsEmpty());
  EXPECT_THAT(said(1.001 * whole, "", 2), ElementsAre(HasSubstr("mN s?")));
  EXPECT_THAT(said(0.999 * begin, ", during: 10 ms", 2), IsEmpty());
  EXPECT_THAT(said(1.001 * begin, ", during: 10 ms", 2), ElementsAre(HasSubstr("would stop all that moves")));
  EXPECT_THAT(said(1, ", during: 1.99", 2), IsEmpty());
  EXPECT_THAT(said(1, ", during: 2", 2), ElementsAre(HasSubstr("so it limits nothing; did you mean 2 ms?")));
  EXPECT_THAT(said(1e9 * whole, "", 2), IsEmpty()) << "no unit explains it";
}

TEST(Doubts, OfPlacesNameTheBoundThatIsMissed) {
  const auto meant = [](const std::string& range, double margin, double reach = 0) {
    return length_meant(in_file("r: " + range).at("r"), margin, 0.5, reach);
  };
  EXPECT_EQ(meant("{above: 40}", -0.99), "") << "twice its size is near";
  EXPECT_EQ(meant("{above: 40}", -1.01), "") << "at 39 m, 40 cm are not";
  EXPECT_EQ(meant("{above: 40}", -39.7), "; did you mean 40 cm?");
  EXPECT_EQ(meant("{above: 40 m}", -39.7), "");
  EXPECT_EQ(meant("{above: 400}", -399.7), "; did you mean 400 mm?");
  EXPECT_EQ(meant("{below: -40}", -39.7), "; did you mean -40 cm?");
  EXPECT_EQ(meant("{above: -9, below: 40}", -30), "") << "it is at 70 m, or at -39: neither is near 40 cm";
  EXPECT_EQ(meant("{above: 40}", -39.7, 38.6), "; did you mean 40 cm?");
  EXPECT_EQ(meant("{above: 40}", -39.7, 38.8), "") << "it may come there";
}

TEST(Doubts, OfWeldedMassesKnowTheirPaths) {
  const Scenario fixed = testing::read(
      "graze: 1\nrobot: {urdf: robots/hopper.urdf, base: fixed}\npolicies: {rest: {hold: {}, "
      "control: {joint_pd: {kp: 10}}}}\n");
  for (const char* idle : {"mass", "density", "com.x", "com.y", "com.z"}) {
    EXPECT_TRUE(is_welded_mass(std::string("robot.link.base.") + idle, fixed.model)) << idle;
    EXPECT_FALSE(is_welded_mass(std::string("robot.link.foot.") + idle, fixed.model)) << idle;
  }
  for (const char* other :
       {"robot.link.base.size.x", "robot.link.none.mass", "base.mass", "robot.joint.base.mass", "robot.link."}) {
    EXPECT_FALSE(is_welded_mass(other, fixed.model)) << other;
  }
}

}  // namespace
}  // namespace graze
