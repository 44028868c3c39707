// Claim: no component silently takes the place of another: of two of one name the first stays, and a program with
// assertions stops at the second.
#include "scenarios/registered.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace graze {
namespace {

struct Toy {
  std::string name;
  int price;
};

const Registration<Toy> doll(Toy{"doll", 3}), ball(Toy{"ball", 1});

TEST(Registered, StandBehindTheBuiltInOnesByName) {
  EXPECT_THAT(names_of(with_registered<Toy>({{"train", 9}})), ::testing::ElementsAre("train", "ball", "doll"));
  EXPECT_THAT(registered_names<Toy>(), ::testing::ElementsAre("ball", "doll"));
}

TEST(RegisteredDeathTest, TwoOfOneNameAreAMistake) {
  EXPECT_DEBUG_DEATH(Registration<Toy>(Toy{"doll", 7}), "two components of one name");
  EXPECT_EQ(registry<Toy>().at("doll").price, 3);
}

TEST(RegisteredDeathTest, ABuiltInNameIsTaken) {
  EXPECT_DEBUG_DEATH(with_registered<Toy>({{"ball", 2}}), "a component of a built-in one's name");
}

}  // namespace
}  // namespace graze
