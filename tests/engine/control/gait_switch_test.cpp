// Policy gait_switch: to the bit the first gait before the moment, and from then on the second one as if it began
// there.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "engine/settings/warnings.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

using ::testing::HasSubstr;

constexpr const char* kWalk =
    "{velocity: [0.1, 0, 0], duration: 0.3, liftoff: '[25, 75, 0, 50] %', duty: 75 %, step_height: 3 cm}";
constexpr const char* kTrot =
    "{velocity: [0.3, 0, 0.2], duration: 0.3, liftoff: '[25, 75, 75, 25] %', duty: 60 %, step_height: 2 cm}";

struct GaitSwitchTest : ::testing::Test, SensedAtRest {
  Controller make(const std::string& policy, double end = 2) {
    ControlContext context = scene.context();
    context.end = end;
    const std::string yaml = "{" + policy + ", control: {operational_pd: {kp: 1000, kd: 20}}}";
    return Controller(context, Settings::parse(yaml, "test.yaml"));
  }
  static std::string gait_switch(const std::string& to, const std::string& at = "0.15") {
    return fmt::format("gait_switch: {{at: {}, from: {}, to: {}}}", at, kWalk, to);
  }
  /// Targets of a lane at step k of 1 ms; the joints sway, so that what is sensed matters.
  Eigen::VectorXd targets(Controller& controller, int k, int lane = 0) {
    observation.time[lane] = 0.001 * k;
    observation.joint_position(1, lane) = 0.8 + 0.05 * std::sin(0.1 * k);
    controller.act(observation, nullptr, LaneMask(1u << lane), command);
    const Targets& all = controller.targets();
    Eigen::VectorXd out(all.x.rows() + all.xd.rows());
    out << all.x.column(lane, 0, all.x.rows()), all.xd.column(lane, 0, all.xd.rows());
    return out;
  }
};

TEST_F(GaitSwitchTest, IsOneGaitAndThenTheOther) {
  Controller both = make(gait_switch(kTrot)), walk = make(std::string("gait: ") + kWalk),
             trot = make(std::string("gait: ") + kTrot);
  for (int trial = 0; trial < 2; ++trial) {  // a lane that starts anew walks again
    both.start(0, 0, 0);
    walk.start(0, 0, 0);
    trot.start(0, 0, 0);
    for (int k = 0; k < 150; ++k) ASSERT_EQ(targets(both, k), targets(walk, k)) << k;
    for (int k = 150; k < 400; ++k) ASSERT_EQ(targets(both, k), targets(trot, k)) << k;
    EXPECT_NE(targets(both, 400), targets(walk, 400));
  }
}

// Lanes switch one by one, and one that is carried over to another controller goes on as it would have.
TEST_F(GaitSwitchTest, CarriesALane) {
  for (const int when : {100, 200}) {
    Controller one = make(gait_switch(kTrot)), other = make(gait_switch(kTrot));
    one.start(0, 0, 0);
    one.start(3, 0, 0);
    for (int k = 0; k < when; ++k) targets(one, k);
    targets(one, 0, 3);
    LaneTape out;
    one.carry(0, out);
    const LaneTape::Content written = out.take();
    LaneTape in(written);
    other.start(0, 0, 0);
    other.carry(0, in);
    for (int k = when; k < 300; ++k) ASSERT_EQ(targets(one, k), targets(other, k)) << k;
  }
}

TEST_F(GaitSwitchTest, RefusesAndWarns) {
  const auto told = [&](const std::string& policy) { return input_error([&] { make(policy); }); };
  EXPECT_THAT(told(fmt::format("gait_switch: {{at: 1, from: {}}}", kWalk)), HasSubstr("'to'"));
  EXPECT_THAT(told(gait_switch("{velocity: [0, 0, 0], duration: -1, liftoff: 0, duty: 75 %, step_height: 0}")),
              HasSubstr("gait_switch.to.duration"));
  EXPECT_THAT(told(gait_switch("{velocity: [0, 0, 0], duration: 1, liftoff: 0, duty: 75 %, step_height: 0, "
                               "feet: [LF_FOOT, RF_FOOT]}")),
              HasSubstr("the same feet"));
  const Warnings warnings;
  make(gait_switch(kTrot, "5 s"));
  ASSERT_EQ(warnings.texts().size(), 1u);
  EXPECT_THAT(warnings.texts()[0], HasSubstr("5 s: the other gait never begins: no trace is longer than 2 s"));
}

}  // namespace
}  // namespace graze
