// Claim: the joints of a proposed scenario are held as stiffly as the robot's own weight and size ask for.
#include "scenarios/proposal.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scenarios/support.h"

namespace graze {
namespace {

/// N m/rad: weight times half the height within 0.05 rad, on each foot.
double expected(double mass, double height, int feet) { return 9.81 * mass * 0.5 * height / 0.05 / feet; }

TEST(Proposal, HoldsARobotByItsWeight) {
  const std::string robots = std::string(GRAZE_SOURCE_DIR) + "/data/robots/", file = robots + "new.yaml";
  const HoldGains light = propose_hold({robots + "links.urdf", file});
  const HoldGains heavy = propose_hold({robots + "links_published.urdf", file});
  EXPECT_NEAR(heavy.stiffness / light.stiffness, 3.8 / 1.438, 0.3);  // kg, as docs/robots.md has them
  EXPECT_GT(light.stiffness, expected(1.438, 0.1, 4));
  EXPECT_LT(light.stiffness, expected(1.438, 0.4, 4));
  for (const HoldGains& gains : {light, heavy})
    EXPECT_NEAR(gains.damping, 0.05 * gains.stiffness, 0.06 * gains.damping);
  const std::string text = propose_scenario({robots + "links.urdf", file});
  EXPECT_THAT(text,
              ::testing::HasSubstr(fmt::format("joint_pd: {{kp: {:g}, kd: {:g}}}", light.stiffness, light.damping)));
}

}  // namespace
}  // namespace graze
