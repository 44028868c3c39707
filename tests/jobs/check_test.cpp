// What graze check says of a scenario beyond its parameter table.
#include <gmock/gmock.h>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::HasSubstr;

class Check : public ::testing::Test {
 protected:
  testing::BallCampaign campaign;
};

// Claim: the overview gives the robot's mass, not that of the things in its world.
TEST_F(Check, WeighsTheRobotAlone) {
  const std::string alone = campaign.graze("check ball.yaml").out;
  EXPECT_THAT(alone, HasSubstr("floating base, 1 kg"));
  EXPECT_THAT(campaign
                  .graze("check ball.yaml --set 'environment.anvil={box: [1, 1, 1], position: [9, 0, 0.5], "
                         "movable: true, mass: 50 kg}'")
                  .out,
              HasSubstr("floating base, 1 kg"));
}

}  // namespace
}  // namespace graze
