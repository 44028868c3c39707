// Claim: each name in the braces of a glob has to match something; which one does not is said, with the one near it.
#include "engine/settings/glob_alternatives.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::vector<std::string> kJoints = {"LF_X_1", "LF_Y_2", "RH_X_1", "RH_Y_2"};

TEST(GlobAlternatives, EachMustMatchSomething) {
  EXPECT_THAT(idle_alternatives("{LF,RH}_X_1", kJoints), IsEmpty());
  EXPECT_THAT(idle_alternatives("*_{X_1,Y_2}", kJoints), IsEmpty());
  EXPECT_THAT(idle_alternatives("LF_*", kJoints), IsEmpty()) << "without braces there is nothing to choose";
  EXPECT_THAT(idle_alternatives("LF_X_1{,_2}", kJoints), ElementsAre("LF_X_1_2")) << "nothing may stand there";
  EXPECT_THAT(idle_alternatives("{LF,RX}_*", kJoints), ElementsAre("RX_*"));
  EXPECT_THAT(idle_alternatives("{LF,RX}_{X_1,Z_3}", kJoints), ElementsAre("RX_{X_1,Z_3}", "{LF,RX}_Z_3"));
}

TEST(GlobAlternatives, NotAllCombinationsNeedBeThere) {
  EXPECT_THAT(idle_alternatives("{LF,RH}_{X_1,Y_2}", {"LF_X_1", "RH_Y_2"}), IsEmpty());
}

TEST(GlobAlternatives, TheFirstIsToldWithItsNearest) {
  EXPECT_EQ(idle_alternative_problem("{LF,RH}_X_1", kJoints, "joint"), "");
  EXPECT_EQ(idle_alternative_problem("{LF,RX}_X_1", kJoints, "joint"),
            "{LF,RX}_X_1: 'RX_X_1' of it matches no joint; did you mean 'RH_X_1'?");
  EXPECT_THAT(idle_alternative_problem("{LF_*,wheel}", kJoints, "joint"), HasSubstr("'wheel' of it matches no joint"));
}

}  // namespace
}  // namespace graze
