// Claim: a trace's bits depend on the particle alone: not on its lane, its neighbours, what the object simulated
// before, the instruction set or the number of lanes.

#include <gtest/gtest.h>

#include <cstring>

#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

constexpr double kMillisecond = 1e-3;

std::uint64_t fold(std::uint64_t digest, double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, 8);
  return (digest ^ bits) * 0x9e3779b97f4a7c15u ^ digest >> 29;
}

/// Some torques that keep the robot busy.
double torque(int joint, int step) { return 0.4 * std::sin(0.05 * step + joint); }

/// Digest of the state and the contacts of every step.
struct Follower {
  std::uint64_t digest = 0;
  int touching = 0;
  void add(const BlockPhysics& physics, int lane) {
    const BlockState& state = physics.state();
    for (int i = 0; i < state.q.rows(); ++i) digest = fold(digest, state.q(i, lane));
    for (int i = 0; i < state.v.rows(); ++i) digest = fold(digest, state.v(i, lane));
    for (int i = 0; i < state.a.rows(); ++i) digest = fold(digest, state.a(i, lane));
    for (int i = 0; i < state.X.rows(); ++i) digest = fold(digest, state.X(i, lane));
    for (const Contact& contact : physics.contacts(lane)) {
      for (int k = 0; k < 3; ++k) digest = fold(digest, contact.impulse_W[k] + 0.0);
      digest = fold(digest, contact.phi);
      touching += contact.touching();
    }
  }
};

std::uint64_t alone(std::uint32_t id, int lane, int steps, const std::string& model) {
  const Particle particle = busy_particle(id, model);
  LanePhysics physics(particle.model);
  physics.start(lane, particle);
  BlockArray tau(particle.model.na());
  Follower follower;
  LaneMask mask;
  mask.set(lane);
  for (int k = 0; k < steps; ++k) {
    for (int j = 0; j < tau.rows(); ++j) tau(j, lane) = torque(j, k);
    physics.step(kMillisecond, mask, tau);
    follower.add(physics, lane);
  }
  EXPECT_GT(follower.touching, 20) << "the test is of contact";
  EXPECT_FALSE(physics.fault(lane)) << *physics.fault(lane);
  return follower.digest;
}

class Bits : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Models, Bits, testing::ValuesIn(lane_contact_models()));

TEST_P(Bits, DoNotDependOnTheLane) {
  const std::uint64_t first = alone(3, 0, 300, GetParam());
  EXPECT_EQ(first, alone(3, 5, 300, GetParam()));
  EXPECT_NE(first, alone(4, 0, 300, GetParam()));
}

// Eight neighbours that differ, one of which begins late in a lane that was used before, and one that ends early.
TEST_P(Bits, DoNotDependOnNeighboursOrThePast) {
  const int steps = 300;
  const std::uint64_t want = alone(3, 0, steps, GetParam());
  LanePhysics physics(busy_particle(0, GetParam()).model);
  for (int lane = 0; lane < kLanes; ++lane) physics.start(lane, busy_particle(20 + lane, GetParam()));
  BlockArray tau(physics.state().v.rows());
  const int late = 70, lane = 6;
  Follower follower;
  LaneMask mask = LaneMask::all();
  for (int k = 0; k < late + steps; ++k) {
    if (k == late) physics.start(lane, busy_particle(3, GetParam()));
    if (k == late + 100) mask.set(2, false);
    if (k == late + 150) physics.start(1, busy_particle(40, GetParam()));
    for (int j = 0; j < tau.rows(); ++j) {
      for (int l = 0; l < kLanes; ++l) tau(j, l) = torque(j, l == lane ? k - late : 2 * k + l);
    }
    physics.step(kMillisecond, mask, tau);
    if (k >= late) follower.add(physics, lane);
  }
  EXPECT_EQ(follower.digest, want);
}

/// Final coordinates of particle 3, which runs in the last lane.
std::vector<double> run_kernel(Isa isa, int lanes, const std::string& model) {
  const Model nominal = busy_particle(0, model).model;
  BlockArray q(nominal.nq), v(nominal.nv), a(nominal.nv), X(12 * static_cast<int>(nominal.bodies.size()));
  LaneEngine engine(nominal, kernel_of(isa, lanes), {q.row(0), v.row(0), a.row(0), X.row(0)});
  for (int lane = 0; lane < lanes; ++lane) {
    const Particle particle = busy_particle(lane == lanes - 1 ? 3 : 30 + lane, model);
    engine.start(lane, particle.model, particle.initial);
  }
  BlockArray tau(nominal.na());
  for (int k = 0; k < 300; ++k) {
    for (int j = 0; j < nominal.na(); ++j) {
      for (int lane = 0; lane < lanes; ++lane) tau.row(0)[j * lanes + lane] = torque(j, k);
    }
    engine.step(kMillisecond, (1u << lanes) - 1u, tau.row(0));
  }
  std::vector<double> out;
  for (int i = 0; i < nominal.nq; ++i) out.push_back(engine.block().q[i * lanes + lanes - 1]);
  for (int i = 0; i < nominal.nv; ++i) out.push_back(engine.block().v[i * lanes + lanes - 1]);
  return out;
}

TEST_P(Bits, DoNotDependOnTheInstructionSetOrWidth) {
  const std::vector<double> want = run_kernel(Isa::portable, 1, GetParam());
  for (Isa isa : available_isas()) {
    for (int lanes : {1, 4, 8}) {
      if (lanes == 4 && isa != Isa::avx2) continue;
      const std::vector<double> got = run_kernel(isa, lanes, GetParam());
      EXPECT_EQ(std::memcmp(got.data(), want.data(), want.size() * sizeof(double)), 0) << isa_name(isa) << " " << lanes;
    }
  }
}

}  // namespace
}  // namespace graze::test
