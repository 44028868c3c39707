#include "engine/model/model.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <numbers>

#include "engine/model/convex_hull.h"
#include "tests/engine/model/support.h"

namespace graze {
namespace {

Shape shape(ShapeKind kind, const Vec3& size) { return {kind, size, nullptr, nullptr}; }

/// A convex mesh with the corners of a box.
Shape box_mesh(const Vec3& size) {
  Mesh corners;
  for (int i = 0; i < 8; ++i) {
    corners.vertices.push_back(size.cwiseProduct(Vec3(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5)));
  }
  return {ShapeKind::mesh, Vec3::Ones(), convex_hull(corners), nullptr};
}

bool inside(const Shape& s, const Vec3& p) {
  const double across = std::hypot(p.x(), p.y());
  switch (s.kind) {
    case ShapeKind::sphere:
      return p.norm() <= s.size.x();
    case ShapeKind::cylinder:
      return across <= s.size.x() && std::abs(p.z()) <= s.size.y() / 2;
    case ShapeKind::capsule:
      return std::hypot(across, std::max(0.0, std::abs(p.z()) - s.size.y() / 2)) <= s.size.x();
    default:
      return (p.cwiseAbs() - s.size / 2).maxCoeff() <= 0;
  }
}

Object fixed_object(const std::string& name) {
  Object object;
  object.name = name;
  object.shape = shape(ShapeKind::box, {1, 1, 1});
  return object;
}

Object movable_object(const std::string& name) {
  Object object = fixed_object(name);
  object.movable = true;
  object.inertia = MassMoments::of_shape(object.shape, 1);
  return object;
}

/// Torso, two legs of two links each, and a foot that is fixed to the first shin.
World small_robot() {
  const auto part = [](const std::string& name) {
    return "<link name=\"" + name +
           "\"><collision><origin xyz=\"0.5 0 0\"/><geometry><sphere radius=\"0.1\"/></geometry></collision></link>";
  };
  const auto joint = [](const std::string& name, const std::string& a, const std::string& b, const std::string& type) {
    return "<joint name=\"" + name + "\" type=\"" + type + "\"><origin xyz=\"1 0 0\" rpy=\"0 0 1.5707963267948966\"/>" +
           "<parent link=\"" + a + "\"/><child link=\"" + b + "\"/></joint>";
  };
  World world;
  world.robot = parse_urdf(
      "<robot name=\"r\">" + part("torso") + part("thigh1") + part("shin1") + part("foot1") + part("thigh2") +
          part("shin2") + joint("hip1", "torso", "thigh1", "continuous") +
          joint("knee1", "thigh1", "shin1", "continuous") + joint("ankle1", "shin1", "foot1", "fixed") +
          joint("hip2", "torso", "thigh2", "continuous") + joint("knee2", "thigh2", "shin2", "continuous") + "</robot>",
      "r.urdf");
  return world;
}

std::vector<std::string> pair_names(const Model& model) {
  std::vector<std::string> names;
  for (const ColliderPair& p : model.pairs) {
    names.push_back(model.colliders[p.a].name + "-" + model.colliders[p.b].name);
  }
  return names;
}

// The closed forms of volume, centre and second moment equal Monte Carlo integrals over the shape. With 400000 points
// the standard error of each integral is below 0.5 % of its scale; 2 % is four of them.
TEST(MassMoments, ClosedFormsEqualIntegrals) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  for (ShapeKind kind : {ShapeKind::box, ShapeKind::sphere, ShapeKind::cylinder, ShapeKind::capsule}) {
    const Shape s = shape(kind, {0.5, 0.8, 0.6});
    const int n = 400000;
    int hits = 0;
    Mat3 second = Mat3::Zero();
    for (int i = 0; i < n; ++i) {
      const Vec3 p(u(random), u(random), u(random));
      if (!inside(s, p)) continue;
      ++hits;
      second += p * p.transpose();
    }
    const double cell = 8.0 / n;
    const MassMoments moments = MassMoments::of_shape(s, 2);
    EXPECT_NEAR(s.volume(), hits * cell, 0.02 * s.volume());
    EXPECT_NEAR(moments.mass, 2 * s.volume(), 1e-15);
    EXPECT_EQ(moments.first.norm(), 0);
    EXPECT_LT((moments.second - 2 * cell * second).norm(), 0.02 * moments.second.norm()) << static_cast<int>(kind);
  }
}

// The tetrahedra of a mesh in the form of a box, moved away from the origin, give the box's closed form.
TEST(MassMoments, MeshEqualsBox) {
  const Vec3 size(1, 2, 3);
  const Shape box = shape(ShapeKind::box, size);
  Shape mesh = box_mesh(Vec3(1, 2, 3));
  EXPECT_NEAR(mesh.volume(), box.volume(), 1e-13);
  EXPECT_TRUE(MassMoments::of_shape(mesh, 5).second.isApprox(MassMoments::of_shape(box, 5).second, 1e-13));
  mesh.size = {-2, 1, 1};  // mirrored and stretched
  const Shape stretched = shape(ShapeKind::box, {2, 2, 3});
  EXPECT_NEAR(mesh.volume(), stretched.volume(), 1e-13);
  EXPECT_TRUE(MassMoments::of_shape(mesh, 5).second.isApprox(MassMoments::of_shape(stretched, 5).second, 1e-13));
}

// Inertia and moments are two views of the same: there and back, and the parallel-axis theorem.
TEST(MassMoments, InertiaRoundTripAndParallelAxes) {
  Mat3 inertia;
  inertia << 3, 0.1, 0.2, 0.1, 4, 0.3, 0.2, 0.3, 5;
  const Vec3 com(1, -2, 3);
  const MassMoments m = MassMoments::from_inertia(2, com, inertia);
  EXPECT_TRUE(m.com().isApprox(com, 1e-15));
  EXPECT_TRUE(m.inertia_about_com().isApprox(inertia, 1e-13));
  const Mat3 about_origin = m.second.trace() * Mat3::Identity() - m.second;
  const Mat3 steiner = inertia + 2 * (com.squaredNorm() * Mat3::Identity() - com * com.transpose());
  EXPECT_TRUE(about_origin.isApprox(steiner, 1e-13));
}

// An affine map acts exactly: a stretched, turned and moved box is the box of the new size, turned and moved.
TEST(MassMoments, AffineMapsAreExact) {
  const Vec3 stretch(1.5, 0.5, 2), t(0.1, 0.2, 0.3);
  const Mat3 R = rotation_from_rpy({0.3, 0.4, 0.5});
  const MassMoments mapped =
      MassMoments::of_shape(shape(ShapeKind::box, {1, 2, 3}), 1).transformed(R * Mat3(stretch.asDiagonal()), t);
  const MassMoments direct = MassMoments::of_shape(shape(ShapeKind::box, {1.5, 1, 6}), 6.0 / 9.0).transformed(R, t);
  EXPECT_NEAR(mapped.mass, direct.mass, 1e-14);
  EXPECT_TRUE(mapped.first.isApprox(direct.first, 1e-14));
  EXPECT_TRUE(mapped.second.isApprox(direct.second, 1e-14));
}

// Fixed joints merge: the shin's body has the mass, centre and inertia of shin and foot together, and both keep their
// colliders and frames.
TEST(Compile, MergesFixedJoints) {
  const World world = small_robot();
  const Model model = compile(world);
  ASSERT_EQ(model.bodies.size(), 5u);
  EXPECT_EQ(model.nq, 7 + 4);
  EXPECT_EQ(model.nv, 6 + 4);
  EXPECT_THAT(model.actuated, testing::ElementsAre(1, 2, 3, 4));
  const Body& shin = model.bodies[model.joint("knee1")];
  const double ball = 1000 * 4.0 / 3 * std::numbers::pi * 1e-3;  // one sphere of radius 0.1 m
  EXPECT_NEAR(shin.mass, 2 * ball, 1e-10);
  // The shin's ball is at (0.5, 0, 0); the foot's frame is at (1, 0, 0) turned by 90 deg about z: its ball at (1, .5,
  // 0).
  EXPECT_TRUE(shin.com.isApprox(Vec3(0.75, 0.25, 0), 1e-12));
  const Vec3 d(0.25, 0.25, 0);
  const Mat3 expected =
      2 * (0.4 * ball * 0.01 * Mat3::Identity() + ball * (d.squaredNorm() * Mat3::Identity() - d * d.transpose()));
  EXPECT_TRUE(shin.inertia.isApprox(expected, 1e-12));
  const Frame& foot = model.frames[model.frame("foot1")];
  EXPECT_EQ(foot.body, model.joint("knee1"));
  EXPECT_TRUE(foot.X_BF.translation().isApprox(Vec3(1, 0, 0)));
  EXPECT_EQ(model.colliders[model.collider("foot1")].link, "foot1");
}

// A fixed base becomes the world, at the pose of the initial state; on_ground holds for it, too.
TEST(Compile, FixedBaseIsPartOfTheWorld) {
  World world = small_robot();
  world.robot.floating_base = false;
  world.initial.position = {1, 2, 3};
  world.initial.rpy = {0, 0, std::numbers::pi / 2};
  Model model = compile(world);
  EXPECT_EQ(model.nq, 4);
  const Frame& torso = model.frames[model.frame("torso")];
  EXPECT_EQ(torso.body, -1);
  EXPECT_TRUE(torso.X_BF.translation().isApprox(Vec3(1, 2, 3)));
  EXPECT_TRUE(model.bodies[0].X_PB.translation().isApprox(Vec3(1, 3, 3), 1e-12));
  world.initial.on_ground = true;
  model = compile(world);
  const std::vector<Pose> X_WB = reference_poses(model, initial_state(world, model).q);
  EXPECT_NEAR(lowest_point(model, X_WB), 0, 1e-12);
}

// Candidate pairs: links that are not adjacent (through merged bodies, too), links and objects, movable objects and
// all objects; never two things that cannot move.
TEST(Compile, Pairs) {
  World world = small_robot();
  world.objects = {fixed_object("ground"), fixed_object("wall"), movable_object("ball")};
  const Model model = compile(world);
  const std::vector<std::string> names = pair_names(model);
  EXPECT_THAT(names, testing::UnorderedElementsAre(
                         "torso-shin1", "torso-foot1", "torso-shin2", "thigh1-thigh2", "thigh1-shin2", "shin1-thigh2",
                         "shin1-shin2", "foot1-thigh2", "foot1-shin2", "torso-ground", "torso-wall", "torso-ball",
                         "thigh1-ground", "thigh1-wall", "thigh1-ball", "shin1-ground", "shin1-wall", "shin1-ball",
                         "foot1-ground", "foot1-wall", "foot1-ball", "thigh2-ground", "thigh2-wall", "thigh2-ball",
                         "shin2-ground", "shin2-wall", "shin2-ball", "ground-ball", "wall-ball"));
  EXPECT_TRUE(std::is_sorted(model.pairs.begin(), model.pairs.end(), [](const ColliderPair& x, const ColliderPair& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
  }));
  world.contact.self_collision = false;
  world.contact.ignore = {{"{ground,wall}", "thigh*"}, {"ball", "*"}};
  EXPECT_THAT(pair_names(compile(world)),
              testing::UnorderedElementsAre("torso-ground", "torso-wall", "shin1-ground", "shin1-wall", "foot1-ground",
                                            "foot1-wall", "shin2-ground", "shin2-wall"));
}

// Coefficients follow the rule of ContactSettings, and pairs override it, the last word winning.
TEST(Compile, Coefficients) {
  World world = small_robot();
  world.objects = {fixed_object("ground"), fixed_object("ice"), movable_object("ball")};
  world.objects[1].friction = 0.1;
  world.objects[1].restitution = 0.2;
  world.objects[2].friction = 0.6;
  world.contact.friction = 0.8;
  world.contact.restitution = 0.05;
  world.robot.links[1].friction = 0.5;  // thigh1
  world.robot.links[1].restitution = 0.3;
  world.contact.pairs = {{"foot*", "*", 2, NAN}, {"ground", "foot1", NAN, 0.9}};
  const Model model = compile(world);
  const auto pair = [&](const std::string& a, const std::string& b) {
    for (const ColliderPair& p : model.pairs) {
      if (model.colliders[p.a].name == a && model.colliders[p.b].name == b) return std::pair(p.friction, p.restitution);
    }
    return std::pair(-1.0, -1.0);
  };
  EXPECT_EQ(pair("shin2", "ground"), std::pair(0.8, 0.05));
  EXPECT_EQ(pair("thigh1", "ground"), std::pair(0.4, 0.3));
  EXPECT_EQ(pair("thigh1", "ice"), std::pair(0.05, 0.3));
  EXPECT_EQ(pair("thigh1", "thigh2"), std::pair(0.4, 0.3));
  EXPECT_EQ(pair("ground", "ball"), std::pair(0.6, 0.05));
  EXPECT_EQ(pair("ice", "ball"), std::pair(0.1, 0.2));
  EXPECT_EQ(pair("foot1", "ice"), std::pair(2.0, 0.2));
  EXPECT_EQ(pair("foot1", "ground"), std::pair(2.0, 0.9));
}

// Springs of a link and an object: the object's; of two links: that of contact; of two objects: the softer one's, and
// the less damped one's of two alike. pairs override, each number by itself; what nobody gives stays open.
TEST(Compile, Springs) {
  World world = small_robot();
  world.objects = {fixed_object("ground"), fixed_object("foam"), movable_object("ball"), movable_object("brick"),
                   movable_object("gel")};
  world.contact.spring = {NAN, 70};
  world.objects[1].spring = {1e3, 5};
  world.objects[2].spring = {2e3, NAN};
  world.objects[3].spring = {1e9, NAN};
  world.objects[4].spring = {1e3, 3};
  world.contact.pairs = {{"foot1", "*", NAN, NAN, {8, NAN}}, {"foot1", "foam", NAN, NAN, {NAN, 9}}};
  const Model model = compile(world);
  const auto spring = [&](const std::string& a, const std::string& b) {
    for (const ColliderPair& p : model.pairs) {
      if (model.colliders[p.a].name == a && model.colliders[p.b].name == b) {
        return fmt::format("{:g} {:g}", p.spring.stiffness, p.spring.damping);
      }
    }
    return std::string("none");
  };
  EXPECT_EQ(spring("shin2", "ground"), "nan 70");
  EXPECT_EQ(spring("shin2", "foam"), "1000 5");
  EXPECT_EQ(spring("shin2", "ball"), "2000 70");
  EXPECT_EQ(spring("thigh1", "thigh2"), "nan 70");
  EXPECT_EQ(spring("foam", "ball"), "1000 5");
  EXPECT_EQ(spring("foam", "gel"), "1000 3");
  EXPECT_EQ(spring("ball", "brick"), "2000 70");
  EXPECT_EQ(spring("ground", "brick"), "nan 70") << "the derived spring is softer than 1e9 N/m";
  EXPECT_EQ(spring("foot1", "ground"), "8 70");
  EXPECT_EQ(spring("foot1", "foam"), "8 9");
}

// The world tells the mass that the model has, without what is welded to the world.
TEST(Compile, MovesTheMassThatTheWorldTells) {
  for (const bool floating : {true, false}) {
    World world = small_robot();
    world.robot.floating_base = floating;
    world.objects = {fixed_object("ground"), movable_object("ball")};
    const double mass = moving_mass(compile(world));
    EXPECT_GT(mass, 0);
    EXPECT_NEAR(world.moving_mass(), mass, 1e-12 * mass) << floating;
  }
}

// Bodies that cannot move as rigid bodies do are refused by name.
TEST(Compile, RefusesUnphysicalBodies) {
  World world = small_robot();
  world.objects = {movable_object("ball")};
  world.objects[0].inertia = {};
  EXPECT_THAT(input_error([&] { compile(world); }), testing::HasSubstr("object 'ball'"));
  world = small_robot();
  world.robot.links[2].inertia = {};
  world.robot.links[3].inertia = {};
  EXPECT_THAT(input_error([&] { compile(world); }),
              testing::AllOf(testing::StartsWith("r.urdf:1: link 'shin1'"), testing::HasSubstr("positive mass")));
  world = small_robot();
  world.robot.links[0].inertia = MassMoments::from_inertia(1, Vec3::Zero(), Vec3(1, 1, 2.5).asDiagonal());
  EXPECT_THAT(input_error([&] { compile(world); }),
              testing::AllOf(testing::HasSubstr("link 'torso'"), testing::HasSubstr("triangle inequality")));
}

// Two parts of one name could not be told apart in contacts.
TEST(Compile, RefusesTwoPartsOfOneName) {
  World world = small_robot();
  world.objects = {fixed_object("torso")};
  EXPECT_THAT(input_error([&] { compile(world); }), testing::HasSubstr("'torso'"));
}

// Joints start where they are told to, else at 0, or at the limit nearest to it; movable objects at their poses.
TEST(InitialState, JointsAndObjects) {
  World world = small_robot();
  world.robot.joints[0].lower = 0.5;
  world.robot.joints[0].upper = 1;
  world.initial.joint_position["knee1"] = 0.7;
  world.initial.joint_velocity["knee1"] = -2;
  world.initial.angular_velocity = {1, 2, 3};
  world.initial.linear_velocity = {4, 5, 6};
  world.objects = {fixed_object("ground"), movable_object("ball")};
  world.objects[1].X_WO.translation() = Vec3(7, 8, 9);
  const Model model = compile(world);
  const State state = initial_state(world, model);
  EXPECT_EQ(state.q[model.bodies[model.joint("hip1")].q], 0.5);
  EXPECT_EQ(state.q[model.bodies[model.joint("knee1")].q], 0.7);
  EXPECT_EQ(state.v[model.bodies[model.joint("knee1")].v], -2);
  EXPECT_EQ(state.q[model.bodies[model.joint("hip2")].q], 0);
  EXPECT_EQ(Vec3(state.v.head<3>()), Vec3(1, 2, 3));
  EXPECT_EQ(Vec3(state.v.segment<3>(3)), Vec3(4, 5, 6));
  EXPECT_EQ(Vec3(state.q.tail<3>()), Vec3(7, 8, 9));
  EXPECT_EQ(model.bodies.back().name, "ball");
}

// Channels are Figure 15's, group by group in the order of the actuated joints, and two for each link that can touch; a
// fixed base has none of its own.
TEST(Channels, AreInFigure15sOrder) {
  World world = small_robot();
  const std::vector<std::string> names = channel_names(world.robot);
  std::size_t touching = 0;
  for (const Link& link : world.robot.links) touching += link.collisions.empty() ? 0 : 1;
  ASSERT_GT(touching, 0u);
  EXPECT_EQ(names.size(), 3 * 4 + 4 + 18 + 4 + 2 * touching);
  EXPECT_EQ(names[0], "sensor.encoder.hip1.position");
  EXPECT_EQ(names[5], "sensor.encoder.knee1.velocity");
  EXPECT_EQ(names[12], "sensor.torque.hip1");
  EXPECT_EQ(names[16], "sensor.imu.linear.x");
  EXPECT_EQ(names[37], "actuator.torque.knee2");
  EXPECT_TRUE(names[38].starts_with("sensor.contact.") && names[38].ends_with(".missed")) << names[38];
  EXPECT_TRUE(names.back().ends_with(".false")) << names.back();
  world.robot.floating_base = false;
  EXPECT_EQ(channel_names(world.robot).size(), 5 * 4 + 2 * touching);
}

}  // namespace
}  // namespace graze
