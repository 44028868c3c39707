// Claim: the world of a scenario is the one that is written: poses and attitudes, motions at the start, shapes in each
// of their forms, coefficients with their defaults; and each key that does not go with others is refused.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/model/rotation.h"
#include "scenarios/channel_readers.h"
#include "scenarios/hull_reader.h"
#include "scenarios/robot_file.h"
#include "scenarios/world_reader.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ReadWorld world_of(const std::string& robot_more, const std::string& rest, const std::string& physics = "lanes") {
  const Settings scenario =
      Settings::parse("robot: {urdf: robots/hopper.urdf" + robot_more + "}\n" + rest, testing::kFolder + "w.yaml");
  return read_world(scenario, {physics, false});
}

std::string refused_world(const std::string& robot_more, const std::string& rest,
                          const std::string& physics = "lanes") {
  return testing::message_of([&] { world_of(robot_more, rest, physics); });
}

Object object_of(const std::string& yaml) {
  return world_of("", "environment: {o: " + yaml + "}").world->objects.at(0);
}

std::string refused_object(const std::string& yaml) {
  return testing::message_of([&] { object_of(yaml); });
}

// Attitudes in any of their forms are one rotation, that of unit quaternions and of Rz Ry Rx.
TEST(WorldReading, AttitudesAreRotations) {
  std::mt19937 random(41);
  const auto number = [&] { return 2 * (random() / 4294967296.0) - 1; };
  for (int i = 0; i < 60; ++i) {
    const Quat q = Quat(number(), number(), number(), number()).normalized();
    const InitialState initial =
        world_of(
            fmt::format(", initial: {{orientation: [{:.17g}, {:.17g}, {:.17g}, {:.17g}]}}", q.w(), q.x(), q.y(), q.z()),
            "")
            .world->initial;
    EXPECT_LT((rotation_from_rpy(initial.rpy) - q.toRotationMatrix()).norm(), 1e-12) << i;
    const Vec3 rpy(3 * number(), 1.5 * number(), 3 * number());
    const Mat3 right = (Eigen::AngleAxisd(rpy.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vec3::UnitY()) *
                        Eigen::AngleAxisd(rpy.x(), Vec3::UnitX()))
                           .toRotationMatrix();
    const std::string written = fmt::format("rpy: [{:.17g}, {:.17g}, {:.17g}]", rpy.x(), rpy.y(), rpy.z());
    EXPECT_LT((rotation_from_rpy(world_of(", initial: {" + written + "}", "").world->initial.rpy) - right).norm(),
              1e-12);
    EXPECT_LT((object_of("{sphere: 1, position: [1, 2, 3], " + written + "}").X_WO.linear() - right).norm(), 1e-12);
    // A plane is turned by its normal first, and then by its attitude.
    const Vec3 n = Vec3(number(), number(), number());
    const Object plane =
        object_of(fmt::format("{{plane: [{:.17g}, {:.17g}, {:.17g}], {}}}", n.x(), n.y(), n.z(), written));
    EXPECT_LT((plane.X_WO.linear().col(2) - right * n.normalized()).norm(), 1e-12);
  }
  EXPECT_THAT(refused_world(", initial: {orientation: [1.0011, 0, 0, 0]}", ""),
              EndsWith("a quaternion of length 1.0011; it must be 1"));
  EXPECT_EQ(refused_world(", initial: {orientation: [0.9991, 0, 0, 0]}", ""), "(accepted)")
      << "as written with three digits";
  EXPECT_THAT(refused_world(", initial: {orientation: [1, 0, 0, 0], rpy: [0, 0, 0]}", ""),
              EndsWith("either 'orientation' (quaternion w, x, y, z) or 'rpy'"));
}

TEST(WorldReading, StartsMoveAsWritten) {
  const InitialState a =
      world_of(
          ", initial: {height: 75 cm, velocity: [1, 2 cm/s, 3], angular_velocity: [0, 0, 90 deg/s], "
          "joints: {\"*\": 0.05, hip: 10 deg, sl*: 2 cm}, joint_velocities: {wheel: 60 rpm, slide: 5 mm/s}}",
          "")
          .world->initial;
  EXPECT_EQ(a.position, Vec3(0, 0, 0.75));
  EXPECT_FALSE(a.on_ground);
  EXPECT_EQ(a.linear_velocity, Vec3(1, 0.02, 3));
  EXPECT_DOUBLE_EQ(a.angular_velocity.z(), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(a.joint_position.at("hip"), std::numbers::pi / 18);
  EXPECT_EQ(a.joint_position.at("slide"), 0.02);
  EXPECT_EQ(a.joint_position.at("wheel"), 0.05) << "later globs win over earlier ones, where they match";
  EXPECT_DOUBLE_EQ(a.joint_velocity.at("wheel"), 2 * std::numbers::pi);
  EXPECT_EQ(a.joint_velocity.at("slide"), 0.005);
  EXPECT_FALSE(a.joint_velocity.count("hip"));
  const InitialState b =
      world_of(", initial: {position: [1, 2, 9], height: on_ground, clearance: 3 mm}", "").world->initial;
  EXPECT_TRUE(b.on_ground);
  EXPECT_EQ(b.clearance, 0.003);
  EXPECT_EQ(b.position, Vec3(1, 2, 9));
  EXPECT_THAT(refused_world(", initial: {position: [1, 2, 3], height: 1}", ""),
              EndsWith("either 'height' or the z of 'position'; or 'height: on_ground'"));
  EXPECT_THAT(refused_world(", initial: {joints: {wheel: 1000001}}", ""), HasSubstr("at most 1e+06 rad"));
}

// Whom others follow says where these begin.
TEST(WorldReading, FollowersBeginWhereTheyArePut) {
  const auto refused = [](const std::string& initial) {
    return testing::message_of([&] {
      read_world(Settings::parse("robot: {urdf: robots/fingers.urdf, base: fixed, initial: {" + initial + "}}",
                                 testing::kFolder + "w.yaml"),
                 {"lanes", false});
    });
  };
  EXPECT_THAT(
      refused("joints: {right: 0.1}"),
      EndsWith("'right' follows 'left' (<mimic> of the URDF: 1 times its position) and begins where that puts it; say "
               "where 'left' begins"));
  EXPECT_THAT(refused("joint_velocities: {right: 0.1}"), HasSubstr("'right' follows 'left'"));
  EXPECT_EQ(refused("joints: {\"*\": 0.1}"), "(accepted)") << "globs pass over them";
}

// Each shape in its forms: kind and size, and the volume that a density needs, in closed form.
TEST(WorldReading, ShapesHaveTheirVolumes) {
  struct Case {
    const char* shape;
    ShapeKind kind;
    Vec3 size;
    double volume;
  };
  const double pi = std::numbers::pi;
  const Case cases[] = {
      {"box: [1, 2, 30 cm]", ShapeKind::box, {1, 2, 0.3}, 0.6},
      {"box: \"[10, 20, 30] cm\"", ShapeKind::box, {0.1, 0.2, 0.3}, 0.006},
      {"sphere: 20 cm", ShapeKind::sphere, {0.2, 0, 0}, 4.0 / 3 * pi * 0.008},
      {"cylinder: [10 cm, 2]", ShapeKind::cylinder, {0.1, 2, 0}, pi * 0.02},
      {"cylinder: {length: 2, radius: 10 cm}", ShapeKind::cylinder, {0.1, 2, 0}, pi * 0.02},
      {"capsule: [10, 50, cm]", ShapeKind::capsule, {0.1, 0.5, 0}, pi * 0.005 + 4.0 / 3 * pi * 0.001},
      {"capsule: {radius: 0.1, length: 0.5}", ShapeKind::capsule, {0.1, 0.5, 0}, pi * 0.005 + 4.0 / 3 * pi * 0.001},
  };
  for (const Case& one : cases) {
    const std::string shape = one.shape;
    const Object dense = object_of("{" + shape + ", movable: true, density: 2 g/cm^3}"),
                 heavy = object_of("{" + shape + ", movable: true, mass: 3}");
    EXPECT_EQ(dense.shape.kind, one.kind) << shape;
    EXPECT_LT((dense.shape.size - one.size).norm(), 1e-15) << shape;
    EXPECT_NEAR(dense.inertia.mass, 2000 * one.volume, 1e-9) << shape;
    EXPECT_NEAR(heavy.inertia.mass, 3, 1e-12) << shape;
    EXPECT_LT((heavy.inertia.inertia_about_com() / 3 - dense.inertia.inertia_about_com() / dense.inertia.mass).norm(),
              1e-12);
    EXPECT_FALSE(object_of("{" + shape + "}").movable);
  }
  const Object mesh = object_of("{mesh: {file: robots/tetrahedron.obj, scale: [1, 2, 3]}, movable: true, density: 6}");
  EXPECT_EQ(mesh.shape.size, Vec3(1, 2, 3));
  EXPECT_NEAR(mesh.inertia.mass, 6 * mesh.shape.volume(), 1e-12);
  EXPECT_NEAR(mesh.shape.volume(),
              6 * object_of("{mesh: robots/tetrahedron.obj, movable: true, density: 6}").shape.volume(), 1e-12);
}

TEST(WorldReading, ObjectsThatAreNoneAreRefused) {
  const std::pair<const char*, const char*> cases[] = {
      {"{sphere: 1, movable: true, mass: 1, density: 1}", "a movable object needs either 'density' or 'mass'"},
      {"{sphere: 1, density: 1}", "only a movable object has a density; add 'movable: true'"},
      {"{heightfield: {size: [1, 1], heights: [[0, 0], [0, 0]]}, movable: true, mass: 1}",
       "a plane or a heightfield cannot be movable"},
      {"{heightfield: {size: [1, 1], heights: [[0, 0]]}}", "a grid of 1 x 2 heights; at least 2 x 2"},
      {"{heightfield: {size: [1, 1], heights: [[0], [0]]}}", "a grid of 2 x 1 heights; at least 2 x 2"},
      {"{heightfield: {size: [1, 1], heights: []}}", "a grid of 0 x 0 heights; at least 2 x 2"},
      {"{plane: [0, 0, 0]}", "the normal has no length"},
      {"{mesh: {file: robots/tetrahedron.obj, scale: 0}}", "scale factors must be > 0"},
      {"{mesh: {file: robots/tetrahedron.obj, scale: [1, -1, 1]}}", "scale factors must be > 0"},
      {"{mesh: {file: robots/tetrahedron.obj, scale: [1, 1]}}", "must be a list of 3 numbers; this has 2"},
      {"{capsule: {radius: 1}}", "the key 'length' is missing"},
      {"{cylinder: [1 cm, 0.9 um], movable: true, mass: 1}", "the unit 'um' does not fit; one of: m, cm, mm, in"},
      {"{cylinder: [1 cm, 0.0009 mm], movable: true, mass: 1}",
       "cylinder: 9e-07 m: a movable object is at least 1e-06 m long, wide and high; parts with smaller gaps count as "
       "touching"},
      {"{box: [1, 1, 1], movable: true, mass: 2e9}", "mass: 2e+09 kg; a movable object weighs 1e-12 to 1e+09 kg"},
      {"{box: [1, 1, 1], movable: true, density: 1e-30}",
       "density: 1e-30 kg; a movable object weighs 1e-12 to 1e+09 kg"},
      {"{sphere: 1, restitution: 1.1}", "constant(1.1) is 1.1; environment.o.restitution must be <= 1"},
  };
  for (const auto& [yaml, message] : cases) EXPECT_THAT(refused_object(yaml), EndsWith(message)) << yaml;
  EXPECT_EQ(refused_object("{cylinder: [1 cm, 0.0011 mm], movable: true, mass: 1 g}"), "(accepted)");
  EXPECT_THAT(refused_world("", "environment: {\"\": {sphere: 1}}"), EndsWith("an object needs a name"));
  EXPECT_THAT(refused_world("", "environment: {\"a\\nb\": {sphere: 1}}"),
              EndsWith("an object's name must have no control characters"));
}

// What the file does not say of an object is as the contact settings say; in a pair it stays open.
TEST(WorldReading, CoefficientsHaveDefaults) {
  const ReadWorld read =
      world_of("",
               "contact: {friction: 0.7, restitution: 0.1, self_collision: false, solver: sweeps, pairs: [{between: "
               "[foot, a], friction: 0.2}, {between: [base, \"*\"], restitution: 0.3}], ignore: [[foot, b]]}\n"
               "environment: {a: {sphere: 1}, b: {sphere: 1, friction: {normal: {std: 10 %}}}}\n"
               "control: {lag: 4 ms}\n");
  const World& w = *read.world;
  EXPECT_TRUE(std::isnan(w.objects[0].friction));
  EXPECT_DOUBLE_EQ(w.objects[1].friction, 0.7) << "the mean is that of the contact settings";
  ASSERT_EQ(read.uncertain.size(), 1u);
  EXPECT_EQ(read.uncertain[0].path, "environment.b.friction");
  EXPECT_DOUBLE_EQ(read.uncertain[0].spread.persistent.std(), 0.07);
  ASSERT_EQ(w.contact.pairs.size(), 2u);
  EXPECT_EQ(w.contact.pairs[0].friction, 0.2);
  EXPECT_TRUE(std::isnan(w.contact.pairs[0].restitution));
  EXPECT_EQ(w.contact.pairs[1].restitution, 0.3);
  EXPECT_FALSE(w.contact.self_collision);
  EXPECT_EQ(w.contact.solver, ContactSolver::sweeps);
  EXPECT_EQ(w.contact.ignore, (std::vector<std::pair<std::string, std::string>>{{"foot", "b"}}));
  EXPECT_EQ(w.control_lag, 0.004);
  EXPECT_EQ(world_of("", "contact: {solver: newton}").world->contact.solver, ContactSolver::newton);
  EXPECT_EQ(world_of("", "contact: {solver: auto}").world->contact.solver, ContactSolver::automatic);
  EXPECT_THAT(refused_world("", "contact: {pairs: [{between: [foot, a], friction: -1}]}"),
              EndsWith("-1: must be >= 0"));
  EXPECT_THAT(refused_world("", "contact: {pairs: [{between: [foot, a], restitution: 1.01}]}"),
              EndsWith("1.01: must lie within [0, 1]"));
  EXPECT_THAT(refused_world("", "contact: {ignore: [[a, b, c]]}"),
              EndsWith("must be a list of two globs of part names, [a, b]"));
}

TEST(WorldReading, GravityIsDownOrAVector) {
  const auto g = [](const std::string& gravity) { return world_of("", "gravity: " + gravity).world->gravity; };
  EXPECT_EQ(g("1.62"), Vec3(0, 0, -1.62));
  EXPECT_EQ(g("0"), Vec3(0, 0, 0));
  EXPECT_EQ(g("[1, 2, -3]"), Vec3(1, 2, -3));
  EXPECT_EQ(world_of("", "").world->gravity, Vec3(0, 0, -9.81));
  EXPECT_THAT(refused_world("", "gravity: -3"), EndsWith("did you mean 3, or [0, 0, 3] for one that lifts?"));
}

// Words of the robot's file.
TEST(WorldReading, RobotsAreReadAsTheirKeysSay) {
  const auto options = [](const std::string& keys) {
    return read_urdf_options(Settings::parse("robot: {" + keys + "}", "/f/r.yaml").at("robot"), true);
  };
  const UrdfOptions usual = options("urdf: x");
  EXPECT_FALSE(usual.fixed_base || usual.repair || usual.split_all || usual.hull.exact);
  EXPECT_TRUE(usual.ignore_missing_meshes);
  const UrdfOptions all = options(
      "base: fixed, density: 2.7 g/cm^3, package_path: [a, /b], repair: true, mesh: {vertices: 40, error: 2 mm, "
      "hulls: [\"*_hand\", base]}");
  EXPECT_TRUE(all.fixed_base && all.repair);
  EXPECT_DOUBLE_EQ(all.density, 2700);
  EXPECT_THAT(all.package_path, ElementsAre("/f/a", "/b"));
  EXPECT_EQ(all.hull.vertices, 40u);
  EXPECT_EQ(all.hull.error, 0.002);
  EXPECT_THAT(all.split, ElementsAre("*_hand", "base"));
  EXPECT_FALSE(all.split_all);
  for (const char* whole : {"mesh: hulls", "mesh: {hulls: true}"}) {
    EXPECT_TRUE(options(whole).split_all) << whole;
    EXPECT_THAT(options(whole).split, IsEmpty()) << whole;
  }
  EXPECT_FALSE(options("mesh: {hulls: false}").split_all);
  EXPECT_THAT(options("mesh: {hulls: false}").split, IsEmpty());
  EXPECT_THAT(options("mesh: {hulls: base}").split, ElementsAre("base"));
  EXPECT_FALSE(options("mesh: {hulls: base}").split_all);
  const auto refused = [&](const std::string& keys) { return testing::message_of([&] { options(keys); }); };
  EXPECT_EQ(refused("mesh: {vertices: 8}"), "(accepted)");
  EXPECT_THAT(refused("mesh: {vertices: 7}"), EndsWith("7: a hull has at least 8 vertices, as a box"));
  EXPECT_THAT(refused("mesh: {exact: true, error: 1 mm}"),
              EndsWith("does not go with 'exact: true', which keeps all vertices"));
  EXPECT_THAT(refused("mesh: {exact: true, vertices: 9}"), HasSubstr("mesh.vertices: does not go with 'exact: true'"));
  EXPECT_THAT(refused("mesh: {error: 0}"), EndsWith("0: must be > 0"));
  EXPECT_THAT(refused("mesh: {hulls: []}"),
              EndsWith("names no link; it must name at least one, or be 'false' for none and 'true' for all"));
  EXPECT_THAT(refused("mesh: hull"), HasSubstr("did you mean 'hulls'?"));
  EXPECT_THAT(refused("density: 0"), EndsWith("0: must be > 0"));
  EXPECT_THAT(refused_world(", mesh: {hulls: [base]}", ""),
              EndsWith("base: matches no link with a collision mesh; there are none"));
}

// Channels that no policy looks at are idle; others name the policies that look at them.
TEST(WorldReading, ChannelsKnowWhoReadsThem) {
  const Scenario s = testing::read(
      "graze: 1\nrobot: {urdf: robots/hopper.urdf}\ntime: {end: 1 s}\npolicies:\n"
      "  servo: {hold: {}, control: {joint_pd: {kp: 1, kd: 1}}}\n"
      "  blind: {torque: {constant: 0}, control: {torque: {}}}\n");
  const ChannelReaders readers(s);
  EXPECT_THAT(*readers.of("sensor.encoder.hip.position"), ElementsAre("servo"));
  EXPECT_FALSE(readers.idle("sensor.encoder.hip.position"));
  EXPECT_TRUE(readers.idle("sensor.imu.linear.x"));
  EXPECT_THAT(*readers.of("sensor.imu.linear.x"), IsEmpty());
  EXPECT_FALSE(readers.of("robot.link.foot.mass")) << "which is no channel";
  EXPECT_FALSE(readers.idle("robot.link.foot.mass"));
}

}  // namespace
}  // namespace graze
