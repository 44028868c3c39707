// Claim: terrain that differs from particle to particle is what docs/scenario.md says: a flat box a tenth of a
// millimetre above the ground is a patch of another friction, and a plane's rotation is a slope.
#include <gtest/gtest.h>

#include <cmath>

#include "simulation/simulation.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

constexpr double kGravity = 9.81;

struct UncertainTerrain : ::testing::TestWithParam<const char*> {
  Simulation simulation(const std::string& shape, const std::string& rest) const {
    testing::write_file(folder / "robot.urdf",
                        "<robot name='r'><link name='r'><inertial><mass value='1'/><inertia ixx='0.004' iyy='0.004' "
                        "izz='0.004' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry>" +
                            shape + "</geometry></collision></link></robot>");
    testing::write_file(folder / "terrain.yaml", "graze: 1\nname: Terrain\nphysics: " + std::string(GetParam()) +
                                                     "\npolicies: {none: {hold: {}, control: {torque: {}}}}\n" + rest);
    return Simulation(load_scenario(folder / "terrain.yaml"));
  }
  testing::TemporaryFolder folder;
};

// A block slides on the patch, whose friction is 0.05 to 0.3, and not on the ground, whose friction is 1: v = v0 - mu g
// t. It comes down by 0.1 mm first and steps are 1 ms long: 1 % of the speed that is lost.
TEST_P(UncertainTerrain, APatchHasItsOwnFriction) {
  const Simulation patches = simulation("<box size='0.1 0.1 0.04'/>", R"(
robot: {urdf: robot.urdf, initial: {height: on_ground, clearance: 0.2 mm, velocity: [2, 0, 0]}}
environment:
  ground: {plane: z, friction: 1}
  ice: {box: [2 m, 1 m, 2 cm], position: [0.5, 0, -9.9 mm], friction: {uniform: [0.05, 0.3]}}
time: {end: 0.4 s}
)");
  const std::vector<TraceRecord> traces = Simulator(patches, "none").run(0, 8);
  for (const TraceRecord& trace : traces) {
    const double lost = patches.values(trace.particle).front() * kGravity * 0.4;
    ASSERT_EQ(trace.outcome, Outcome::success) << trace.invalid_reason;
    EXPECT_NEAR(trace.v[3], 2 - lost, 0.01 * lost + 2e-3) << trace.particle;
  }
}

// A ball rolls down a slope of 3 to 10 degrees: a = g sin(slope) / (1 + I / (m r^2)), I / (m r^2) = 0.4.
TEST_P(UncertainTerrain, APlaneHasASlope) {
  const Simulation slopes = simulation("<sphere radius='0.1'/>", R"(
robot: {urdf: robot.urdf, initial: {height: on_ground}}
environment: {ground: {plane: z, friction: 1}}
uncertain: {environment.ground.rotation.pitch: {uniform: [3 deg, 10 deg]}}
time: {end: 0.5 s}
)");
  for (const TraceRecord& trace : Simulator(slopes, "none").run(0, 8)) {
    const double slope = slopes.values(trace.particle).front();
    const double speed = kGravity * std::sin(slope) * 0.5 / 1.4;
    EXPECT_NEAR(std::hypot(trace.v[3], trace.v[5]), speed, 0.02 * speed) << trace.particle;
    EXPECT_NEAR(-trace.v[5] / trace.v[3], std::tan(slope), 0.02) << "down it";
  }
}

INSTANTIATE_TEST_SUITE_P(Physics, UncertainTerrain, ::testing::Values("lanes", "bullet"));

}  // namespace
}  // namespace graze
