// A trace depends on its particle alone: not on the lane, its neighbours, earlier traces, threads or the block object.

#include <gtest/gtest.h>

#include <cstring>
#include <thread>

#include "tests/engine/bullet/worlds.h"

namespace graze::test {
namespace {

class Determinism : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Physics, Determinism, testing::ValuesIn(physics_names()));

/// A jointed robot that falls on a plane beside a curb and a loose box, thrown with a spin of its own.
Particle faller(double spin, const std::string& contact) {
  World world;
  world.robot.links = {link("body", box(0.2, 0.1, 0.05), 1), link("thigh", cylinder(0.02, 0.1), 0.2, at(0, 0, -0.05)),
                       link("shin", capsule(0.015, 0.1), 0.1, at(0, 0, -0.05)),
                       link("foot", sphere(0.0085), 0.02, at(0, 0, -0.12))};
  world.robot.joints = {joint("hip", "body", "thigh", JointType::revolute, at(0.1, 0, 0), Vec3::UnitY()),
                        joint("knee", "thigh", "shin", JointType::revolute, at(0, 0, -0.1), Vec3::UnitY()),
                        joint("ankle", "shin", "foot", JointType::fixed, at(0, 0, 0), Vec3::UnitX())};
  world.robot.joints[0].friction = 0.01;
  world.robot.joints[1].damping = 0.02;
  world.robot.joints[1].lower = -1;
  world.robot.joints[1].upper = 1;
  world.objects = {fixed("ground", plane()), fixed("curb", box(1, 0.01, 0.04), at(0, 0.1, 0.02)),
                   movable("crate", box(0.1, 0.1, 0.1), 0.3, at(0.15, 0, 0.05))};
  world.contact.model = contact;
  world.contact.friction = 0.7;
  world.initial.position = {0, 0, 0.3};
  world.initial.angular_velocity = {spin, 1, -1};
  return particle_of(world);
}

/// Everything that a lane shows after each step, as bits.
using Trace = std::vector<double>;

void record(const BlockPhysics& physics, int lane, Trace& trace) {
  for (const BlockArray* array : {&physics.state().q, &physics.state().v, &physics.state().a, &physics.state().X}) {
    for (int i = 0; i < array->rows(); ++i) trace.push_back((*array)(i, lane));
  }
  for (const Contact& c : physics.contacts(lane)) {
    for (double x : {double(c.a), double(c.b), c.p_W.x(), c.p_W.y(), c.p_W.z(), c.phi, c.impulse_W.x(), c.impulse_W.y(),
                     c.impulse_W.z(), double(c.mode == ContactMode::slip)}) {
      trace.push_back(x);
    }
  }
}

bool same(const Trace& a, const Trace& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

/// Runs `particle` in `lane` of `physics` while the other lanes run `others` of other particles.
Trace trace_of(BlockPhysics& physics, int lane, const Particle& particle, int others) {
  LaneMask mask;
  std::vector<Particle> crowd;
  for (int i = 0; i < others; ++i) crowd.push_back(faller(0.3 * i - 1, particle.model.contact_model));
  for (int i = 0; i < others; ++i) {
    const int other = (lane + 1 + i) % kLanes;
    physics.start(other, crowd[i]);
    mask.set(other);
  }
  physics.start(lane, particle);
  mask.set(lane);
  BlockArray tau(particle.model.na());
  Trace trace;
  for (int k = 0; k < 400; ++k) {
    for (int other = 0; other < kLanes; ++other) tau(0, other) = 0.1 * std::sin(0.05 * k);
    physics.step(1e-3, mask, tau);
    record(physics, lane, trace);
  }
  EXPECT_FALSE(physics.fault(lane)) << *physics.fault(lane);
  EXPECT_FALSE(physics.contacts(lane).empty());
  return trace;
}

TEST_P(Determinism, TraceDependsOnTheParticleAlone) {
  for (const std::string& contact : contact_models_of(GetParam())) {
    const Particle particle = faller(2, contact);
    const auto fresh = [&] { return make_physics(GetParam(), particle.model); };
    const auto first = fresh();
    const Trace reference = trace_of(*first, 0, particle, 0);
    EXPECT_TRUE(same(trace_of(*first, 0, particle, 0), reference)) << "again in the same lane";
    EXPECT_TRUE(same(trace_of(*first, 5, particle, 7), reference)) << "in another lane, in a crowd, with history";
    EXPECT_TRUE(same(trace_of(*fresh(), 3, particle, 2), reference)) << "in another block";
    // The reference can tell particles apart at all.
    EXPECT_FALSE(same(trace_of(*fresh(), 0, faller(2 + 1e-12, contact), 0), reference));
  }
}

TEST_P(Determinism, ThreadsDoNotDisturbEachOther) {
  for (const std::string& contact : contact_models_of(GetParam())) {
    const Particle particle = faller(2, contact), other = faller(-1, contact);
    const Trace reference = trace_of(*make_physics(GetParam(), particle.model), 0, particle, 0);
    Trace traces[2];
    std::thread threads[2];
    for (int i = 0; i < 2; ++i) {
      threads[i] = std::thread([&, i] {
        const auto physics = make_physics(GetParam(), particle.model);
        if (i == 1) trace_of(*physics, 0, other, 1);
        traces[i] = trace_of(*physics, i, particle, 1);
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(same(traces[0], reference));
    EXPECT_TRUE(same(traces[1], reference));
  }
}

// A lane that is not active keeps its bits while its neighbours move.
TEST_P(Determinism, InactiveLanesStandStill) {
  const Particle particle = faller(1, contact_models_of(GetParam()).front());
  const auto physics = make_physics(GetParam(), particle.model);
  physics->start(0, particle);
  physics->start(1, particle);
  Trace before, after;
  record(*physics, 1, before);
  const BlockArray tau(particle.model.na());
  for (int k = 0; k < 10; ++k) physics->step(1e-3, LaneMask::first(1), tau);
  record(*physics, 1, after);
  EXPECT_TRUE(same(before, after));
  EXPECT_NE(physics->state().q(6, 0), physics->state().q(6, 1));
}

}  // namespace
}  // namespace graze::test
