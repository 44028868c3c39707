// Claim: the numbers of a proposed scenario are those that the robot's masses and sizes give by hand, in the units of
// each joint; what has no ground, no joints, no legs or nothing that moves gets a scenario that says so; and every one
// of them is read again.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "engine/model/measures.h"
#include "engine/settings/inputs.h"
#include "scenarios/proposal.h"
#include "scenarios/proposal_words.h"
#include "scenarios/scenario.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// A link of `mass` in a cube of 4 cm.
std::string cube_link(const std::string& name, double mass) {
  return fmt::format(
      "<link name='{}'><inertial><mass value='{}'/><inertia ixx='1e-3' iyy='1e-3' izz='1e-3' ixy='0' ixz='0' iyz='0'/>"
      "</inertial><collision><geometry><box size='0.04 0.04 0.04'/></geometry></collision></link>",
      name, mass);
}

std::string joint_of(const std::string& name, const std::string& type, const std::string& parent,
                     const std::string& child, const std::string& place,
                     const std::string& more =
                         "<limit lower='-0.3' upper='0.3' effort='9' "
                         "velocity='9'/>") {
  return fmt::format(
      "<joint name='{}' type='{}'><parent link='{}'/><child link='{}'/><origin xyz='{}'/><axis xyz='0 0 1'/>{}"
      "</joint>",
      name, type, parent, child, place, more);
}

struct Proposed {
  std::string text;
  Settings settings;
  Scenario scenario;
};

Proposed proposed_for(const std::string& links_and_joints, const std::vector<std::string>& wanted_warnings = {}) {
  const InputReplay files({{"/r.urdf", "<robot name='r'>" + links_and_joints + "</robot>"}}, "/");
  ProposalRequest request{"/r.urdf", "/r.yaml"};
  std::vector<std::string> warnings;
  request.warn = [&](const std::string& warning) { warnings.push_back(warning); };
  const std::string text = propose_scenario(request);
  EXPECT_EQ(warnings, wanted_warnings);
  return {text, Settings::parse(text, "/r.yaml"), parse_scenario(text, "/r.yaml")};
}

Settings hold_of(const Proposed& made) { return made.settings.at("policies").at("hold").at("control").at("joint_pd"); }

const std::string kWorld = "<link name='world'/>";

// A lift that turns: the slide carries 1.2 kg with an error of 1 cm; the turn has half of the weight at half of the
// size.
TEST(ProposalNumbers, OfTurningAndSlidingJoints) {
  const Proposed made = proposed_for(kWorld + cube_link("carriage", 1) + cube_link("hand", 0.2) +
                                     joint_of("lift", "prismatic", "world", "carriage", "0 0 0.5") +
                                     joint_of("turn", "revolute", "carriage", "hand", "0.3 0 0"));
  const double slide = rounded(9.81 * 1.2 / 0.01);
  EXPECT_EQ(slide, 1200);
  EXPECT_EQ(hold_of(made).at("kp").at("lift").number(), slide);
  const double damping = rounded(1.4 * std::sqrt(slide * slide * 0.01 / 9.81));
  EXPECT_EQ(hold_of(made).at("kd").at("lift").number(), damping);
  const Scenario& s = made.scenario;
  const double size = robot_extent(s.model, initial_state(*s.world, s.model)).maxCoeff();
  EXPECT_NEAR(size, 0.52, 1e-12) << "its height above the world's origin";
  const double turn = rounded(9.81 * 0.5 * 1.2 * 0.5 * size / 0.05);
  EXPECT_EQ(hold_of(made).at("kp").at("*").number(), turn);
  EXPECT_EQ(hold_of(made).at("kd").at("*").number(), rounded(0.05 * turn));
  const Settings uncertain = made.settings.at("uncertain");
  EXPECT_EQ(uncertain.at("robot.joint.*.damping").number(), rounded(0.05 * rounded(0.05 * turn)));
  EXPECT_EQ(uncertain.at("robot.joint.lift.damping").number(), rounded(0.05 * damping));
  EXPECT_EQ(uncertain.at("robot.joint.lift.zero").at("normal").at("std").text(), "1 mm");
  EXPECT_EQ(uncertain.at("robot.joint.turn.zero").at("normal").at("std").text(), "0.01 rad");
  EXPECT_FALSE(uncertain.has("initial.base.{roll,pitch}")) << "it is fixed to the world";
  EXPECT_THAT(made.text, AllOf(HasSubstr("'lift': 0  # -0.3 … 0.3 m\n"), HasSubstr("'turn': 0  # -0.3 … 0.3 rad\n"),
                               HasSubstr("# N m/rad; N/m of those that slide"), Not(HasSubstr("height: on_ground"))));
  EXPECT_EQ(made.settings.at("robot").at("initial").at("position").numbers(3), (std::vector<double>{0, 0, 0}));
}

/// A root of 2 kg and three links in a row on it, each at a place from the one before.
std::string three_in_a_row(const std::string& root, const std::string& place) {
  std::string out = cube_link(root, 2), before = root;
  for (const char* link : {"one", "two", "three"}) {
    out += cube_link(link, 0.5) + joint_of(std::string("to ") + link, "revolute", before, link, place);
    before = link;
  }
  return out;
}

// An arm is bolted down, whatever its URDF leaves out; a leg is not, nor is what carries anything else.
TEST(ProposalNumbers, ArmsAreBolted) {
  const Proposed arm = proposed_for(three_in_a_row("link_0", "0 0 0.3"));
  EXPECT_FALSE(arm.scenario.model.floating_base);
  EXPECT_EQ(arm.settings.at("robot").at("base").text(), "fixed");
  EXPECT_THAT(arm.text, AllOf(HasSubstr("# a guess: 3 joints in a row on link_0 are an arm; floating: it is free\n"),
                              Not(HasSubstr("it is dropped"))));
  EXPECT_FALSE(proposed_for(three_in_a_row("arm_base", "0.3 0 0")).scenario.model.floating_base) << "by its name";
  const std::string fourth = cube_link("four", 0.5) + joint_of("to four", "revolute", "link_0", "four", "0 0.3 0");
  for (const std::string& free : {three_in_a_row("base", "0 0 -0.3"), three_in_a_row("snake", "0.3 0 0"),
                                  three_in_a_row("link_0", "0 0 0.3") + fourth}) {
    const Proposed made = proposed_for(free);
    EXPECT_TRUE(made.scenario.model.floating_base) << free;
    EXPECT_FALSE(made.settings.at("robot").has("base"));
  }
}

// Where all joints slide nothing is said of such as turn, and a light one is damped no more than steps of 1 ms bear.
TEST(ProposalNumbers, OfSlidingJointsAlone) {
  const Proposed made = proposed_for(kWorld + cube_link("a", 3) + cube_link("b", 1e-4) +
                                     joint_of("first", "prismatic", "world", "a", "0 0 1") +
                                     joint_of("second", "prismatic", "world", "b", "1 0 1"));
  EXPECT_FALSE(hold_of(made).at("kp").has("*"));
  EXPECT_EQ(hold_of(made).at("kp").at("first").number(), rounded(9.81 * 3 / 0.01));
  EXPECT_EQ(hold_of(made).at("kp").at("second").number(), 0.1) << "no less";
  EXPECT_EQ(hold_of(made).at("kd").at("second").number(), rounded(1.4 * std::sqrt(0.1 * 0.1 * 0.01 / 9.81)));
  EXPECT_THAT(made.text, AllOf(HasSubstr("  # N/m\n"), HasSubstr("  # N s/m\n"), Not(HasSubstr("N m/rad"))));
  EXPECT_EQ(made.settings.at("uncertain").at("robot.joint.*.zero").at("normal").at("std").text(), "1 mm");
  EXPECT_FALSE(made.settings.at("uncertain").has("robot.joint.*.damping"));
}

// A leg that slides carries the whole robot, and is damped no more than its own mass bears in steps of 1 ms.
TEST(ProposalNumbers, OfLegsThatSlide) {
  std::string robot = cube_link("body", 8);
  for (const auto& [leg, place] : {std::pair{"left", "0 0.3 -0.5"}, {"right", "0 -0.3 -0.5"}}) {
    robot += cube_link(leg, 0.1) + joint_of(std::string("to ") + leg, "prismatic", "body", leg, place);
  }
  const Proposed made = proposed_for(robot);
  for (const char* joint : {"to left", "to right"}) {
    EXPECT_EQ(hold_of(made).at("kp").at(joint).number(), rounded(9.81 * 8.2 / 0.01));
    EXPECT_EQ(hold_of(made).at("kd").at(joint).number(), 50) << "0.1 kg in 2 ms";
  }
}

// A joint carries what follows it, times the ratio in which that moves; followers are told and not driven.
TEST(ProposalNumbers, OfFollowers) {
  const Proposed made = proposed_for(
      kWorld + cube_link("left", 0.5) + cube_link("right", 0.3) + cube_link("tip", 0.1) +
      joint_of("grip", "prismatic", "world", "left", "0 0 1") +
      joint_of(
          "follow", "prismatic", "world", "right", "0.5 0 1",
          "<limit lower='-1' upper='1' effort='9' velocity='9'/><mimic joint='grip' multiplier='-2' offset='0.1'/>") +
      joint_of("weld", "fixed", "right", "tip", "0 0 0.1"));
  EXPECT_EQ(hold_of(made).at("kp").at("grip").number(), rounded(9.81 * (0.5 + 2 * 0.4) / 0.01));
  EXPECT_THAT(made.text, HasSubstr("      # 'follow' follows 'grip' (<mimic>): -2 times its position + 0.1\n"));
  EXPECT_FALSE(hold_of(made).at("kp").has("follow"));
  EXPECT_TRUE(made.settings.at("uncertain").has("robot.joint.follow.damping")) << "a damper it may have";
}

// Dampers of the file stay; one or several are told.
TEST(ProposalNumbers, OfDampersOfTheFile) {
  const auto with = [](const char* first, const char* second) {
    const std::string limit = "<limit lower='-1' upper='1' effort='9' velocity='9'/>";
    return proposed_for(kWorld + cube_link("a", 1) + cube_link("b", 1) +
                        joint_of("j1", "revolute", "world", "a", "0 0 1", limit + first) +
                        joint_of("j2", "revolute", "a", "b", "0.1 0 0", limit + second))
        .text;
  };
  EXPECT_THAT(with("<dynamics damping='1'/>", "<dynamics damping='2'/>"),
              AllOf(HasSubstr("  # Dampers of the URDF stay.\n"), Not(HasSubstr(".damping"))));
  EXPECT_THAT(with("", "<dynamics damping='2'/>"),
              AllOf(HasSubstr("  # The damper of the URDF stays.\n  'robot.joint.j1.damping': "),
                    Not(HasSubstr("j2.damping"))));
  EXPECT_THAT(with("", ""), HasSubstr("  robot.joint.*.damping: "));
}

// A robot that is fixed to the world stands beside a ground only if it begins above it.
TEST(ProposalNumbers, OfGrounds) {
  const auto arm = [](double height, const char* limit) {
    return proposed_for(
               kWorld + cube_link("upper", 1) + cube_link("hand", 1) +
               fmt::format("<joint name='j' type='revolute'><parent link='world'/><child link='upper'/><origin "
                           "xyz='0 0 {}'/><axis xyz='0 1 0'/>{}</joint>",
                           height, limit) +
               joint_of("weld", "fixed", "upper", "hand", "1 0 0"))
        .text;
  };
  const char* quarter = "<limit lower='-1.5707963' upper='1.5707963' effort='9' velocity='9'/>";
  const char* little = "<limit lower='-0.1' upper='0.1' effort='9' velocity='9'/>";
  EXPECT_THAT(arm(0.5, quarter), HasSubstr("\n  ground: {plane: z}  # its joints can take it 0.52 m below\n"));
  EXPECT_THAT(arm(1.5, quarter), HasSubstr("\n  ground: {plane: z}\n"));
  EXPECT_THAT(arm(0.2, little), HasSubstr("\n  ground: {plane: z}\n"));
  EXPECT_THAT(arm(0.015, little), HasSubstr("its joints can take it 0.11 m below"))
      << "and begins within a plate's slack";
  const std::string below = arm(-0.5, quarter);
  EXPECT_THAT(below,
              AllOf(HasSubstr("# No ground: the robot is fixed to the world and begins with parts 0.52 m below z = 0."),
                    HasSubstr("# environment: {ground: {plane: z, position: [0, 0, -1.7 m]}}\n"),
                    Not(HasSubstr("\n  ground:")), Not(HasSubstr("contact.friction"))));
}

// Nothing moves; nothing is driven.
TEST(ProposalNumbers, OfWhatHasNoJoints) {
  const Proposed still =
      proposed_for(kWorld + cube_link("block", 1) + joint_of("weld", "fixed", "world", "block", "0 0 1"));
  EXPECT_THAT(still.text, AllOf(HasSubstr("# Nothing of the robot moves: there is nothing uncertain"),
                                HasSubstr("there is no driven joint")));
  EXPECT_FALSE(still.settings.has("task"));
  EXPECT_FALSE(still.settings.has("uncertain"));
  EXPECT_FALSE(still.settings.at("robot").has("initial"));
  const Proposed ball = proposed_for(cube_link("ball", 1));
  EXPECT_THAT(ball.text, AllOf(HasSubstr("# r: 1 kg, 1 link, 0 driven joints, 0.04 m high as it begins.\n"),
                               HasSubstr("rests: {speed: {link: \"*\", below: 2 cm/s}}")));
  EXPECT_EQ(ball.settings.at("uncertain").at("initial.base.{roll,pitch}").at("normal").at("std").text(), "2 deg");
  EXPECT_TRUE(ball.settings.at("uncertain").has("contact.friction"));
  EXPECT_FALSE(ball.settings.at("uncertain").has("robot.joint.*.zero"));
}

// Two legs of a floating body share its weight; it is to stay upright and above half of its height.
TEST(ProposalNumbers, OfLegs) {
  const auto legged = [](int legs) {
    std::string out = cube_link("body", 4);
    for (int i = 0; i < legs; ++i) {
      const std::string leg = fmt::format("leg{}", i),
                        place = fmt::format("{} {} -0.5", 0.3 * std::cos(i), 0.3 * std::sin(i));
      out += cube_link(leg, 1) + joint_of("hip" + std::to_string(i), "revolute", "body", leg, place);
    }
    return out;
  };
  const double height = 0.54;  // from the body's top to the feet's soles
  for (const int legs : {2, 3}) {
    const Proposed made = proposed_for(legged(legs));
    const double gain = rounded(9.81 * (4 + legs) * 0.5 * height / 0.05 / legs);
    EXPECT_EQ(hold_of(made).at("kp").number(), gain) << legs;
    EXPECT_EQ(hold_of(made).at("kd").number(), rounded(0.05 * gain));
    EXPECT_EQ(made.settings.at("uncertain").at("robot.joint.*.damping").number(), rounded(0.05 * rounded(0.05 * gain)));
    EXPECT_EQ(made.settings.at("task").at("requirements").at("upright").at("tilt").at("link").text(), "body");
    // The origin is 52 cm above the soles, and those 2 cm above the ground.
    EXPECT_THAT(made.text, HasSubstr("z: {above: 0.27 m}"));
  }
  EXPECT_THAT(proposed_for(legged(5), {"/r.yaml: no trot: it stands on 5 limbs, and a trot is for four"}).text,
              HasSubstr("  # No trot: it stands on 5 limbs, and a trot is for four\n"));
  EXPECT_THAT(
      proposed_for(legged(4), {"/r.yaml: no trot: between the base and 'leg0' are 1 joints that a gait can move, and a "
                               "trot needs 3 in each leg"})
          .text,
      Not(HasSubstr("  trot:")));
  const HoldGains gains = [&] {
    const InputReplay files({{"/r.urdf", "<robot name='r'>" + legged(2) + "</robot>"}}, "/");
    return propose_hold({"/r.urdf", "/r.yaml"});
  }();
  EXPECT_EQ(gains.stiffness, rounded(9.81 * 6 * 0.5 * height / 0.05 / 2));
}

// Links that are in each other pass through each other in the proposal, which says by how much.
TEST(ProposalNumbers, OfOverlaps) {
  const Proposed made = proposed_for(cube_link("a", 1) + cube_link("b", 1) + cube_link("c c", 1) +
                                     joint_of("ab", "revolute", "a", "b", "0.1 0 0") +
                                     joint_of("bc", "revolute", "b", "c c", "-0.07 0 0"));
  EXPECT_THAT(made.text, HasSubstr("  ignore:\n    - ['a', 'c c']  # by 10 mm\n"));
  EXPECT_TRUE(
      made.scenario.model.pairs.empty() ||
      std::none_of(made.scenario.model.pairs.begin(), made.scenario.model.pairs.end(), [&](const ColliderPair& pair) {
        return made.scenario.model.colliders[pair.a].name == "a" && made.scenario.model.colliders[pair.b].name == "c c";
      }));
}

}  // namespace
}  // namespace graze
