// Claim: an object's mesh is its convex hull, for its mass as for contact; a flat one is refused where it is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "scenarios/scenario.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// A folder with a cube of 1 m whose top is dented down to its middle, a flat square, and a ball for a robot.
class MeshObject : public ::testing::Test {
 protected:
  MeshObject() {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "dented.obj")
        << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv 0.5 0.5 0.5\n"
           "f 1 3 2\nf 1 4 3\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n"
           "f 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9\n";
    std::ofstream(folder_ / "flat.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
    std::ofstream(folder_ / "ball.urdf")
        << "<robot name='ball'><link name='ball'><inertial><mass value='1'/><inertia ixx='0.004' iyy='0.004' "
           "izz='0.004' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><sphere radius='0.1'/></geometry>"
           "</collision></link></robot>";
  }
  ~MeshObject() override { fs::remove_all(folder_); }

  Scenario load(const std::string& crate) const {
    std::ofstream(folder_ / "s.yaml")
        << "graze: 1\nname: Mesh\nrobot: {urdf: ball.urdf, initial: {position: [0, 0, 3]}}\n"
           "environment:\n  ground: {plane: z}\n  crate: "
        << crate
        << "\ntime: {end: 10 ms, step: 1 ms, control: 1 ms}\n"
           "policies: {still: {hold: {}, control: {torque: {}}}}\n"
           "task: {objective: {low: {height: {link: ball, below: 9}}}}\n";
    return load_scenario((folder_ / "s.yaml").string());
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("graze_mesh_object_" + std::to_string(getpid()));
};

TEST_F(MeshObject, WeighsWhatItsHullDoes) {
  const Scenario scenario = load("{mesh: dented.obj, movable: true, density: 200, position: [2, 2, 0.01]}");
  const auto found = std::find_if(scenario.model.bodies.begin(), scenario.model.bodies.end(),
                                  [](const Body& body) { return body.name == "crate"; });
  ASSERT_NE(found, scenario.model.bodies.end());
  EXPECT_NEAR(found->mass, 200, 1e-9);
}

/// A scenario's hull of the crate.
const Hull& crate_of(const Scenario& scenario) {
  const auto& colliders = scenario.model.colliders;
  return *std::find_if(colliders.begin(), colliders.end(), [](const Collider& one) {
            return one.link == "crate";
          })->shape.hull;
}

// A mesh's hull is as simple and as exact as the scenario says, for objects by their shape and for a robot by
// robot.mesh; mass stays that of the whole hull.
TEST_F(MeshObject, IsSimplifiedAsTheScenarioSays) {
  std::ofstream round(folder_ / "round.obj");
  for (int i = 0; i < 500; ++i) {
    const double z = (i + 0.5) / 250 - 1, angle = 2.4 * i, r = std::sqrt(1 - z * z);
    round << "v " << 0.2 * r * std::cos(angle) << " " << 0.2 * r * std::sin(angle) << " " << 0.2 * z << "\n";
  }
  for (int i = 1; i <= 498; ++i) round << "f " << i << " " << i + 1 << " " << i + 2 << "\n";
  round.close();
  const std::string rest = ", movable: true, density: 100, position: [2, 2, 0.3]}";
  const Scenario usual = load("{mesh: round.obj" + rest), exact = load("{mesh: {file: round.obj, exact: true}" + rest);
  EXPECT_EQ(crate_of(exact).corners.size(), 500u);
  EXPECT_EQ(crate_of(exact).error, 0);
  EXPECT_LE(crate_of(usual).corners.size(), 128u);
  EXPECT_GT(crate_of(usual).error, 0);
  EXPECT_EQ(usual.model.bodies.back().mass, exact.model.bodies.back().mass);
  EXPECT_EQ(crate_of(load("{mesh: {file: round.obj, vertices: 20}" + rest)).corners.size(), 20u);
  const Scenario loose = load("{mesh: {file: round.obj, error: 2 cm}" + rest);
  EXPECT_LE(crate_of(loose).error, 0.02);
  EXPECT_LT(crate_of(loose).corners.size(), crate_of(usual).corners.size());

  std::ofstream(folder_ / "ball.urdf") << "<robot name='ball'><link name='ball'><collision><geometry><mesh "
                                          "filename='round.obj'/></geometry></collision></link></robot>";
  ScenarioOptions options;
  const auto of_robot = [&](const std::string& mesh) {
    options.overrides = {{"robot.mesh", mesh}};
    return load_scenario((folder_ / "s.yaml").string(), options).model.colliders.front().shape.hull->corners.size();
  };
  EXPECT_EQ(of_robot("{exact: true}"), 500u);
  EXPECT_EQ(of_robot("{vertices: 40}"), 40u);
}

// `mesh: hulls` splits the meshes of all links, its key `hulls` those of some.
TEST_F(MeshObject, OfARobotIsSplitWhereItShallBe) {
  std::ofstream two(folder_ / "two.obj");
  for (int k = 0; k < 2; ++k) {
    two << "v " << k << " 0 0\nv " << k + 0.5 << " 0 0\nv " << k << " 1 0\nv " << k << " 0 1\n";
    for (const char* face : {"-4 -2 -3", "-4 -3 -1", "-4 -1 -2", "-3 -2 -1"}) two << "f " << face << "\n";
  }
  two.close();
  std::ofstream(folder_ / "ball.urdf") << "<robot name='ball'><link name='ball'><collision><geometry><mesh "
                                          "filename='two.obj'/></geometry></collision></link></robot>";
  load("{box: [1, 1, 1], position: [9, 9, 9]}");
  ScenarioOptions options;
  const auto parts = [&](const std::string& mesh) -> std::string {
    options.overrides = {{"robot.mesh", mesh}};
    try {
      const Scenario scenario = load_scenario((folder_ / "s.yaml").string(), options);
      const auto is_part = [](const Collider& one) { return one.link == "ball"; };
      return std::to_string(std::count_if(scenario.model.colliders.begin(), scenario.model.colliders.end(), is_part));
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(parts("hulls"), "2");
  EXPECT_EQ(parts("{hulls: true, vertices: 20}"), "2");
  EXPECT_EQ(parts("{hulls: [b*]}"), "2");
  EXPECT_EQ(parts("{hulls: ball}"), "2");
  EXPECT_EQ(parts("{hulls: false}"), "1");
  EXPECT_THAT(parts("{hulls: []}"), ::testing::HasSubstr("hulls: names no link; it must name at least one"));
  EXPECT_EQ(parts("{vertices: 20}"), "1");
  EXPECT_THAT(parts("{hulls: [bell]}"), ::testing::AllOf(::testing::HasSubstr("bell"), ::testing::HasSubstr("ball")));
  EXPECT_THAT(parts("hull"), ::testing::HasSubstr("hulls"));
}

// The parts of an object are called as those of a link are; a concave mesh of one piece has none.
TEST_F(MeshObject, IsSplitWhereItShallBe) {
  fs::create_directories(folder_ / "dented_parts");
  const auto parts = [&](const std::string& rest) -> std::string {
    try {
      const Scenario scenario = load("{mesh: {file: dented.obj" + rest);
      std::string out;
      for (const Collider& one : scenario.model.colliders) out += one.link == "crate" ? one.name + " " : "";
      return out;
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(parts("}, position: [2, 2, 0]}"), "crate ");
  EXPECT_EQ(parts(", hulls: false}, position: [2, 2, 0]}"), "crate ");
  EXPECT_THAT(parts(", hulls: true}, position: [2, 2, 0]}"),
              ::testing::AllOf(::testing::HasSubstr("s.yaml:6:"), ::testing::HasSubstr("a concave mesh of one piece"),
                               ::testing::HasSubstr("leave out 'hulls' for one hull")));
  EXPECT_THAT(parts(", hulls: crate}, position: [2, 2, 0]}"), ::testing::HasSubstr("true or false"));
  for (const char* name : {"a.obj", "b.obj"}) {
    std::ofstream(folder_ / "dented_parts" / name) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                                      "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  }
  EXPECT_EQ(parts(", hulls: true}, position: [2, 2, 0]}"), "crate crate.1 ");
  EXPECT_EQ(parts(", hulls: true, scale: 2}, movable: true, mass: 3, position: [2, 2, 0]}"), "crate crate.1 ");
  EXPECT_NEAR(load("{mesh: {file: dented.obj, hulls: true}, movable: true, density: 30, position: [2, 2, 0.1]}")
                  .model.bodies.back()
                  .mass,
              2 * 30 / 6.0, 1e-9);
}

TEST_F(MeshObject, IsRefusedByItsKeys) {
  const auto refusal = [&](const std::string& keys) -> std::string {
    try {
      load("{mesh: {file: dented.obj, " + keys + "}, position: [2, 2, 0.01]}");
    } catch (const InputError& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_THAT(refusal("vertices: 5"), ::testing::HasSubstr("vertices: 5: a hull has at least 8 vertices, as a box"));
  EXPECT_THAT(refusal("error: -1 mm"), ::testing::AllOf(::testing::HasSubstr("s.yaml:6:"), ::testing::HasSubstr("-1")));
  EXPECT_THAT(refusal("error: 1 mm, exact: true"), ::testing::HasSubstr("does not go with 'exact: true'"));
  EXPECT_THAT(refusal("vertexes: 9"), ::testing::HasSubstr("vertices"));
}

TEST_F(MeshObject, IsRefusedWhenFlat) {
  try {
    load("{mesh: flat.obj, position: [2, 2, 0.01]}");
    FAIL() << "a flat mesh was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(::testing::HasSubstr("s.yaml:6:"), ::testing::HasSubstr("flat.obj"),
                                               ::testing::HasSubstr("must enclose a volume")));
  }
}

}  // namespace
}  // namespace graze
