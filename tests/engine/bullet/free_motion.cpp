// Motion without contact, against closed forms.

#include <gtest/gtest.h>

#include "tests/engine/bullet/worlds.h"

namespace graze::test {
namespace {

class FreeMotion : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Physics, FreeMotion, testing::ValuesIn(physics_names()));

// A thrown body follows the parabola of semi-implicit Euler exactly: p(n) = p0 + v0 t - g t (t + h) / 2.
TEST_P(FreeMotion, ThrownBodyFollowsTheParabola) {
  World world = free_body(box(0.1, 0.2, 0.3), 2.0);
  world.initial.position = {1, 2, 3};
  world.initial.linear_velocity = {0.5, -1, 4};
  Bench run(GetParam(), world);
  const double h = 1e-3, t = 1.0;
  run.run(t, h);
  EXPECT_NEAR(run.position(0).x(), 1.5, 1e-12);
  EXPECT_NEAR(run.position(0).y(), 1.0, 1e-12);
  EXPECT_NEAR(run.position(0).z(), 3 + 4 * t - 0.5 * kGravity * t * (t + h), 1e-10);
  EXPECT_EQ(run.fault(), "");
}

}  // namespace
}  // namespace graze::test
