// What is wrong with a URDF is told at once, and repaired where that is asked for.

#include <gmock/gmock.h>

#include "engine/model/inertia_rules.h"
#include "engine/model/urdf.h"
#include "tests/engine/model/support.h"

namespace graze {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kAnyInertia = R"(<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>)";
const std::string kSolid = R"(<inertial><mass value="1"/>)" + kAnyInertia + "</inertial>";
const std::string kBall = R"(<collision><geometry><sphere radius="0.1"/></geometry></collision>)";

std::string link(const std::string& name, const std::string& inside = kSolid) {
  return "<link name=\"" + name + "\">" + inside + "</link>\n";
}

std::string joint_of(const std::string& name, const std::string& parent, const std::string& child,
                     const std::string& type = "continuous", const std::string& inside = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/>" + inside + "</joint>\n";
}

std::string robot_of(const std::string& body) { return "<robot name=\"r\">\n" + body + "</robot>"; }

/// Two links and a joint, of the one with `inside` and of the other with `of_joint`.
std::string arm(const std::string& inside, const std::string& of_joint = "", const std::string& type = "continuous") {
  return robot_of(link("a") + link("b", inside) + joint_of("j", "a", "b", type, of_joint));
}

/// Two arms on a link, by joints j1 and j2 (lines 5 and 6) with these parts.
std::string pair(const std::string& of_first, const std::string& of_second) {
  return robot_of(link("a") + link("b") + link("c") + joint_of("j1", "a", "b", "continuous", of_first) +
                  joint_of("j2", "a", "c", "continuous", of_second));
}

std::string limit(double lower, double upper) {
  return "<limit lower=\"" + std::to_string(lower) + "\" upper=\"" + std::to_string(upper) +
         "\" effort=\"1\" velocity=\"1\"/>";
}

std::string inertial(const std::string& mass, const std::string& xx, const std::string& yy, const std::string& zz) {
  return "<inertial><mass value=\"" + mass + "\"/><inertia ixx=\"" + xx + "\" ixy=\"0\" ixz=\"0\" iyy=\"" + yy +
         "\" iyz=\"0\" izz=\"" + zz + "\"/></inertial>";
}

struct Read {
  Robot robot;
  std::vector<std::string> told;
  std::string document;
};

Read repaired(const std::string& xml, const std::string& name = "r.urdf") {
  Read out;
  UrdfOptions options;
  options.repair = true;
  options.warn = [&](const std::string& text) { out.told.push_back(text); };
  options.read = [&](const std::string& text) { out.document = text; };
  out.robot = parse_urdf(xml, name, options);
  return out;
}

/// The numbers of a robot that a model is made of, in order.
std::vector<double> numbers_of(const Robot& robot) {
  std::vector<double> out;
  const auto add = [&](const auto& matrix) { out.insert(out.end(), matrix.data(), matrix.data() + matrix.size()); };
  out.push_back(robot.floating_base);
  for (const Link& one : robot.links) {
    out.push_back(one.inertia.mass);
    add(one.inertia.first);
    add(one.inertia.second);
    for (const Geometry& shape : one.collisions) {
      out.push_back(static_cast<double>(shape.shape.kind));
      add(shape.shape.size);
      add(shape.X_LG.matrix());
      if (!shape.shape.mesh) continue;
      for (const Vec3& vertex : shape.shape.mesh->vertices) add(vertex);
    }
  }
  for (const Joint& one : robot.joints) {
    add(one.X_PJ.matrix());
    add(one.axis);
    for (double value : {one.lower, one.upper, one.effort, one.velocity, one.damping, one.friction})
      out.push_back(value);
    out.push_back(static_cast<double>(one.type));
  }
  return out;
}

/// The repaired document needs no repair, and gives the same robot to the bit.
void expect_sound(const Read& read) {
  UrdfOptions options;
  options.warn = [](const std::string& text) { EXPECT_THAT(text, Not(HasSubstr("repaired"))); };
  EXPECT_EQ(numbers_of(parse_urdf(read.document, "r.urdf", options)), numbers_of(read.robot)) << read.document;
}

struct Case {
  const char* name;
  std::string xml;
  int line;
  std::string problem, repair;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"one_factor", arm(kSolid + "<visual><geometry><mesh filename=\"m\" scale=\"2\"/></geometry></visual>"), 3,
       "link 'b': <mesh> scale: \"2\" has 1 number; it needs 3", "takes it for all 3 axes"},
      {"four_factors", arm(kSolid + "<visual><geometry><mesh filename=\"m\" scale=\"1 2 3 1\"/></geometry></visual>"),
       3, "link 'b': <mesh> scale: \"1 2 3 1\" has 4 numbers; it needs 3", "takes the first 3"},
      {"one_angle", arm(kSolid, "<origin rpy=\"1\"/>"), 4, "joint 'j': <origin> rpy: \"1\" has 1 number; it needs 3",
       "takes 0 for those that lack"},
      {"four_angles", arm(kSolid, "<origin rpy=\"1 2 3 4\"/>"), 4, "has 4 numbers", "takes the first 3"},
      {"blank_place", arm(kSolid, "<origin xyz=\"\"/>"), 4, "<origin> needs a non-empty xyz", "takes \"0 0 0\""},
      {"point", arm(kSolid + "<collision><geometry><sphere radius=\"0\"/></geometry></collision>"), 3,
       "link 'b': <sphere> radius: 0 is not positive", "takes 0.001 m"},
      {"sheet", arm(kSolid + "<collision><geometry><box size=\"1 0 1\"/></geometry></collision>"), 3,
       "link 'b': <box> size: 0 is not positive", "takes 0.001 m"},
      {"odd_picture", arm(kSolid + "<visual><geometry><cone/></geometry></visual>"), 3, "unknown shape <cone>",
       "leaves the picture out"},
      {"empty_picture", arm(kSolid + "<visual><geometry/></visual>"), 3, "empty <geometry>", "leaves the picture out"},
      {"no_file", arm(kSolid + "<collision><geometry><mesh filename=\"m\"/></geometry></collision>"), 3,
       "collision mesh 'm' is not there", "leaves this shape out"},
      {"triangle", arm(inertial("1", "1", "1", "2.6")), 3, "link 'b': <inertia>: principal moments 1, 1, 2.6",
       "takes the nearest inertia of a rigid body (in the Frobenius norm), 1.2, 1.2, 2.4 kg m^2"},
      {"negative", arm(inertial("1", "-1", "1", "1")), 3, "none may be negative", "takes the nearest inertia"},
      {"point_mass", arm(inertial("2", "0", "0", "0") + ""), 3, "principal moments of inertia 0, 0, 0 kg m^2",
       "takes for link 'b' the inertia of a ball at 1000 kg/m^3 with its mass, 2 kg"},
      {"turned_point_mass", arm(inertial("2", "1e-28", "-2e-28", "0")), 3,
       "principal moments of inertia 0, 0, 0 kg m^2",
       "takes for link 'b' the inertia of a ball at 1000 kg/m^3 with its mass, 2 kg"},
      {"point_mass_off_origin",
       arm("<inertial><origin xyz=\"2.3e-7 3.3e-5 8.6e-6\"/><mass value=\"0.179\"/><inertia ixx=\"0\" ixy=\"0\" "
           "ixz=\"0\" "
           "iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial>"),
       3, "all must be positive", "takes for link 'b' the inertia of a ball"},
      {"point_mass_with_shape", arm(inertial("2", "0", "0", "0") + kBall), 3, "principal moments of inertia 0, 0, 0",
       "takes for link 'b' the inertia of its collision shapes with its mass, 2 kg"},
      {"point_mass_with_point",
       arm(inertial("2", "0", "0", "0") + "<collision><geometry><sphere radius=\"0.001\"/></geometry></collision>"), 3,
       "principal moments of inertia 0, 0, 0", "takes for link 'b' the inertia of a ball at 1000 kg/m^3"},
      {"rod", arm(inertial("1", "0", "1", "1")), 3, "principal moments of inertia 0, 1, 1", "adds 1e-06 of their sum"},
      {"massless", arm(""), 3, "link 'b': mass 0", "makes up a ball of 0.001 kg for link 'b'"},
      {"massless_with_shape", arm(inertial("0", "1", "1", "1") + kBall), 3, "link 'b': mass 0",
       "makes up 4.19 kg for link 'b' from its collision shapes at 1000 kg/m^3"},
      {"no_matrix", arm("<inertial><mass value=\"1\"/></inertial>"), 3, "<inertial> has no <inertia>",
       "takes a point mass"},
      {"no_value", arm("<inertial>" + kAnyInertia + "</inertial>" + kBall), 3, "<inertial> has no <mass>",
       "takes the link as one without <inertial>"},
      {"twice", arm(kSolid + kSolid), 3, "a second <inertial>", "takes the first"},
      {"no_products",
       arm("<inertial><mass value=\"1\"/><inertia ixx=\"1\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>"
           "</inertial>"),
       3, "<inertia> needs a non-empty ixy", "takes 0"},
      {"no_world", robot_of(link("a") + joint_of("j", "world", "a", "fixed")), 3, "parent link 'world' is not there",
       "writes <link name=\"world\"/>"},
      {"no_parent", robot_of(link("finger") + joint_of("j", "left_hand", "finger", "fixed")), 3,
       "parent link 'left_hand' is not there", "writes <link name=\"left_hand\"/>"},
      {"no_name", "<robot>" + link("a") + "</robot>", 1, "<robot> needs a non-empty name", "takes the file's, 'r'"},
      {"left_macro",
       "<!-- autogenerated by xacro from r.xacro -->\n<robot name=\"r\">" +
           link("a", kSolid + "<visual><geometry><box size=\"1 1 1\"/></geometry>\n<xacro:grey/></visual>") +
           "</robot>",
       3, "<xacro:grey>: a call of a macro that xacro did not know", "leaves it out"},
      {"comma", arm(kSolid, "<origin xyz=\"0.07, 0, 0.1\"/>"), 4, "<origin> xyz: '0.07,' is not a number",
       "takes 0.07"},
      {"full_stop", arm(kSolid, "<limit lower=\"-1.57.\" upper=\"2\" effort=\"1\" velocity=\"1\"/>", "revolute"), 4,
       "<limit> lower: '-1.57.' is not a number", "takes -1.57"},
      {"no_limit", arm(kSolid, "", "revolute"), 4, "a revolute joint needs <limit", "makes it continuous"},
      {"no_slide_limit", arm(kSolid, "", "prismatic"), 4, "a prismatic joint needs <limit", "writes bounds of 1e+06 m"},
      {"swapped", arm(kSolid, "<limit lower=\"2\" upper=\"1\" effort=\"1\" velocity=\"1\"/>", "revolute"), 4,
       "lower 2 is above upper 1", "swaps them"},
      {"no_effort", arm(kSolid, "<limit lower=\"1\" upper=\"2\" velocity=\"1\"/>", "revolute"), 4,
       "<limit> needs a non-empty effort", "writes 1000000000, which is no limit"},
      {"negative_effort", arm(kSolid, "<limit effort=\"-1\" velocity=\"1\"/>"), 4,
       "joint 'j': <limit> effort: -1 is negative; it must be >= 0", "writes 1000000000, which is no limit"},
      {"no_bound", arm(kSolid, "<limit effort=\"1\" velocity=\"inf\"/>"), 4, "velocity: 'inf' is not a number",
       "writes 1000000000, which is no limit"},
      {"mimic_of_none", arm(kSolid, "<mimic multiplier=\"2\"/>"), 4, "<mimic> names no joint", "removes <mimic>"},
      {"mimic_of_unknown", pair("", "<mimic joint=\"k\"/>"), 6, "names the joint 'k', which is not there", "removes"},
      {"mimic_of_itself", pair("", "<mimic joint=\"j2\"/>"), 6, "a ring of joints that follow each other (j2 > j2)",
       "removes <mimic>: the joint moves on its own"},
      {"mimic_ring", pair("<mimic joint=\"j2\"/>", "<mimic joint=\"j1\"/>"), 5, "(j1 > j2 > j1)", "removes <mimic>"},
      {"mimic_of_fixed",
       robot_of(link("a") + link("b") + link("c") + joint_of("j1", "a", "b", "fixed") +
                joint_of("j2", "a", "c", "continuous", "<mimic joint=\"j1\"/>")),
       6, "names the joint 'j1', which is fixed", "removes <mimic>"},
      {"mimic_zero", pair("", "<mimic joint=\"j1\" multiplier=\"0\"/>"), 6, "multiplier: 0 lets the joint stand still",
       "removes <mimic>"},
      {"mimic_huge", pair("", "<mimic joint=\"j1\" multiplier=\"1e9\"/>"), 6, "its size must be 1e-06 to 1e+06",
       "removes <mimic>"},
      {"mimic_far", pair("", "<mimic joint=\"j1\" offset=\"1e9\"/>"), 6, "offset: 1e+09 is out of range", "removes"},
      {"mimic_of_mimic_far",
       robot_of(link("a") + link("b") + link("c") + link("d") + joint_of("j1", "a", "b", "continuous") +
                joint_of("j2", "a", "c", "continuous", "<mimic joint=\"j1\" offset=\"1e6\"/>") +
                joint_of("j3", "a", "d", "continuous", "<mimic joint=\"j2\" multiplier=\"1e3\"/>")),
       8, "offset: 1e+09 is out of range", "removes <mimic>"},
      {"mimic_no_room",
       robot_of(link("a") + link("b") + link("c") + joint_of("j1", "a", "b", "revolute", limit(0, 1)) +
                joint_of("j2", "a", "c", "revolute", limit(1, 2) + "<mimic joint=\"j1\" multiplier=\"-1\"/>")),
       6, "within its limits, 1 to 2, 'j1' would have to be from -2 to -1, which has 0 to 1", "removes <mimic>"},
      {"planar_base", robot_of(link("world", "") + link("a") + joint_of("j", "world", "a", "planar")), 4,
       "planar joints are not supported", "removes it and link 'world': the base floats"},
      {"floating_base", robot_of(link("map", "") + link("a") + joint_of("j", "map", "a", "floating")), 4,
       "a floating joint may only", "removes it and link 'map': the base floats"},
  };
  return all;
}

class Repair : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Urdf, Repair, testing::ValuesIn(cases()),
                         [](const auto& info) { return std::string(info.param.name); });

// Each is refused with its place, the rule and what a repair would do, and read with the repair, which is told; the
// document that is written then is read as it is.
TEST_P(Repair, IsTold) {
  const Case& c = GetParam();
  const std::string place = "r.urdf:" + std::to_string(c.line) + ": ";
  const std::string refusal = input_error([&] { parse_urdf(c.xml, "r.urdf"); });
  EXPECT_THAT(refusal, testing::AllOf(HasSubstr(place), HasSubstr(c.problem), HasSubstr("--repair " + c.repair)));
  const Read read = repaired(c.xml);
  EXPECT_THAT(read.told,
              Contains(testing::AllOf(StartsWith(place), HasSubstr(c.problem), HasSubstr("; repaired: " + c.repair))));
  expect_sound(read);
  World world;
  world.robot = read.robot;
  EXPECT_NO_THROW(compile(world));
}

// All problems come at once, in the order of the file, with what can be mended and what cannot.
TEST(UrdfProblems, AreAllTold) {
  const std::string xml =
      robot_of(link("a", inertial("1", "1", "1", "3")) +
               link("b", kSolid + "<collision><geometry><sphere radius=\"-1\"/></geometry></collision>") + link("c") +
               joint_of("j", "a", "b", "spherical") + joint_of("k", "b", "c", "revolute"));
  const std::string text = input_error([&] { parse_urdf(xml, "r.urdf"); });
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 5u) << text;
  EXPECT_EQ(lines[0], "r.urdf: 4 problems, 2 of which --repair ('repair: true' under 'robot') mends:");
  EXPECT_THAT(lines[1], testing::AllOf(StartsWith("  r.urdf:2: link 'a'"), HasSubstr("; --repair takes the nearest")));
  EXPECT_THAT(lines[2], testing::AllOf(StartsWith("  r.urdf:3: link 'b'"), testing::EndsWith("(no repair)")));
  EXPECT_THAT(lines[3], testing::AllOf(StartsWith("  r.urdf:5: joint 'j'"), testing::EndsWith("(no repair)")));
  EXPECT_THAT(lines[4],
              testing::AllOf(StartsWith("  r.urdf:6: joint 'k'"), HasSubstr("; --repair makes it continuous")));
  const std::string rest = input_error([&] { repaired(xml); });
  EXPECT_THAT(
      rest, testing::AllOf(StartsWith("r.urdf: 2 problems, none of which --repair can mend:"), HasSubstr("'spherical'"),
                           HasSubstr("-1 is not positive"), Not(HasSubstr("joint 'k'"))));
}

// What no rule can guess stays refused, repair or not.
TEST(UrdfProblems, SomeStay) {
  const std::vector<std::pair<std::string, std::string>> stay = {
      {arm(inertial("-1", "1", "1", "1")), "-1 is negative"},
      {arm(inertial("nan", "1", "1", "1")), "'nan' is not a number"},
      {arm(inertial("1e308", "1e308", "1e308", "1e308")), "b"},
      {arm(inertial("1e100", "1", "1", "1")), "link 'b': <mass> value: 1e+100 kg is out of range"},
      {arm(kSolid, "<axis xyz=\"0 0 0\"/>"), "no direction"},
      {arm(kSolid, "<axis xyz=\"0 1\"/>"), "has 2 numbers; it needs 3"},
      {arm(kSolid, "", "floating"), "a floating joint may only"},
      {arm(kSolid, "", "planar"), "planar joints are not supported"},
      {arm(kSolid + "<collision><geometry><cone/></geometry></collision>"), "unknown shape <cone>"},
      {robot_of(link("a") + link("b")), "both have no parent"},
      {robot_of(link("a") + joint_of("j", "a", "c")), "child link 'c' is not there"},
      {robot_of(link("a") + link("a")), "two links of this name"},
      {robot_of(link("a") + link("b") + "<joint name=\"j\" type=\"fixed\"/>"), "has no <parent>"},
      {arm(kSolid + "<collision><geometry><sphere radius=\"${r}\"/></geometry></collision>"), "xacro"},
  };
  for (const auto& [xml, part] : stay) {
    EXPECT_THAT(input_error([&, text = xml] { repaired(text); }), HasSubstr(part)) << xml;
  }
}

// The repaired inertia is the nearest that is physical: no other physical one of a random cloud about it is nearer to
// what was given, and it is physical.
// What would take a robot's joints away, or free one that is bolted down, is refused whether or not it may be repaired.
TEST(UrdfProblems, WhatNobodyCanGuessStays) {
  const std::string chain = link("a") + "<xacro:unless value=\"false\">" + link("b") +
                            joint_of("j", "a", "b", "continuous") + "</xacro:unless>";
  const std::string left = "<!-- autogenerated by xacro from r.xacro -->\n<robot name=\"r\">" + chain + "</robot>";
  EXPECT_THAT(input_error([&] { repaired(left); }),
              HasSubstr("<xacro:unless>: xacro left it, and links or joints in it"));
  for (const char* world : {"World", "world "}) {
    EXPECT_THAT(input_error([&] { repaired(robot_of(link("a") + joint_of("j", world, "a", "fixed"))); }),
                HasSubstr("did you mean 'world'"));
  }
}

TEST(NearestInertia, IsNearest) {
  std::mt19937 random(1);
  std::normal_distribution<double> n;
  for (int i = 0; i < 200; ++i) {
    Mat3 given;
    for (int k = 0; k < 9; ++k) given(k / 3, k % 3) = n(random);
    given = Mat3(given + given.transpose()) + 1.5 * Mat3::Identity();
    const Mat3 nearest = nearest_physical_inertia(given);
    if (nearest.isZero(0)) continue;
    EXPECT_EQ(inertia_problem(nearest), "");
    const double distance = (nearest - given).norm();
    for (int k = 0; k < 100; ++k) {
      Mat3 other = Mat3::Zero();  // of six random points
      for (int point = 0; point < 6; ++point) {
        const Vec3 x(n(random), n(random), n(random));
        other += x.squaredNorm() * Mat3::Identity() - x * x.transpose();
      }
      const double scale = std::max(0.0, (other.cwiseProduct(given)).sum() / other.squaredNorm());
      EXPECT_GE((scale * other - given).norm(), distance - 1e-5 * given.norm());
    }
  }
  // Physical ones stay.
  const Mat3 sound = Vec3(1, 2, 2.5).asDiagonal();
  EXPECT_LT((nearest_physical_inertia(sound) - sound).norm(), 1e-12);
}

// Mass that shapes make up is told by link, repair or not; mass of the file is not.
TEST(UrdfProblems, MadeUpMassIsTold) {
  std::vector<std::string> told;
  UrdfOptions options;
  options.warn = [&](const std::string& text) { told.push_back(text); };
  parse_urdf(arm(kBall), "r.urdf", options);
  EXPECT_THAT(told,
              testing::ElementsAre("r.urdf: mass made up from collision shapes at 1000 kg/m^3 (robot.density) for "
                                   "links without <inertial>: b 4.19 kg"));
  told.clear();
  parse_urdf(arm(kSolid + kBall), "r.urdf", options);
  EXPECT_THAT(told, IsEmpty());
}

// A base that leaves its mass to a link behind a fixed joint, as KDL wants it, gets none from its shapes, and that is
// told; a camera of a few grams is no such link, and neither is what hangs on a joint that moves.
TEST(UrdfProblems, MassOfFixedLinksStandsForABaseWithout) {
  const auto base_with = [](const std::string& type, const std::string& mass) {
    const std::string between = link("frame", "") + joint_of("f", "base", "frame", "fixed");
    std::vector<std::string> told;
    UrdfOptions options;
    options.warn = [&](const std::string& text) { told.push_back(text); };
    const Robot read = parse_urdf(robot_of(link("base", kBall) + between + link("mass", inertial(mass, "1", "1", "1")) +
                                           joint_of("j", "frame", "mass", type)),
                                  "r.urdf", options);
    return std::pair(read.link("base").inertia.mass, told);
  };
  const double made_up = 1000 * 4.0 / 3.0 * M_PI * 0.001;
  EXPECT_EQ(base_with("fixed", "1").first, 0);
  EXPECT_THAT(base_with("fixed", "1").second,
              testing::ElementsAre("r.urdf:2: link 'base' has no <inertial>, and links that are fixed to it weigh 1 "
                                   "kg: no mass is made up for it (4.19 kg by its shapes)"));
  const auto [beside_camera, of_camera] = base_with("fixed", "0.04");
  EXPECT_NEAR(beside_camera, made_up, 1e-9);
  EXPECT_THAT(of_camera, testing::ElementsAre(HasSubstr("base 4.19 kg (beside 0.04 kg of links fixed to it)")));
  EXPECT_NEAR(base_with("continuous", "1").first, made_up, 1e-9);
}

// A gear's reduction and a second axis change nothing, and are told; safety controllers and calibrations are passed
// over.
TEST(UrdfProblems, WhatIsNotUsedIsTold) {
  std::vector<std::string> told;
  UrdfOptions options;
  options.warn = [&](const std::string& text) { told.push_back(text); };
  const std::string gear =
      "<transmission name=\"t\"><joint name=\"j\"/><actuator name=\"m\">\n<mechanicalReduction>50"
      "</mechanicalReduction></actuator></transmission>";
  const std::string parts =
      "<axis xyz=\"0 0 1\"/><axis xyz=\"0 1 0\"/><safety_controller k_velocity=\"1\"/>"
      "<calibration rising=\"0\"/>";
  const Robot read = parse_urdf(robot_of(link("a") + link("b") + joint_of("j", "a", "b", "continuous", parts) + gear),
                                "r.urdf", options);
  EXPECT_EQ(read.joint("j").axis, Vec3(0, 0, 1));
  EXPECT_THAT(told, testing::ElementsAre(
                        testing::AllOf(StartsWith("r.urdf:4: joint 'j': another <axis>"), HasSubstr("\"0 0 1\"")),
                        testing::AllOf(StartsWith("r.urdf:6: transmission 't': mechanicalReduction 50 is not used"))));
}

}  // namespace
}  // namespace graze
