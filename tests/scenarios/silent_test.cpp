// Claim: what a scenario says and nothing comes of is told.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "engine/model/newton_limit.h"
#include "tests/scenarios/support.h"
#include "tests/temporary_folder.h"

namespace graze {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// The hopper with so many balls beside it, of six degrees of freedom each.
std::vector<std::string> warnings_with(int balls, const std::string& contact) {
  std::string objects = "  ground: {plane: z}\n";
  for (int i = 0; i < balls; ++i) {
    objects += fmt::format("  ball{0}: {{sphere: 5 cm, density: 500, movable: true, position: [1, {0}, 1]}}\n", i);
  }
  return testing::read("graze: 1\nrobot: {urdf: robots/hopper.urdf, initial: {height: on_ground}}\nenvironment:\n" +
                       objects + "contact: " + contact +
                       "\ntime: {end: 1 s, step: 1 ms}\npolicies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}\n"
                       "task: {objective: {rests: {speed: {link: \"*\", below: 1 m/s}}}}\n")
      .warnings;
}

TEST(Silent, NewtonsMethodForTooManyDegreesOfFreedom) {
  constexpr int kFits = static_cast<int>(kMostNewtonDofs) / 6 - 2, kTooMany = kFits + 2;
  EXPECT_THAT(warnings_with(kFits, "{solver: newton}"), IsEmpty());
  EXPECT_THAT(
      warnings_with(kTooMany, "{solver: newton}"),
      ElementsAre(HasSubstr("contact.solver: newton is for models of up to 160 degrees of freedom, and this one "
                            "has 16")));
  for (const char* other : {"{solver: auto}", "{solver: sweeps}", "{friction: 1}"}) {
    EXPECT_THAT(warnings_with(kTooMany, other), IsEmpty()) << other;
  }
}

// Its long limb is solved without a matrix.
TEST(Silent, NewtonsMethodForALongChain) {
  std::string urdf = "<robot name='chain'>\n<link name='l0'/>\n";
  for (int i = 1; i <= 170; ++i) {
    urdf += fmt::format(
        R"(<link name='l{0}'><inertial><mass value='0.1'/>
  <inertia ixx='1e-4' iyy='1e-4' izz='1e-4' ixy='0' ixz='0' iyz='0'/></inertial></link>
<joint name='j{0}' type='continuous'><parent link='l{1}'/><child link='l{0}'/>
  <origin xyz='0.1 0 0'/><axis xyz='0 1 0'/></joint>
)",
        i, i - 1);
  }
  const testing::TemporaryFolder folder;
  testing::write_file(folder / "chain.urdf", urdf + "</robot>\n");
  const auto scenario = testing::read("graze: 1\nrobot: {urdf: " + (folder / "chain.urdf").string() + R"(, base: fixed}
contact: {solver: newton}
time: {end: 1 s, step: 1 ms}
policies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}
task: {objective: {rests: {speed: {link: "*", below: 1 m/s}}}}
)");
  EXPECT_THAT(scenario.warnings, Each(Not(HasSubstr("contact.solver"))));
}

TEST(Silent, AKeyThatIsTakenOutAndIsNotThere) {
  const auto warned = [](const std::string& path) {
    ScenarioOptions options;
    options.overrides = {{path, "~"}};
    return load_scenario(std::string(GRAZE_SOURCE_DIR) + "/data/scenarios/quadruped_walk.yaml", options).warnings;
  };
  const auto none = warned("uncertain");
  EXPECT_THAT(none, Each(Not(HasSubstr("nothing happens"))));
  EXPECT_THAT(warned("WRONG"), Contains("--set WRONG=~: there is no 'WRONG' to be taken out, so nothing happens"));
  EXPECT_THAT(warned("tim.end"),
              Contains("--set tim.end=~: there is no 'tim.end' to be taken out, so nothing happens; nearest: 'time'"));
}

TEST(Silent, ParametersThatAFollowerDoesNotHave) {
  constexpr const char* kFingers = R"(graze: 1
robot: {urdf: robots/fingers.urdf, base: fixed}
time: {end: 1 s, step: 1 ms}
policies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}
uncertain: {)";
  for (const char* path : {"robot.joint.right.zero", "initial.joint.right.position"}) {
    const std::string others = std::string(path).replace(std::string(path).find("right"), 5, "left");
    EXPECT_THAT(
        testing::message_of([&] { testing::read(kFingers + std::string(path) + ": 0.1}"); }),
        HasSubstr(fmt::format("{}: 'right' follows 'left' (<mimic> of the URDF) and has no drive, encoder or place "
                              "of its own; there is '{}'",
                              path, others)));
  }
  EXPECT_EQ(testing::message_of([&] { testing::read(std::string(kFingers) + "robot.joint.right.damping: 0.1}"); }),
            "(accepted)");
}

}  // namespace
}  // namespace graze
