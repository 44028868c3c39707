// Robots of others drop, come to rest and stay there. Their files are not part of this project: tests look for them in
// GRAZE_TEST_ROBOTS or in ../shared/robots, and are skipped where there are none.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "engine/model/urdf.h"
#include "tests/engine/bullet/worlds.h"

namespace graze::test {
namespace {

constexpr double kStiffness = 100;  // N m/rad
constexpr double kDamping = 2;      // N m s/rad; 1000 times what an explicit damper on a LINKS shin would survive

std::string robot_file(const std::string& name) {
  const char* folder = std::getenv("GRAZE_TEST_ROBOTS");
  const std::filesystem::path path =
      folder ? std::filesystem::path(folder) : std::filesystem::path(GRAZE_SOURCE_DIR) / ".." / "shared" / "robots";
  const std::filesystem::path file = path / name;
  return std::filesystem::exists(file) ? file.string() : "";
}

class Robots : public testing::TestWithParam<std::tuple<std::string, std::string>> {};
INSTANTIATE_TEST_SUITE_P(All, Robots,
                         testing::Combine(testing::ValuesIn(physics_names()),
                                          testing::Values("a1.urdf", "laikago.urdf", "iiwa.urdf", "links.urdf")),
                         [](const auto& info) {
                           const std::string file = std::get<1>(info.param);
                           return std::get<0>(info.param) + "_" + file.substr(0, file.find('.'));
                         });

// Joints held softly where they start, with damping: what is dropped comes to rest on
// the ground and carries its weight there.
TEST_P(Robots, DropsAndComesToRest) {
  const auto& [physics, name] = GetParam();
  const std::string file =
      name == "links.urdf" ? std::string(GRAZE_SOURCE_DIR) + "/data/robots/links.urdf" : robot_file(name);
  if (file.empty() || !std::filesystem::exists(file)) GTEST_SKIP() << name << " is not here";
  UrdfOptions options;
  options.ignore_missing_meshes = true;
  World world;
  world.robot = load_urdf(file, options);
  for (Joint& joint : world.robot.joints) joint.damping = std::max(joint.damping, kDamping);
  world.objects.push_back(fixed("ground", plane()));
  world.initial.on_ground = world.robot.floating_base;
  world.initial.clearance = 0.05;
  Bench run(physics, world);
  const Model& model = run.model();
  const Eigen::VectorXd start = run.q();
  run.run(6.0, 1e-3, [&] {
    for (int k = 0; k < model.na(); ++k) {
      const int q = model.bodies[model.actuated[k]].q;
      run.tau(k, 0) = kStiffness * (start[q] - run.q(q));
    }
  });
  EXPECT_EQ(run.fault(), "");
  EXPECT_LT(run.v().cwiseAbs().maxCoeff(), 0.02);
  if (!world.robot.floating_base) return;
  double mass = 0;
  for (const Body& body : model.bodies) mass += body.mass;
  Vec3 push = Vec3::Zero();
  for (const Contact& c : run.contacts()) {
    if (model.colliders[c.b].name == "ground") push += c.impulse_W;
  }
  EXPECT_NEAR(push.z(), mass * kGravity * 1e-3, 0.02 * mass * kGravity * 1e-3);
}

}  // namespace
}  // namespace graze::test
