// Claim: cylinders stand, roll and carry, and capsules lie in a valley of terrain, where geometry says, in every
// contact model and under every solver of the lane engine.

#include <gtest/gtest.h>

#include "tests/engine/lanes/solvers.h"
#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

class CylinderTruth : public testing::TestWithParam<ContactChoice> {
 protected:
  Bench bench(World world) const {
    GetParam().apply_to(world.contact);
    world.contact.friction = 0.5;
    return Bench(std::string("lanes"), world);
  }
  /// What a body may sink: half a millimetre where it stands on one point's spring (lane_engine.cpp).
  double sink() const { return GetParam().model == "compliant" ? 0.5e-3 + 1e-6 : 1e-6; }
};
INSTANTIATE_TEST_SUITE_P(Models, CylinderTruth, testing::ValuesIn(contact_choices()), name_of_choice);

Object table() { return fixed("table", box(4, 1, 0.2), at(0, 0, -0.1)); }

// A cylinder that stands on a plane, a box or another cylinder's cap stays, and so does a box on a cap.
TEST_P(CylinderTruth, StandsAndCarries) {
  const Object ground = fixed("ground", plane()), post = fixed("post", cylinder(0.1, 0.2), at(0, 0, -0.1));
  for (const Object& below : {ground, table(), post}) {
    for (const Shape& shape : {cylinder(0.05, 0.1), box(0.08, 0.08, 0.1)}) {
      World world = free_body(shape, 0.4);
      world.objects.push_back(below);
      world.initial.position = {0, 0, 0.05};
      Bench run = bench(world);
      run.run(1.0, 1e-3);
      EXPECT_LT((run.position(0) - Vec3(0, 0, 0.05)).norm(), sink()) << below.name;
      EXPECT_LT(run.v().norm(), 1e-5) << below.name;
      // Sweeps end at changes of 1e-6 m/s.
      EXPECT_NEAR(run.contact_impulse().z(), 0.4 * kGravity * 1e-3, 0.4e-6) << below.name;
      EXPECT_EQ(run.fault(), "");
    }
  }
}

// A cylinder that lies on a plane or a box rolls on at its speed, without slip and without gaining energy.
TEST_P(CylinderTruth, Rolls) {
  const double r = 0.05, v = 0.4;
  for (const Object& below : {fixed("ground", plane()), table()}) {
    World world = free_body(cylinder(r, 0.1), 0.4);
    world.robot.links[0] = link("body", cylinder(r, 0.1), 0.4, at(0, 0, 0, turn(std::acos(0.0), Vec3::UnitX())));
    world.objects.push_back(below);
    world.initial.position = {0, 0, r};
    world.initial.linear_velocity = {v, 0, 0};
    world.initial.angular_velocity = {0, v / r, 0};
    Bench run = bench(world);
    auto& physics = dynamic_cast<LanePhysics&>(run.physics());
    const double start = physics.energy(0);
    double highest = start;
    run.run(1.0, 1e-3, [&] { highest = std::max(highest, physics.energy(0)); });
    // The spring's lever arm is shorter by what it sinks.
    EXPECT_NEAR(run.v(3), v, 1e-4 + v * sink() / r) << below.name;
    EXPECT_NEAR(run.v(1) * r, run.v(3), 1e-4 + v * sink() / r) << below.name;
    EXPECT_NEAR(run.position(0).x(), v, 1e-3 + v * sink() / r) << below.name;
    EXPECT_NEAR(run.position(0).y(), 0, 1e-6);
    EXPECT_NEAR(run.position(0).z(), r, sink());
    EXPECT_LE(highest, start + 1e-9);
    EXPECT_EQ(run.fault(), "");
  }
}

// In the valley z = 0.2 |x| a capsule lies at r sqrt(1 + 0.2^2) above its bottom, and across it with the centres of its
// end spheres as high above the slopes.
TEST_P(CylinderTruth, CapsuleLiesInAValley) {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = 3;
  grid->ny = 3;
  for (int iy = 0; iy < 3; ++iy) {
    for (double height : {1.0, 0.0, 1.0}) grid->height.push_back(height);
  }
  Shape terrain = box(2, 2, 0.2);
  terrain.kind = ShapeKind::heightfield;
  terrain.grid = grid;
  const double r = 0.05, length = 0.4, above = r * std::hypot(1, 0.2);
  for (bool across : {false, true}) {
    const Vec3 axis = across ? Vec3::UnitY() : Vec3::UnitX();
    World world = free_body(capsule(r, length), 0.5);
    world.robot.links[0] = link("body", capsule(r, length), 0.5, at(0, 0, 0, turn(std::acos(0.0), axis)));
    world.objects.push_back(fixed("terrain", terrain));
    const double z = above + (across ? 0.2 * 0.5 * length : 0);
    world.initial.position = {0, 0.1, z + 0.002};
    Bench run = bench(world);
    run.run(2.0, 1e-3);
    EXPECT_NEAR(run.position(0).z(), z, 1e-4 + sink()) << across;
    EXPECT_NEAR(run.position(0).x(), 0, 1e-3) << across;
    EXPECT_NEAR(run.position(0).y(), 0.1, 1e-3) << across;
    EXPECT_LT(run.v().norm(), 1e-3) << across;
    EXPECT_EQ(run.fault(), "");
  }
}

}  // namespace
}  // namespace graze::test
