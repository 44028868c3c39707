// Claims: ground that is drawn from a spectrum is each particle's own, on every back end: it begins above its own
// ground and comes to rest on it, with the same bits alone and in company.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/clearance/terrain_gap.h"
#include "simulation/simulation.h"
#include "tests/jobs/program.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

struct DrawnGround : ::testing::TestWithParam<const char*> {
  /// A tripod on balls is dropped from 5 mm. `ground`: its spectrum's rms and seed.
  Simulation simulation(const std::string& ground) const {
    std::string feet;
    for (const char* place : {"0.1 0 0", "-0.05 0.0866 0", "-0.05 -0.0866 0"}) {
      feet += "<collision><origin xyz='" + std::string(place) +
              "'/><geometry><sphere radius='0.02'/></geometry></collision>";
    }
    testing::write_file(folder / "robot.urdf",
                        "<robot name='r'><link name='r'><inertial><mass value='1'/><inertia ixx='0.005' iyy='0.005' "
                        "izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial>" +
                            feet + "</link></robot>");
    testing::write_file(folder / "ground.yaml", "graze: 1\nname: Ground\nphysics: " + std::string(GetParam()) + R"(
robot: {urdf: robot.urdf, initial: {height: on_ground, clearance: 5 mm}}
environment:
  ground: {heightfield: {size: [1 m, 1 m], spectrum: {longest: 50 cm, shortest: 20 cm, )" +
                                                    ground + R"(}}}
contact: {friction: 1}
time: {end: 1 s}
policies: {none: {hold: {}, control: {torque: {}}}}
)");
    return Simulation(load_scenario(folder / "ground.yaml"));
  }

  /// Gaps of the feet above the particle's ground, the least first; 0 where one is in the other.
  static std::vector<double> gaps(const Particle& particle, const std::vector<double>& q, double up = 0) {
    Pose X_WB = Pose::Identity();
    X_WB.linear() = Quat(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    X_WB.translation() = Vec3(q[4], q[5], q[6] + up);
    const Collider& ground = particle.model.colliders.back();
    const HeightGrid& grid = *ground.shape.grid;
    std::vector<double> out;
    for (const Collider& foot : particle.model.colliders) {
      if (foot.is_object) continue;
      const Convex ball{ShapeKind::sphere, foot.shape.size, X_WB * foot.X_BG, nullptr};
      out.push_back(
          gap_above_terrain(ball, {grid.nx, grid.ny, grid.height.data()}, ground.shape.size, ground.X_BG, 1).gap);
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  testing::TemporaryFolder folder;
};

// It begins 5 mm above the first place that it would touch. After a second it is at rest, all feet on its own ground
// within half a millimetre: slopes are far below the friction of 1.
TEST_P(DrawnGround, CarriesWhatIsDroppedOnIt) {
  const Simulation dropped = simulation("rms: {uniform: [2 mm, 8 mm]}, seed: {uniform: [0, 1]}");
  for (const TraceRecord& trace : Simulator(dropped, "none").run(0, 12)) {
    const Particle particle = dropped.particle(trace.particle);
    const std::vector<double> begin(particle.initial.q.begin(), particle.initial.q.end());
    ASSERT_EQ(trace.outcome, Outcome::success) << trace.invalid_reason;
    EXPECT_GT(gaps(particle, begin, -0.005 + 1e-5).front(), 0) << trace.particle;
    EXPECT_EQ(gaps(particle, begin, -0.005 - 1e-5).front(), 0) << trace.particle;
    for (const double v : trace.v) EXPECT_NEAR(v, 0, 0.01) << trace.particle;
    EXPECT_LT(gaps(particle, trace.q).back(), 5e-4) << trace.particle;
    EXPECT_GT(gaps(particle, trace.q, 5e-4).front(), 0) << trace.particle;
  }
}

TEST_P(DrawnGround, IsEachParticlesOwn) {
  const Simulation drawn = simulation("rms: 8 mm, seed: {uniform: [0, 1]}");
  const Simulation one_for_all = simulation("rms: 8 mm, seed: 0.5");
  const auto ground = [](const Simulation& of, std::uint32_t id) {
    return of.particle(id).model.colliders.back().shape.grid->height;
  };
  EXPECT_NE(ground(drawn, 0), ground(drawn, 1));
  EXPECT_EQ(ground(drawn, 1), ground(drawn, 1));
  EXPECT_EQ(ground(one_for_all, 0), ground(one_for_all, 1));
  EXPECT_EQ(drawn.nominal().colliders.back().shape.grid->height, ground(one_for_all, 0)) << "of the mean seed";
  const auto ends = Simulator(drawn, "none").run(0, 2), same = Simulator(one_for_all, "none").run(0, 2);
  EXPECT_GT(std::abs(ends[0].q[6] - ends[1].q[6]), 1e-4);
  EXPECT_EQ(same[0].q, same[1].q);
}

// Twelve particles in two blocks, each again alone, and the last six in other lanes beside other neighbours.
TEST_P(DrawnGround, GivesTheSameBitsInCompanyAndAlone) {
  const Simulation drawn = simulation("rms: {uniform: [2 mm, 20 mm]}, seed: {uniform: [0, 1]}");
  Simulator simulator(drawn, "none");
  const std::vector<TraceRecord> together = simulator.run(0, 12), later = simulator.run(6, 6);
  for (std::uint32_t id = 0; id < 12; ++id) {
    EXPECT_EQ(testing::bits_of(Simulator(drawn, "none").run(id, 1).front()), testing::bits_of(together[id])) << id;
    if (id >= 6) {
      EXPECT_EQ(testing::bits_of(later[id - 6]), testing::bits_of(together[id])) << id;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Physics, DrawnGround, ::testing::Values("lanes", "bullet"));

}  // namespace
}  // namespace graze
