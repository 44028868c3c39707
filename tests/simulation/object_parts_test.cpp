// Claims: a concave object of several hulls is hollow, fixed or movable, on every back end: a ball that is dropped into
// a bowl lies on its bottom, between its walls; one hull of it holds the ball above. The bowl's parts are one body.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulation/simulation.h"
#include "tests/jobs/program.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

struct Block {
  const char* name;
  Vec3 low, high;  // m
};

/// A bowl of 30 cm with walls of 2 cm and 10 cm height about its origin, on its bottom.
const Block kBowl[] = {{"bottom", {-0.15, -0.15, 0}, {0.15, 0.15, 0.02}},
                       {"left", {-0.15, -0.15, 0.02}, {-0.13, 0.15, 0.1}},
                       {"right", {0.13, -0.15, 0.02}, {0.15, 0.15, 0.1}},
                       {"front", {-0.13, -0.15, 0.02}, {0.13, -0.13, 0.1}},
                       {"back", {-0.13, 0.13, 0.02}, {0.13, 0.15, 0.1}}};

std::string as_obj() {
  std::string out;
  for (const Block& block : kBowl) {
    out += fmt::format("o {}\n", block.name);
    for (int corner = 0; corner < 8; ++corner) {
      const auto coordinate = [&](int axis) { return (corner >> axis & 1 ? block.high : block.low)[axis]; };
      out += fmt::format("v {} {} {}\n", coordinate(0), coordinate(1), coordinate(2));
    }
    for (const char* face :
         {"-8 -7 -3 -4", "-6 -5 -1 -2", "-8 -6 -2 -4", "-7 -5 -1 -3", "-8 -7 -5 -6", "-4 -3 -1 -2"}) {
      out += fmt::format("f {}\n", face);
    }
  }
  return out;
}

struct ObjectParts : ::testing::TestWithParam<const char*> {
  Simulation simulation(const std::string& bowl, const std::string& more = "") const {
    testing::write_file(folder / "bowl.obj", as_obj());
    testing::write_file(folder / "ball.urdf",
                        "<robot name='ball'><link name='ball'><inertial><mass value='0.2'/><inertia ixx='2e-4' "
                        "iyy='2e-4' izz='2e-4' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><sphere "
                        "radius='0.05'/></geometry></collision></link></robot>");
    testing::write_file(folder / "bowl.yaml", "graze: 1\nname: Bowl\nphysics: " + std::string(GetParam()) + R"(
robot: {urdf: ball.urdf, initial: {position: [0.05 m, 0.04 m, 20 cm]}}
environment:
  ground: {plane: z}
  bowl: {mesh: )" + bowl + "}\n" + R"(
contact: {friction: 0.6}
time: {end: 2 s}
policies: {none: {hold: {}, control: {torque: {}}}}
)" + more);
    return Simulation(load_scenario(folder / "bowl.yaml"));
  }

  static std::vector<TraceRecord> run(const Simulation& simulation, std::uint32_t count) {
    return Simulator(simulation, "none").run(0, count);
  }

  testing::TemporaryFolder folder;
};

TEST_P(ObjectParts, HoldWhatIsInAHollow) {
  const TraceRecord split = run(simulation("{file: bowl.obj, hulls: true}"), 1).front();
  EXPECT_EQ(split.invalid_reason, "");
  EXPECT_NEAR(split.q[6], 0.07, 1e-3);  // bottom and radius
  EXPECT_LT(std::abs(split.q[4]), 0.081);
  EXPECT_LT(std::abs(split.q[5]), 0.081);
  const TraceRecord whole = run(simulation("{file: bowl.obj}"), 1).front();
  EXPECT_NEAR(whole.q[6], 0.15, 1e-3);  // upon its rim
}

// It falls from 5 cm with the ball above it, and the ball stays in it. It weighs what its parts do, 2000 kg/m^3 of
// 0.3^2 * 0.02 + (0.3^2 - 0.26^2) * 0.08 m^3.
TEST_P(ObjectParts, AreOneBodyThatFalls) {
  const Simulation falling =
      simulation("{file: bowl.obj, hulls: true}, movable: true, density: 2000, position: [0, 0, 0.05]");
  const Model& model = falling.scenario().model;
  ASSERT_EQ(model.bodies.size(), 2u);
  EXPECT_NEAR(model.bodies[1].mass, 2000 * (0.09 * 0.02 + (0.09 - 0.0676) * 0.08), 1e-5);  // of numbers read as float
  EXPECT_NEAR(model.bodies[1].com.x(), 0, 1e-12);
  // Its parts meet the ground and the ball, and not each other.
  EXPECT_EQ(model.pairs.size(), 5u + 5u + 1u);
  const TraceRecord trace = run(falling, 1).front();
  EXPECT_EQ(trace.invalid_reason, "");
  EXPECT_NEAR(trace.q[6], 0.07, 1e-3);
  EXPECT_NEAR(trace.q[13], 0, 1e-3);  // the bowl stands
  EXPECT_LT((Vec3(trace.q[4], trace.q[5], 0) - Vec3(trace.q[11], trace.q[12], 0)).cwiseAbs().maxCoeff(), 0.081);
}

TEST_P(ObjectParts, HaveTheSameBitsInCompany) {
  const Simulation many =
      simulation("{file: bowl.obj, hulls: true}, movable: true, density: 2000, position: [0, 0, 0.05]",
                 "uncertain: {environment.bowl.density: {uniform: [500, 4000]}, "
                 "environment.bowl.position.x: {uniform: [-1 cm, 1 cm]}}\n");
  const std::vector<TraceRecord> together = run(many, 5);
  for (std::uint32_t i = 0; i < 5; ++i) {
    EXPECT_EQ(testing::all_bits_of(Simulator(many, "none").run(i, 1).front()), testing::all_bits_of(together[i])) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(BackEnds, ObjectParts, ::testing::Values("lanes", "bullet"));

}  // namespace
}  // namespace graze
