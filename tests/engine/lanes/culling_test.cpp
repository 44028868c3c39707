// Claim: bounds of distances pass over pairs that have no contact and no others: every bit is the same with and without
// those along the faces of boxes and the axes of round shapes, by which fewer pairs are measured.

#include <gtest/gtest.h>

#include <cstring>

#include "tests/engine/lanes/worlds.h"
#include "tests/sanitized.h"

namespace graze::test {
namespace {

constexpr double kCullingStep = 1e-3;

/// Boxes, cylinders and capsules, long and thin, that fall into a corner of two walls.
World heap_of_sticks() {
  World world = free_body(box(0.3, 0.02, 0.03), 0.2);
  world.objects.push_back(fixed("ground", plane()));
  world.objects.push_back(fixed("wall", box(0.02, 1, 0.4), at(-0.16, 0, 0.2)));
  world.objects.push_back(fixed("post", cylinder(0.03, 0.6), at(0.05, 0.12, 0.3)));
  const Shape shapes[] = {box(0.25, 0.03, 0.02), cylinder(0.015, 0.3), capsule(0.015, 0.2),
                          box(0.02, 0.02, 0.3),  cylinder(0.06, 0.01), capsule(0.02, 0.1)};
  double height = 0.1;
  for (const Shape& shape : shapes) {
    const std::string name = "stick" + std::to_string(world.objects.size());
    const Mat3 R = turn(7 * height, Vec3(1, height, -0.4));
    world.objects.push_back(movable(name, shape, 0.1, at(0.02 * std::sin(40 * height), 0.02, height, R)));
    height += 0.09;
  }
  world.initial.position = Vec3(0, 0, 0.05);
  return world;
}

/// An engine with its numbers.
struct Heap {
  Model nominal = particle_of(heap_of_sticks()).model;
  BlockArray q{nominal.nq}, v{nominal.nv}, a{nominal.nv}, X{12 * static_cast<int>(nominal.bodies.size())},
      tau{nominal.na()};
  LaneEngine engine{nominal, kernel_of(chosen_isa(), kLanes), {q.row(0), v.row(0), a.row(0), X.row(0)}};
  long near = 0;

  explicit Heap(bool flat) {
    PairView* pairs = const_cast<PairView*>(engine.block().pairs);
    for (int i = 0; i < engine.block().pair_count && !flat; ++i) pairs[i].flat = false;
    for (int lane = 0; lane < kLanes; ++lane) {
      Particle of_lane = particle_of(heap_of_sticks());
      for (int i = 0; i < nominal.nv; ++i) of_lane.initial.v[i] = 0.5 * (uniform(3, lane, 1, i) - 0.5);
      engine.start(lane, of_lane.model, of_lane.initial);
    }
  }
  void step() {
    engine.step(kCullingStep, (1u << kLanes) - 1u, tau.row(0));
    near += engine.block().near_count;
  }
};

TEST(Culling, PassesOverWhatDoesNotTouch) {
  Heap with(true), without(false);
  const std::size_t size = static_cast<std::size_t>(with.nominal.nv * kLanes) * sizeof(double);
  for (int k = 0; k < (GRAZE_SANITIZED ? 150 : 800); ++k) {
    with.step(), without.step();
    ASSERT_EQ(with.engine.block().contact_count, without.engine.block().contact_count) << k;
    ASSERT_EQ(std::memcmp(with.v.row(0), without.v.row(0), size), 0) << "step " << k;
  }
  EXPECT_GT(with.near, 0);
  EXPECT_LT(with.near, 0.9 * static_cast<double>(without.near));
}

}  // namespace
}  // namespace graze::test
