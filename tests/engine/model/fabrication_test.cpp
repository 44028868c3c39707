#include "engine/model/fabrication.h"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <numbers>

#include "tests/engine/model/support.h"

namespace graze {
namespace {

constexpr double kPi = std::numbers::pi;

using Values = std::vector<std::pair<std::string, double>>;

Particle fabricate(const World& world, const Values& values) {
  std::vector<std::string> paths;
  std::vector<double> numbers;
  for (const auto& [path, value] : values) {
    paths.push_back(path);
    numbers.push_back(value);
  }
  return Fabricator(std::make_shared<World>(world), paths).fabricate(7, numbers);
}

const Body& body(const Model& model, const std::string& joint) { return model.bodies[model.joint(joint)]; }

Pose frame_at_zero(const Model& model, const std::string& link) {
  State state{Eigen::VectorXd::Zero(model.nq), Eigen::VectorXd::Zero(model.nv)};
  for (const Body& b : model.bodies) {
    if (b.type == JointType::floating) state.q[b.q] = 1;
  }
  const std::vector<Pose> X_WB = reference_poses(model, state.q);
  return frame_pose(model, X_WB, model.frame(link));
}

/// Mass, centre and inertia about the body origin of a body that is made of these parts, from their closed forms.
MassMoments parts(const std::vector<std::pair<MassMoments, Pose>>& list) {
  MassMoments sum;
  for (const auto& [moments, X] : list) sum = sum + moments.transformed(X.linear(), X.translation());
  return sum;
}

MassMoments moments_of(const Body& b) { return MassMoments::from_inertia(b.mass, b.com, b.inertia); }

void expect_same(const MassMoments& a, const MassMoments& b, double tolerance) {
  EXPECT_NEAR(a.mass, b.mass, tolerance * b.mass);
  EXPECT_LT((a.first - b.first).norm(), tolerance * b.mass * 0.1);  // links are about 0.1 m long
  EXPECT_LT((a.second - b.second).norm(), tolerance * b.second.norm());
}

Shape cylinder(double radius, double length) { return {ShapeKind::cylinder, {radius, length, 0}, nullptr, nullptr}; }
Shape sphere(double radius) { return {ShapeKind::sphere, {radius, 0, 0}, nullptr, nullptr}; }

Pose along_x(double x) {
  Pose X = Pose::Identity();
  X.linear() = rotation_from_rpy({0, kPi / 2, 0});
  X.translation().x() = x;
  return X;
}

// Figure 15's list of the quadruped can be addressed one by one: density, length and radius of hips, thighs, shins and
// feet, axes, initial state, lag, and every channel of noise.
TEST(ParameterTable, HoldsFigure15) {
  const ParameterTable table(links_world());
  const std::vector<std::pair<std::string, int>> expected = {
      {"robot.link.BODY0.density", 1},
      {"robot.link.*_{LEG_1,LEG_2,LEG_3,FOOT}.density", 16},
      {"robot.link.*_LEG_{1,2,3}.length", 12},
      {"robot.link.*_{LEG_1,LEG_2,LEG_3,FOOT}.radius", 16},
      {"robot.joint.*.axis.{tilt,heading}", 24},
      {"contact.{friction,restitution,model}", 3},
      {"initial.base.{x,y,z,roll,pitch,yaw}", 6},
      {"initial.joint.*.position", 12},
      {"initial.base.velocity.{x,y,z,roll,pitch,yaw}", 6},
      {"initial.joint.*.velocity", 12},
      {"control.lag", 1},
      {"sensor.encoder.*.{position,velocity,acceleration}", 36},
      {"sensor.torque.*", 12},
      {"sensor.imu.{linear,angular}.*", 6},
      {"sensor.gps.{x,y}", 2},
      {"sensor.magnetometer.*", 3},
      {"sensor.estimate.*", 7},
      {"actuator.torque.*", 12},
  };
  for (const auto& [pattern, count] : expected) {
    EXPECT_EQ(static_cast<int>(table.match(pattern).size()), count) << pattern;
  }
  EXPECT_EQ(table.find("robot.link.LF_FOOT.length"), nullptr);
  EXPECT_NEAR(table.find("robot.link.LF_LEG_3.density")->nominal, 1100, 1e-6);
  EXPECT_TRUE(table.find("control.lag")->transient);
  EXPECT_FALSE(table.find("robot.link.BODY0.mass")->transient);
}

// Paths are unique, and each is found by itself.
TEST(ParameterTable, PathsAreUnique) {
  const ParameterTable table(links_world());
  for (const Parameter& parameter : table.all()) EXPECT_EQ(table.match(parameter.path).size(), 1u) << parameter.path;
}

// A pattern that matches nothing is answered by one that matches something near.
TEST(ParameterTable, SuggestsTheNearestPath) {
  const ParameterTable table(links_world());
  EXPECT_EQ(table.suggest("robot.link.*_LEG_3.lenght"), "robot.link.*_LEG_3.length");
  EXPECT_EQ(table.suggest("robot.lnk.BODY0.density"), "robot.link.BODY0.density");
  EXPECT_EQ(table.suggest("control.lagg"), "control.lag");
}

// A name with a pattern's own characters does not match itself: there is still an end, with some answer.
TEST(ParameterTable, SuggestsOnceWhereNamesLookLikePatterns) {
  World world = links_world();
  world.objects[0].name = "{a,b}";
  const ParameterTable table(world);
  EXPECT_THAT(table.suggest("environment.{a,x}.friction"), testing::StartsWith("environment."));
  EXPECT_THAT(table.suggest("environment.{a,b}.friction"), testing::StartsWith("environment."));
}

// Every parameter set to its nominal value gives the nominal particle (to rounding), in any order.
TEST(Fabrication, NominalValuesGiveTheNominalParticle) {
  const World world = links_world();
  const ParameterTable table(world);
  Values values;
  for (const Parameter& p : table.all()) {
    if (!p.path.ends_with(".mass")) values.emplace_back(p.path, p.nominal);
  }
  const Particle particle = fabricate(world, values);
  const Particle nominal = Fabricator(std::make_shared<World>(world), {}).nominal();
  ASSERT_EQ(particle.model.bodies.size(), nominal.model.bodies.size());
  for (std::size_t i = 0; i < nominal.model.bodies.size(); ++i) {
    expect_same(moments_of(particle.model.bodies[i]), moments_of(nominal.model.bodies[i]), 1e-13);
    EXPECT_TRUE(particle.model.bodies[i].axis.isApprox(nominal.model.bodies[i].axis, 1e-15));
  }
  ASSERT_EQ(particle.model.pairs.size(), nominal.model.pairs.size());
  EXPECT_TRUE(particle.initial.q.isApprox(nominal.initial.q, 1e-14));
  EXPECT_EQ(particle.initial.v, nominal.initial.v);
}

// A shin of another length, radius and density is the homogeneous cylinder of those numbers, its foot sits at its new
// end, and the foot's own density and radius do the same for the sphere.
TEST(Fabrication, ShinIsTheHomogeneousCylinderOfItsNewSize) {
  const double length = 0.113, radius = 0.0071, density = 1234, foot_radius = 0.0101, foot_density = 987;
  const Particle p = fabricate(links_world(), {{"robot.link.LF_LEG_3.radius", radius},
                                               {"robot.link.LF_FOOT.density", foot_density},
                                               {"robot.link.LF_LEG_3.length", length},
                                               {"robot.link.LF_FOOT.radius", foot_radius},
                                               {"robot.link.LF_LEG_3.density", density}});
  Pose X_foot = Pose::Identity();
  X_foot.translation().x() = length;
  const MassMoments expected = parts({{MassMoments::of_shape(cylinder(radius, length), density), along_x(length / 2)},
                                      {MassMoments::of_shape(sphere(foot_radius), foot_density), X_foot}});
  // The URDF carries 10 to 12 digits.
  expect_same(moments_of(body(p.model, "LF_Y_3")), expected, 1e-9);
  const Collider& shin = p.model.colliders[p.model.collider("LF_LEG_3")];
  const Collider& foot = p.model.colliders[p.model.collider("LF_FOOT")];
  EXPECT_NEAR(shin.shape.size.x(), radius, 1e-15);
  EXPECT_NEAR(shin.shape.size.y(), length, 1e-15);
  EXPECT_TRUE(shin.X_BG.translation().isApprox(Vec3(length / 2, 0, 0), 1e-12));
  EXPECT_NEAR(foot.shape.size.x(), foot_radius, 1e-15);
  EXPECT_TRUE(foot.X_BG.translation().isApprox(Vec3(length, 0, 0), 1e-12));
}

// A longer hip moves everything that hangs on it along the hip's direction, a longer thigh along the thigh's, and
// nothing of the other legs.
TEST(Fabrication, LengthsMoveWhatHangsOnTheLink) {
  const World world = links_world();
  const Model nominal = compile(world);
  const Particle p = fabricate(world, {{"robot.link.LH_LEG_1.length", 0.028}, {"robot.link.LH_LEG_2.length", 0.07}});
  const Vec3 hip = Vec3(-25, 0, -6.5).normalized();
  const auto moved = [&](const std::string& link) {
    return Vec3(frame_at_zero(p.model, link).translation() - frame_at_zero(nominal, link).translation());
  };
  EXPECT_LT(moved("LH_LEG_1").norm(), 1e-15);
  EXPECT_LT((moved("LH_LEG_2") - 0.003 * hip).norm(), 1e-9);
  EXPECT_LT((moved("LH_LEG_3") - 0.003 * hip - Vec3(0.007, 0, 0)).norm(), 1e-9);
  EXPECT_LT((moved("LH_FOOT") - 0.003 * hip - Vec3(0.007, 0, 0)).norm(), 1e-9);
  EXPECT_LT(moved("RH_FOOT").norm(), 1e-15);
}

// The base box carries its hips at its corners (x/2, y/2, -z/2), as the authors' sampler does, and weighs density times
// volume.
TEST(Fabrication, HipsFollowTheBaseBox) {
  const Particle p = fabricate(links_world(), {{"robot.link.BODY0.size.z", 0.06},
                                               {"robot.link.BODY0.size.x", 0.17},
                                               {"robot.link.BODY0.density", 1500},
                                               {"robot.link.BODY0.size.y", 0.07}});
  for (const char* leg : {"LF", "RF", "LH", "RH"}) {
    const Vec3 hip = frame_at_zero(p.model, std::string(leg) + "_LEG_1").translation();
    EXPECT_TRUE(hip.isApprox(Vec3(leg[1] == 'F' ? 0.085 : -0.085, leg[0] == 'L' ? 0.035 : -0.035, -0.03), 1e-12));
  }
  const Shape box{ShapeKind::box, {0.17, 0.07, 0.06}, nullptr, nullptr};
  expect_same(moments_of(p.model.bodies[0]), MassMoments::of_shape(box, 1500), 1e-11);
}

// A given mass is the mass, whatever the size; the inertia keeps the shape's proportions. The centre of mass is moved
// without turning the body into another.
TEST(Fabrication, MassAndCentreOfMass) {
  const Particle p =
      fabricate(links_world(),
                {{"robot.link.BODY0.mass", 2}, {"robot.link.BODY0.size.x", 0.2}, {"robot.link.BODY0.com.y", 0.01}});
  const Shape box{ShapeKind::box, {0.2, 0.08, 0.05}, nullptr, nullptr};
  const MassMoments expected = MassMoments::of_shape(box, 2 / box.volume());
  const Body& base = p.model.bodies[0];
  EXPECT_NEAR(base.mass, 2, 1e-15);
  EXPECT_TRUE(base.com.isApprox(Vec3(0, 0.01, 0), 1e-12));
  EXPECT_TRUE(base.inertia.isApprox(expected.inertia_about_com(), 1e-11));
  EXPECT_THAT(input_error([] {
                fabricate(links_world(), {{"robot.link.BODY0.mass", 1}, {"robot.link.BODY0.density", 1}});
              }),
              testing::HasSubstr("only one of them"));
}

// A capsule, which is no affine image of another capsule, still comes out as the homogeneous capsule of its new size.
TEST(Fabrication, CapsuleKeepsItsMoments) {
  World world;
  world.robot = parse_urdf(R"(<robot name="r"><link name="base"><collision><geometry><sphere radius="0.1"/></geometry>
      </collision></link><link name="arm"><collision><origin xyz="0 0 0.2"/><geometry>
      <capsule radius="0.03" length="0.4"/></geometry></collision></link>
      <joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>)",
                           "r.urdf");
  const Particle p = fabricate(world, {{"robot.link.arm.length", 0.55}, {"robot.link.arm.radius", 0.02}});
  const Shape capsule{ShapeKind::capsule, {0.02, 0.55, 0}, nullptr, nullptr};
  Pose X = Pose::Identity();
  X.translation().z() = 0.275;  // the end at the joint stays
  expect_same(moments_of(body(p.model, "j")), parts({{MassMoments::of_shape(capsule, 1000), X}}), 1e-12);
}

// The order in which parameters are given does not matter beyond rounding.
TEST(Fabrication, OrderDoesNotMatter) {
  Values values = {{"robot.link.RF_LEG_2.length", 0.08},
                   {"robot.link.RF_LEG_2.radius", 0.011},
                   {"robot.link.RF_LEG_2.density", 1011},
                   {"robot.link.BODY0.size.x", 0.16},
                   {"robot.link.RF_LEG_2.com.x", 0.04},
                   {"robot.joint.RF_Y_3.axis.tilt", 0.02},
                   {"robot.joint.RF_Y_3.axis.heading", 2},
                   {"initial.base.z", 0.003},
                   {"initial.base.roll", 0.1}};
  const Particle a = fabricate(links_world(), values);
  std::reverse(values.begin(), values.end());
  const Particle b = fabricate(links_world(), values);
  for (std::size_t i = 0; i < a.model.bodies.size(); ++i) {
    expect_same(moments_of(a.model.bodies[i]), moments_of(b.model.bodies[i]), 1e-14);
    EXPECT_TRUE(a.model.bodies[i].axis.isApprox(b.model.bodies[i].axis, 1e-15));
  }
  EXPECT_TRUE(a.initial.q.isApprox(b.initial.q, 1e-14));
}

// A tilted axis makes exactly the angle `tilt` with the nominal one, and `heading` turns it about the nominal axis.
TEST(Fabrication, AxisIsTiltedOnACone) {
  const World world = links_world();
  const double tilt = 0.03;
  std::vector<Vec3> axes;
  for (double heading : {0.0, kPi / 2, kPi}) {
    const Particle p =
        fabricate(world, {{"robot.joint.LF_Y_2.axis.tilt", tilt}, {"robot.joint.LF_Y_2.axis.heading", heading}});
    axes.push_back(body(p.model, "LF_Y_2").axis);
    EXPECT_NEAR(axes.back().norm(), 1, 1e-15);
    EXPECT_NEAR(std::acos(axes.back().y()), tilt, 1e-12);
  }
  const Vec3 a = axes[0] - axes[0].y() * Vec3::UnitY(), b = axes[1] - axes[1].y() * Vec3::UnitY();
  EXPECT_NEAR(a.dot(b), 0, 1e-15);
  EXPECT_TRUE((axes[0] + axes[2]).isApprox(2 * std::cos(tilt) * Vec3::UnitY(), 1e-12));
}

// A joint that is placed elsewhere takes all that hangs on it along, and nothing else; on a link that is longer, too,
// it is where it would be if the link had grown with the joint on it.
TEST(Fabrication, PlacedJointsTakeAlongWhatHangsOnThem) {
  const World world = links_world();
  const auto poses = [](const Particle& p) { return reference_poses(p.model, p.initial.q); };
  const std::vector<Pose> before = poses(Fabricator(std::make_shared<World>(world), {}).nominal());
  const Joint& hip = *std::find_if(world.robot.joints.begin(), world.robot.joints.end(),
                                   [](const Joint& one) { return one.name == "LF_X_1"; });
  const Vec3 shift(0.01, -0.02, 0.03);
  std::vector<std::pair<std::string, double>> values;
  const char* const axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    values.push_back({std::string("robot.joint.LF_X_1.origin.") + axes[k], hip.X_PJ.translation()[k] + shift[k]});
  }
  const Particle moved = fabricate(world, values);
  const std::vector<Pose> after = poses(moved);
  const Vec3 base = after[0].translation() - before[0].translation();  // it stands on the ground otherwise
  for (std::size_t i = 1; i < after.size(); ++i) {
    const bool hangs = moved.model.bodies[i].name.starts_with("LF_");
    const Vec3 by = after[i].translation() - before[i].translation() - base;
    EXPECT_TRUE(by.isApprox(before[0].linear() * (hangs ? shift : Vec3(Vec3::Zero())), 1e-12) || by.norm() < 1e-15)
        << moved.model.bodies[i].name;
    EXPECT_EQ(hangs, by.norm() > 1e-9) << moved.model.bodies[i].name;
  }
}

// The perturbed robot stands on the ground before the offset in z is added; the other offsets add to the scenario's.
TEST(Fabrication, InitialOffsets) {
  World world = links_world();
  world.initial.position = {1, 2, 0};
  world.initial.linear_velocity = {0.1, 0, 0};
  const Particle p = fabricate(world, {{"robot.link.RH_LEG_3.length", 0.12},
                                       {"initial.base.x", 0.01},
                                       {"initial.base.z", 0.005},
                                       {"initial.base.yaw", 0.2},
                                       {"initial.base.velocity.x", 0.02},
                                       {"initial.joint.LF_Y_2.position", 0.05},
                                       {"initial.joint.LF_Y_2.velocity", -0.3}});
  const std::vector<Pose> X_WB = reference_poses(p.model, p.initial.q);
  EXPECT_NEAR(lowest_point(p.model, X_WB), 0.005, 1e-12);
  EXPECT_NEAR(p.initial.q[4], 1.01, 1e-15);
  EXPECT_NEAR(rpy_from_rotation(X_WB[0].linear()).z(), 0.2, 1e-12);
  EXPECT_NEAR(p.initial.v[3], 0.12, 1e-15);
  const Body& thigh = body(p.model, "LF_Y_2");
  EXPECT_NEAR(p.initial.q[thigh.q], 0.85, 1e-15);
  EXPECT_NEAR(p.initial.v[thigh.v], -0.3, 1e-15);
}

// What a particle carries besides its model: encoder zeros, biases, lag, contact, environment.
TEST(Fabrication, TheRestOfAParticle) {
  World world = links_world();
  Object ball;
  ball.name = "ball";
  ball.shape = sphere(0.1);
  ball.movable = true;
  ball.inertia = MassMoments::of_shape(ball.shape, 500);
  world.objects.push_back(ball);
  world.sensor_bias["sensor.gps.x"] = 0.5;
  const Particle p = fabricate(world, {{"robot.joint.RF_X_1.zero", 0.01},
                                       {"control.lag", 0.02},
                                       {"sensor.gps.y", -0.25},
                                       {"environment.ball.radius", 0.2},
                                       {"environment.ball.density", 250},
                                       {"environment.ground.friction", 0.5},
                                       {"environment.ground.rotation.roll", 0.1},
                                       {"contact.friction", 0.7}});
  EXPECT_EQ(p.joint_zero[3], 0.01);
  EXPECT_EQ(p.control_lag, 0.02);
  const std::vector<std::string> names = channel_names(world.robot);
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(p.sensor_bias[i], names[i] == "sensor.gps.x" ? 0.5 : names[i] == "sensor.gps.y" ? -0.25 : 0) << names[i];
  }
  expect_same(moments_of(p.model.bodies.back()), MassMoments::of_shape(sphere(0.2), 250), 1e-12);
  const Collider& ground = p.model.colliders[p.model.collider("ground")];
  EXPECT_TRUE(ground.X_BG.linear().isApprox(rotation_from_rpy({0.1, 0, 0}), 1e-15));
  for (const ColliderPair& pair : p.model.pairs) {
    const bool has_ground = p.model.colliders[pair.a].name == "ground" || p.model.colliders[pair.b].name == "ground";
    const bool has_ball = p.model.colliders[pair.b].name == "ball";
    EXPECT_EQ(pair.friction, has_ground ? 0.5 : 0.7) << has_ball;
  }
}

// Springs can be addressed where some contact model has them. What is not drawn follows the mass that was.
TEST(Fabrication, SpringsOfContacts) {
  World world = links_world();
  EXPECT_EQ(ParameterTable(world).find("contact.stiffness"), nullptr);
  world.contact_models = {"rigid", kCompliant};
  world.objects[0].spring.damping = 40;
  const ParameterTable table(world);
  const Spring derived = default_spring(world.moving_mass());
  EXPECT_DOUBLE_EQ(derived.stiffness * 0.5e-3, world.moving_mass() * 9.81);
  EXPECT_DOUBLE_EQ(std::pow(derived.damping, 2), 4 * derived.stiffness * world.moving_mass());
  EXPECT_EQ(table.find("contact.stiffness")->nominal, derived.stiffness);
  EXPECT_EQ(table.find("contact.damping")->nominal, derived.damping);
  EXPECT_EQ(table.find("environment." + world.objects[0].name + ".damping")->nominal, 40);
  const auto spring = [&](const std::vector<std::pair<std::string, double>>& values) {
    const Model model = fabricate(world, values).model;
    for (const ColliderPair& pair : model.pairs) {
      if (model.colliders[pair.b].name == world.objects[0].name) return default_spring(moving_mass(model), pair.spring);
    }
    return Spring{};
  };
  const double heavier = 1.5 * world.robot.link("BODY0").inertia.mass;
  const double mass = moving_mass(fabricate(world, {{"robot.link.BODY0.mass", heavier}}).model);
  EXPECT_GT(mass, world.moving_mass());
  EXPECT_EQ(spring({{"robot.link.BODY0.mass", heavier}}).stiffness, default_spring(mass).stiffness);
  EXPECT_EQ(spring({{"robot.link.BODY0.mass", heavier}}).damping, 40);
  EXPECT_EQ(spring({{"contact.stiffness", 700}, {"contact.damping", 3}}).stiffness, 700);
  EXPECT_EQ(spring({{"contact.stiffness", 700}, {"contact.damping", 3}}).damping, 40);
  EXPECT_EQ(spring({{"environment." + world.objects[0].name + ".damping", 8}}).damping, 8);
  EXPECT_EQ(input_error([&] {
              fabricate(world, {{"contact.stiffness", 0}});
            }),
            "contact.stiffness: 0 N/m: must be >= 1e-06");
}

// Impossible values are refused with the parameter's name, the value and the rule.
TEST(Fabrication, RefusesImpossibleValues) {
  const auto refusal = [](const std::string& path, double value) {
    return input_error([&] { fabricate(links_world(), {{path, value}}); });
  };
  EXPECT_EQ(refusal("robot.link.LF_LEG_3.length", -0.1), "robot.link.LF_LEG_3.length: -0.1 m: must be > 0");
  EXPECT_EQ(refusal("robot.link.BODY0.density", 0), "robot.link.BODY0.density: 0 kg/m^3: must be > 0");
  EXPECT_EQ(refusal("contact.restitution", 1.5), "contact.restitution: 1.5: must be <= 1");
  EXPECT_EQ(refusal("control.lag", -0.001), "control.lag: -0.001 s: must be >= 0");
  EXPECT_THAT(refusal("gravity.z", NAN), testing::HasSubstr("finite"));
  EXPECT_THAT(refusal("contact.model", 1), testing::HasSubstr("contact.model"));
  EXPECT_THAT(refusal("robot.link.LF_LEG_3.lenght", 0.1), testing::HasSubstr("robot.link.LF_LEG_3.length"));
}

/// A value somewhere about the nominal one: geometry and mass within a factor of 0.3 to 3, the rest by up to 1.
double wild(const Parameter& p, std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  if (!p.choices.empty()) return 0;
  if (p.strict) return p.nominal * std::pow(3.0, u(random));
  return std::clamp((std::isfinite(p.nominal) ? p.nominal : 1) + u(random), p.lower, p.upper);
}

// However wildly all parameters of LINKS are drawn at once, the particle is physical (compile() checks every body),
// keeps the numbering, stands where it should, and its mass is the sum of density times volume.
TEST(Fabrication, EveryParticleIsPhysical) {
  const World world = links_world();
  const ParameterTable table(world);
  std::vector<std::string> paths;
  std::vector<const Parameter*> parameters;
  for (const Parameter& p : table.all()) {
    if (p.path.ends_with(".mass") || p.path.find(".com.") != std::string::npos) continue;
    paths.push_back(p.path);
    parameters.push_back(&p);
  }
  const Fabricator fabricator(std::make_shared<World>(world), paths);
  const Model nominal = compile(world);
  std::mt19937 random(2);
  for (int i = 0; i < 1000; ++i) {
    std::vector<double> values;
    for (const Parameter* p : parameters) values.push_back(wild(*p, random));
    const Particle particle = fabricator.fabricate(i, values);
    ASSERT_EQ(particle.model.nv, nominal.nv);
    ASSERT_EQ(particle.model.pairs.size(), nominal.pairs.size());
    double mass = 0, expected = 0;
    for (const Body& b : particle.model.bodies) {
      mass += b.mass;
      const Vec3 I = Eigen::SelfAdjointEigenSolver<Mat3>(b.inertia, Eigen::EigenvaluesOnly).eigenvalues();
      ASSERT_GT(I[0], 0);
      ASSERT_GE(I[0] + I[1], I[2] * (1 - 1e-9));
    }
    for (const Collider& c : particle.model.colliders) {
      if (c.is_object) continue;
      const auto density = std::find(paths.begin(), paths.end(), "robot.link." + c.link + ".density");
      expected += c.shape.volume() * values[density - paths.begin()];
    }
    ASSERT_NEAR(mass, expected, 1e-10 * expected);
  }
}

// The same values give the same bits, whatever was fabricated before.
TEST(Fabrication, IsDeterministic) {
  const World world = links_world();
  const Fabricator fabricator(std::make_shared<World>(world), {"robot.link.LF_LEG_3.length", "initial.base.roll"});
  const std::vector<double> values = {0.111, 0.02}, others = {0.09, -0.3};
  const Particle first = fabricator.fabricate(1, values);
  fabricator.fabricate(2, others);
  const Particle again = fabricator.fabricate(1, values);
  EXPECT_EQ(first.initial.q, again.initial.q);
  for (std::size_t i = 0; i < first.model.bodies.size(); ++i) {
    EXPECT_EQ(first.model.bodies[i].inertia, again.model.bodies[i].inertia);
    EXPECT_EQ(first.model.bodies[i].X_PB.matrix(), again.model.bodies[i].X_PB.matrix());
  }
}

}  // namespace
}  // namespace graze
