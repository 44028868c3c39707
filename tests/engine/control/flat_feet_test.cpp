// Claim: what `inverse_dynamics` does unless told otherwise holds robots that stand on more points than their joints
// can tell apart.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/control/inverse_dynamics_support.h"
#include "tests/temporary_folder.h"

namespace graze {
namespace {

std::string link_text(const std::string& name, double mass, double moment, const std::string& shapes) {
  return fmt::format(
      R"(<link name="{0}"><inertial><mass value="{1}"/><inertia ixx="{2}" iyy="{2}" izz="{2}" ixy="0" ixz="0"
iyz="0"/></inertial>{3}</link>)",
      name, mass, moment, shapes);
}

std::string sphere_at(double x, double y, double z) {
  return fmt::format(R"(<collision><origin xyz="{} {} {}"/><geometry><sphere radius="0.02"/></geometry></collision>)",
                     x, y, z);
}

/// Two legs of six joints, each on a foot of four points: 60 kg.
std::string biped() {
  struct Part {
    const char *axis, *from;
  };
  constexpr Part kParts[] = {{"0 0 1", "0 0 0"},    {"1 0 0", "0 0 0"},    {"0 1 0", "0 0 0"},
                             {"0 1 0", "0 0 -0.4"}, {"0 1 0", "0 0 -0.4"}, {"1 0 0", "0 0 0"}};
  std::string out = "<robot name=\"biped\">" + link_text("base", 40, 2, sphere_at(0, 0, 0.1));
  for (const int side : {0, 1}) {
    std::string parent = "base";
    for (std::size_t k = 0; k < 6; ++k) {
      const std::string name = fmt::format("{}{}", "lr"[side], k);
      const std::string hip = fmt::format("0 {} 0", side == 0 ? 0.1 : -0.1);
      out += fmt::format(R"(<joint name="j{0}" type="revolute"><parent link="{1}"/><child link="{0}"/>
<origin xyz="{2}"/><axis xyz="{3}"/><limit lower="-3" upper="3" effort="1000" velocity="100"/></joint>)",
                         name, parent, k == 0 ? hip : kParts[k].from, kParts[k].axis);
      std::string soles;
      for (const double x : {-0.08, 0.12}) {
        for (const double y : {-0.04, 0.04}) soles += k == 5 ? sphere_at(x, y, -0.05) : "";
      }
      out += link_text(name, 5.0 / 3, 0.02, soles);
      parent = name;
    }
  }
  return out + "</robot>";
}

World standing_biped() {
  const testing::TemporaryFolder folder;
  World world = links_world();
  testing::write_file(folder / "biped.urdf", biped());
  world.robot = load_urdf((folder / "biped.urdf").string());
  world.initial = {};
  world.initial.on_ground = true;
  world.contact.ignore = {};
  world.contact.self_collision = false;
  return world;
}

struct Stood {
  double torque = 0, force = 0;  // the largest asked for, N m, and counted on, N
  double height = 0;             // how far the base has gone up or down, m
};

Stood stand(const World& world, const std::string& control) {
  const Scene scene(world);
  LaneLoop loop(scene, hold("inverse_dynamics: {kp: 5e3, kd: 100" + control + "}"));
  loop.start(0, scene.particle());
  std::vector<double> counted(loop.controller().tracker().inside().size());
  const double before = loop.state().q(6, 0);
  Stood out;
  for (int step = 0; step < 300; ++step) {
    loop.advance();
    EXPECT_FALSE(loop.physics().fault(0)) << *loop.physics().fault(0);
    if (loop.physics().fault(0)) break;
    loop.controller().tracker().look_inside(0, counted.data());
    for (const double force : counted) out.force = std::max(out.force, std::abs(force));
    for (int k = 0; k < scene.model.na(); ++k) {
      out.torque = std::max(out.torque, std::abs(loop.command().tau(k, 0)));
    }
    out.height = std::max(out.height, std::abs(loop.state().q(6, 0) - before));
  }
  return out;
}

// Hardly any torque is needed to stand on straight legs. At the weight of the published second stage the feet of the
// same robot are counted on to press against each other.
TEST(FlatFeet, ABipedIsHeldUnlessToldOtherwise) {
  const World world = standing_biped();
  double least = 0;
  for (const auto& [model, most] : {std::pair{"qp_coulomb", 1.0}, {"qp_no_slip", 1.0}, {"lcp_no_slip", 50.0}}) {
    const Stood stood = stand(world, std::string(", model: ") + model);
    RecordProperty(model, std::to_string(stood.torque));
    EXPECT_LT(stood.torque, most) << model;
    EXPECT_LT(stood.force, 1.1 * 60 * 9.81) << model;
    EXPECT_LT(stood.height, 1e-3) << model;
    if (least == 0) least = stood.torque;
  }
  EXPECT_GT(stand(world, ", regularization: 1e-6").torque, 100 * least);
}

}  // namespace
}  // namespace graze
