#include "engine/model/urdf.h"

#include <gmock/gmock.h>

#include "engine/model/convex_hull.h"
#include "tests/engine/model/support.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kInertia = R"(<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>)";

std::string solid(const std::string& name) {
  return "<link name=\"" + name + "\"><inertial><mass value=\"1\"/>" + kInertia + "</inertial></link>\n";
}

std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& type = "continuous", const std::string& more = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/>" + more + "</joint>\n";
}

std::string robot(const std::string& body) { return "<robot name=\"r\">\n" + body + "</robot>"; }

Robot parse(const std::string& body) { return parse_urdf(robot(body), "r.urdf"); }

std::string refusal(const std::string& body) {
  return input_error([&] { parse(body); });
}

const char* const kStl =
    "solid t\n"
    "facet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 2 0\nvertex 1 0 0\nendloop\nendfacet\n"
    "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 3\nendloop\nendfacet\n"
    "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 3\nvertex 0 2 0\nendloop\nendfacet\n"
    "facet normal 1 1 1\nouter loop\nvertex 1 0 0\nvertex 0 2 0\nvertex 0 0 3\nendloop\nendfacet\nendsolid t\n";

std::string with_mesh(const std::string& filename, const std::string& part = "collision") {
  return robot("<link name=\"a\"><inertial><mass value=\"1\"/>" + kInertia + "</inertial>\n<" + part +
               "><geometry><mesh filename=\"" + filename + "\" scale=\"2 1 1\"/></geometry></" + part + "></link>");
}

// The Unitree A1 loads as it is: its collision shapes are primitives and its visual meshes are not needed.
TEST(Urdf, A1) {
  GRAZE_THIRD_PARTY(file, "a1.urdf");
  World world;
  world.robot = load_urdf(file);
  EXPECT_TRUE(world.robot.floating_base);
  const Model model = compile(world);
  EXPECT_EQ(model.nv, 18);
  double mass = 0;  // trunk and imu, and per leg hip, its dummy, thigh, calf and toe, as the file has them
  for (const Body& body : model.bodies) mass += body.mass;
  EXPECT_NEAR(mass, 4.713 + 0.001 + 4 * (0.696 + 0.001 + 1.013 + 0.166 + 0.06), 1e-12);
  EXPECT_EQ(world.robot.joint("FR_upper_joint").effort, 55);
  EXPECT_GE(model.frame("FR_toe"), 0);
}

// Laikago and iiwa have collision meshes that are not here: refused by file and link, or loaded without them with one
// warning each. iiwa's base has mass 0 and is therefore bolted down.
TEST(Urdf, LaikagoAndIiwaNeedTheirMeshesOrLeave) {
  for (const auto& [name, mesh, link, nv] : {std::tuple("laikago.urdf", "chassis_vhacd_mod_zup.obj", "chassis", 18),
                                             std::tuple("iiwa.urdf", "meshes/link_0.stl", "lbr_iiwa_link_0", 7)}) {
    GRAZE_THIRD_PARTY(file, name);
    EXPECT_THAT(
        input_error([&, path = file] { load_urdf(path); }),
        testing::AllOf(StartsWith(file + ":"), HasSubstr(mesh), HasSubstr(link), HasSubstr("--ignore-missing-meshes")));
    UrdfOptions options;
    options.ignore_missing_meshes = true;
    std::vector<std::string> warnings;
    options.warn = [&](const std::string& text) { warnings.push_back(text); };
    World world;
    world.robot = load_urdf(file, options);
    EXPECT_EQ(compile(world).nv, nv);
    EXPECT_THAT(warnings, testing::Contains(HasSubstr(mesh)));
    EXPECT_EQ(world.robot.floating_base, nv == 18);
  }
}

// A joint type that URDF does not have is refused by the joint's name and line, with the standard types: all eight.
TEST(Urdf, HumanoidIsRefused) {
  GRAZE_THIRD_PARTY(file, "humanoid.urdf");
  EXPECT_THAT(
      input_error([path = file] { load_urdf(path); }),
      testing::AllOf(StartsWith(file + ": 8 problems, none of which --repair can mend"),
                     HasSubstr(file + ":40: joint 'chest'"), HasSubstr("'left_shoulder'"), HasSubstr("spherical"),
                     HasSubstr("revolute"), HasSubstr("continuous"), HasSubstr("prismatic"), HasSubstr("fixed")));
}

// Each mistake in a file is answered with its line, the thing and the rule.
TEST(Urdf, RefusesWhatIsWrong) {
  const std::string two = solid("a") + solid("b");
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {two, {"r.urdf:3:", "'a' and 'b' both have no parent"}},
      {"", {"r.urdf:1:", "no links"}},
      {solid("a") + solid("a"), {"r.urdf:3:", "two links of this name"}},
      {two + joint("j", "a", "c"), {"r.urdf:4:", "joint 'j': child link 'c' is not there"}},
      {two + joint("j", "world", "a"),
       {"r.urdf:4:", "joint 'j': parent link 'world' is not there", "<link name=\"world\"/>", "base: fixed"}},
      {two + joint("j", "a", "b") + joint("k", "b", "a"), {"r.urdf:", "closes a loop"}},
      {two + solid("c") + joint("j", "b", "c") + joint("k", "c", "b"), {"r.urdf:", "closes a loop"}},
      {two + joint("j", "a", "b") + joint("k", "a", "b"), {"r.urdf:5:", "already the child of joint 'j'"}},
      {two + joint("j", "a", "b", "revolut"), {"r.urdf:4:", "'revolut'", "did you mean 'revolute'"}},
      {two + joint("j", "a", "b", "revolute"), {"r.urdf:4:", "needs <limit"}},
      {two + joint("j", "a", "b", "planar"), {"r.urdf:4:", "planar joints are not supported"}},
      {two + joint("j", "a", "b", "floating"), {"r.urdf:4", "floating joint may only"}},
      {two + joint("j", "a", "b", "continuous", "<mimic joint=\"k\"/>"), {"r.urdf:4:", "<mimic> names the joint 'k'"}},
      {two + joint("j", "a", "b", "continuous", "<mimic joint=\"j\" multiplier=\"nan\"/>"),
       {"r.urdf:4:", "<mimic> multiplier: 'nan' is not a number"}},
      {two + joint("j", "a", "b", "continuous", "<axis xyz=\"0 0 0\"/>"), {"r.urdf:4:", "no direction"}},
      {two + joint("j", "a", "b", "continuous", "<axis xyz=\"0 1\"/>"), {"r.urdf:4:", "2 numbers; it needs 3"}},
      {two + joint("j", "a", "b", "continuous", "<axis xyz=\"0 l 0\"/>"), {"r.urdf:4:", "'l' is not a number"}},
      {two + joint("j", "a", "b", "continuous", "<axis xyz=\"0 nan 0\"/>"), {"r.urdf:4:", "'nan' is not a number"}},
      {two + joint("j", "a", "b", "prismatic", "<limit effort=\"1\" velocity=\"1\" lower=\"2\" upper=\"1\"/>"),
       {"r.urdf:4:", "lower 2 is above upper 1"}},
      {"<link name=\"a\"><inertial><mass value=\"-1\"/>" + kInertia + "</inertial></link>", {"r.urdf:2:", "negative"}},
      {"<link name=\"a\"><inertial><mass value=\"1\"/></inertial></link>", {"r.urdf:2:", "no <inertia>"}},
      {"<link name=\"a\"><collision><geometry><box size=\"1 0 1\"/></geometry></collision></link>",
       {"r.urdf:2:", "not positive"}},
      {"<link name=\"a\"><collision><geometry><spere radius=\"1\"/></geometry></collision></link>",
       {"r.urdf:2:", "unknown shape <spere>", "<sphere>"}},
      {"<xacro:macro/>", {"r.urdf:2:", "this is a xacro file; expand it first: xacro r.urdf > r.expanded.urdf"}},
      {"<link name=\"a\"><inertial><mass value=\"$(optenv MASS 3)\"/></inertial></link>",
       {"r.urdf:2:", "<mass> value: '$(optenv MASS 3)' is an expression of xacro", "xacro r.urdf > r.expanded.urdf"}},
      {"<link name=\"a\"><collision><geometry><sphere radius=\"${r}\"/></geometry></collision></link>",
       {"r.urdf:2:", "<sphere> radius: '${r}' is an expression of xacro"}},
  };
  for (const auto& [body, parts] : cases) {
    const std::string message = refusal(body);
    for (const std::string& part : parts) EXPECT_THAT(message, HasSubstr(part)) << body;
  }
}

// Moving links need mass and a physical inertia; the message names the link and its line.
TEST(Urdf, ChecksInertia) {
  const auto arm = [](const std::string& inertial) {
    return solid("a") + "<link name=\"b\">" + inertial + "</link>\n" + joint("j", "a", "b");
  };
  const auto given = [](const std::string& mass, const std::string& x, const std::string& z) {
    return "<inertial><mass value=\"" + mass + "\"/><inertia ixx=\"" + x + "\" ixy=\"0\" ixz=\"0\" iyy=\"" + x +
           "\" iyz=\"0\" izz=\"" + z + "\"/></inertial>";
  };
  EXPECT_THAT(refusal(arm("")), testing::AllOf(StartsWith("r.urdf:3: link 'b'"), HasSubstr("positive mass")));
  EXPECT_THAT(refusal(arm(given("0", "1", "1"))), testing::AllOf(StartsWith("r.urdf:3: link 'b'"), HasSubstr("mass")));
  EXPECT_THAT(refusal(arm(given("1", "0", "0"))),
              testing::AllOf(StartsWith("r.urdf:3: link 'b'"), HasSubstr("must be positive")));
  EXPECT_THAT(refusal(arm(given("1", "1", "2.1"))),
              testing::AllOf(StartsWith("r.urdf:3: link 'b'"), HasSubstr("triangle inequality")));
  EXPECT_THAT(refusal(arm(given("1", "-1", "1"))), HasSubstr("negative"));
  // Rounding of a flat plate's numbers is no mistake, and what is used is physical.
  const Robot plate = parse(arm(given("1", "1", "2.001")));
  const Vec3 I = plate.link("b").inertia.inertia_about_com().diagonal();
  EXPECT_LE(I[2], I[0] + I[1] + 1e-12);
  EXPECT_NEAR(I[2], 2.001, 2e-3);
}

// Text that is no URDF at all is refused by name.
TEST(Urdf, RefusesWhatIsNoUrdf) {
  const auto message = [](const std::string& text) { return input_error([&] { parse_urdf(text, "x.urdf"); }); };
  EXPECT_THAT(message("not xml"), testing::AllOf(StartsWith("x.urdf:"), HasSubstr("not XML")));
  EXPECT_THAT(message("<robot name=\"r\">\n<link"), testing::AllOf(StartsWith("x.urdf:2"), HasSubstr("not XML")));
  EXPECT_THAT(message(""), StartsWith("x.urdf:"));
  EXPECT_THAT(message("<sdf/>"), HasSubstr("SDF"));
  EXPECT_THAT(message("<robot/>"), HasSubstr("name"));
  EXPECT_THAT(input_error([] { load_urdf("nowhere/there.urdf"); }), HasSubstr("nowhere/there.urdf"));
}

// No bytes make anything but an InputError or a robot: a whole robot file, damaged in one random place at a time.
TEST(Urdf, DamagedFilesAreRefusedOrRead) {
  std::ifstream stream(shipped_robot("links.urdf"));
  const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 500; ++i) {
    std::string damaged = text;
    const std::size_t at = random() % text.size();
    if (i % 3 == 0) damaged[at] = static_cast<char>(random());
    if (i % 3 == 1) damaged.erase(at, random() % 40);
    if (i % 3 == 2) damaged.insert(at, damaged.substr(random() % text.size(), random() % 40));
    try {
      parse_urdf(damaged, "d.urdf");
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_LT(refused, 500);
}

// A root link "world" with a fixed joint is a fixed base, with a floating joint a floating one; the option fixes any.
TEST(Urdf, Base) {
  EXPECT_TRUE(parse(solid("a")).floating_base);
  EXPECT_FALSE(parse("<link name=\"world\"/>" + solid("a") + joint("j", "world", "a", "fixed")).floating_base);
  const Robot floating = parse("<link name=\"world\"/>" + solid("a") + joint("j", "world", "a", "floating"));
  EXPECT_TRUE(floating.floating_base);
  EXPECT_EQ(floating.links.front().name, "a");
  UrdfOptions options;
  options.fixed_base = true;
  EXPECT_FALSE(parse_urdf(robot(solid("a")), "r.urdf", options).floating_base);
}

// Links come depth first from the root with children in file order, whatever the order of the joints in the file.
TEST(Urdf, OrderIsTheTrees) {
  const Robot r = parse(solid("c") + solid("b") + solid("a") + solid("d") + joint("bc", "b", "c") +
                        joint("ad", "a", "d") + joint("ab", "a", "b"));
  std::vector<std::string> links, joints;
  for (const Link& link : r.links) links.push_back(link.name);
  for (const Joint& j : r.joints) joints.push_back(j.name);
  EXPECT_THAT(links, testing::ElementsAre("a", "d", "b", "c"));
  EXPECT_THAT(joints, testing::ElementsAre("ad", "ab", "bc"));
}

// Limits, dynamics, origins and axes arrive as written; a continuous joint has no limits.
TEST(Urdf, ReadsJoints) {
  const Robot r =
      parse(solid("a") + solid("b") + solid("c") +
            joint("j", "a", "b", "revolute",
                  "<origin xyz=\"1 2 3\" rpy=\"0.1 0.2 0.3\"/><axis xyz=\"0 3 4\"/><limit lower=\"-1\" "
                  "upper=\"2\" effort=\"5\" velocity=\"6\"/><dynamics damping=\"0.5\" friction=\"0.25\"/>") +
            joint("k", "b", "c", "continuous", "<limit effort=\"7\" velocity=\"8\"/>"));
  const Joint& j = r.joint("j");
  EXPECT_TRUE(j.X_PJ.linear().isApprox(rotation_from_rpy({0.1, 0.2, 0.3}), 1e-14));
  EXPECT_EQ(Vec3(j.X_PJ.translation()), Vec3(1, 2, 3));
  EXPECT_TRUE(j.axis.isApprox(Vec3(0, 0.6, 0.8), 1e-15));
  EXPECT_EQ(std::tuple(j.lower, j.upper, j.effort, j.velocity, j.damping, j.friction),
            std::tuple(-1.0, 2.0, 5.0, 6.0, 0.5, 0.25));
  EXPECT_TRUE(std::isinf(r.joint("k").lower) && std::isinf(r.joint("k").upper));
  EXPECT_EQ(r.joint("k").effort, 7);
}

// An axis may have any length, also one whose square no number holds.
TEST(Urdf, AxesOfAnyLength) {
  const std::vector<std::pair<std::string, Vec3>> axes = {{"1e200 0 0", {1, 0, 0}},
                                                          {"1e155 1e155 0", {std::sqrt(0.5), std::sqrt(0.5), 0}},
                                                          {"1e-160 1e-160 0", {std::sqrt(0.5), std::sqrt(0.5), 0}},
                                                          {"0 -1e308 1e308", {0, -std::sqrt(0.5), std::sqrt(0.5)}},
                                                          {"0 0 -5e-324", {0, 0, -1}}};
  for (const auto& [xyz, want] : axes) {
    const Robot r = parse(solid("a") + solid("b") + joint("j", "a", "b", "continuous", "<axis xyz=\"" + xyz + "\"/>"));
    EXPECT_LT((r.joint("j").axis - want).norm(), 1e-15) << xyz;
  }
}

// A link without <inertial> weighs what its collision shapes weigh, or else its visual primitives.
TEST(Urdf, InertiaFromGeometry) {
  const std::string shape = "<origin xyz=\"1 0 0\"/><geometry><box size=\"1 2 3\"/></geometry>";
  UrdfOptions options;
  options.density = 10;
  for (const std::string part : {"collision", "visual"}) {
    const Robot r =
        parse_urdf(robot("<link name=\"a\"><" + part + ">" + shape + "</" + part + "></link>"), "r", options);
    EXPECT_NEAR(r.link("a").inertia.mass, 60, 1e-12);
    EXPECT_TRUE(r.link("a").inertia.com().isApprox(Vec3(1, 0, 0)));
    EXPECT_TRUE(r.link("a").inertia.inertia_about_com().isApprox(Mat3(Vec3(65, 50, 25).asDiagonal()), 1e-12));
  }
}

// Further shapes of a link are numbered parts of it.
TEST(Urdf, NamesParts) {
  const std::string shape = "<collision><geometry><sphere radius=\"1\"/></geometry></collision>";
  const Robot r = parse("<link name=\"a\">" + shape + shape + shape + "</link>");
  EXPECT_EQ(r.link("a").collisions[0].name, "a");
  EXPECT_EQ(r.link("a").collisions[2].name, "a.2");
}

// A misspelt standard element is left out with a word, an extension silently.
TEST(Urdf, WarnsOfMisspeltElements) {
  std::vector<std::string> warnings;
  UrdfOptions options;
  options.warn = [&](const std::string& text) { warnings.push_back(text); };
  parse_urdf(
      robot("<link name=\"a\"><inertial><mass value=\"1\"/>" + kInertia + "</inertial><colision/></link><gazebo/>"),
      "r.urdf", options);
  EXPECT_THAT(warnings, testing::ElementsAre(testing::AllOf(StartsWith("r.urdf:2:"), HasSubstr("<collision>"))));
}

std::vector<std::string> warnings_of(const std::string& body) {
  std::vector<std::string> out;
  UrdfOptions options;
  options.warn = [&](const std::string& text) { out.push_back(text); };
  parse_urdf(robot(body), "r.urdf", options);
  return out;
}

// So are misspelt attributes and elements further down, of which the default would count; extensions, and names near
// to one that is there, pass.
TEST(Urdf, WarnsOfMisspeltAttributes) {
  const std::string three = solid("a") + solid("b") + solid("c") + joint("ja", "a", "b");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"<limit lowr=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>",
       "r.urdf:6: joint 'k': <limit>: unknown attribute lowr=\"-1\" is ignored; did you mean lower?"},
      {"<limit Lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>",
       "r.urdf:6: joint 'k': <limit>: unknown attribute Lower=\"-1\" is ignored; did you mean lower?"},
      {"<limit upper=\"1\" effort=\"1\" velocity=\"1\"/><mimic joint=\"ja\" multiplyer=\"3\"/>",
       "r.urdf:6: joint 'k': <mimic>: unknown attribute multiplyer=\"3\" is ignored; did you mean multiplier?"},
      {"<limit upper=\"1\" effort=\"1\" velocity=\"1\"/><dynamics dampin=\"3\"/>",
       "r.urdf:6: joint 'k': <dynamics>: unknown attribute dampin=\"3\" is ignored; did you mean damping?"},
      {"<limit upper=\"1\" effort=\"1\" velocity=\"1\"/><mimic joint=\"ja\"/>\n<mimic joint=\"a\"/>",
       "r.urdf:7: joint 'k': a second <mimic> is ignored; the first one is taken"}};
  for (const auto& [more, told] : cases) {
    EXPECT_THAT(warnings_of(three + joint("k", "b", "c", "revolute", more)), testing::ElementsAre(told));
  }
  EXPECT_THAT(warnings_of("<link name=\"a\"><inertial><orgin xyz=\"1 0 0\"/><mass value=\"1\"/>" + kInertia +
                          "</inertial></link>"),
              testing::ElementsAre("r.urdf:2: link 'a': unknown element <orgin> is ignored; did you mean <origin>?"));
  EXPECT_THAT(warnings_of("<link name=\"a\" group=\"g\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" "
                          "iyx=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>"),
              testing::IsEmpty());
}

// What a link has twice, of which one would be lost without a word.
TEST(Urdf, WarnsOfWhatALinkHasTwice) {
  const std::string head = "<link name=\"a\"><inertial><mass value=\"1\"/>", two = kInertia + "</inertial>";
  EXPECT_THAT(warnings_of(head + "<mass value=\"2\"/>" + two + "</link>"),
              testing::ElementsAre("r.urdf:2: link 'a': a second <mass> is ignored; the first one is taken"));
  EXPECT_THAT(
      warnings_of(head + two + "<collision><geometry><sphere radius=\"0.1\"/><box size=\"1 1 1\"/></geometry>" +
                  "</collision></link>"),
      testing::ElementsAre("r.urdf:2: link 'a': <box>, a second shape in a <geometry>, is ignored; write another "
                           "<collision>"));
  EXPECT_THAT(warnings_of(head + two + "<collision><geometry><sphere radius=\"0.1\"/></geometry>" +
                          "<geometry><box size=\"1 1 1\"/></geometry></collision></link>"),
              testing::ElementsAre("r.urdf:2: link 'a': a second <geometry> is ignored; the first one is taken"));
  EXPECT_THAT(warnings_of(head + two + "<collision><geometry><sphere radius=\"0.1\"/></geometry></collision>" +
                          "<collision><geometry><box size=\"1 1 1\"/></geometry></collision></link>"),
              testing::IsEmpty());
}

// Where a misspelt word leaves something out that must be there, the refusal says so.
TEST(Urdf, RefusesWithTheMisspeltWord) {
  EXPECT_THAT(
      refusal(solid("a") + solid("b") + joint("j", "a", "b", "revolute", "\n<limits lower=\"0\" upper=\"1\"/>")),
      testing::AllOf(StartsWith("r.urdf:4:"), HasSubstr("needs <limit "),
                     HasSubstr("; did you mean <limit> by <limits> in line 5?")));
  EXPECT_THAT(refusal("<link name=\"a\"><collision><geometry><cylinder radius=\"1\" lenght=\"2\"/></geometry>"
                      "</collision></link>"),
              HasSubstr("<cylinder> needs a non-empty length; did you mean length by lenght=\"2\"?"));
}

// What is taken as it stands and hardly meant so is told: no torque, degrees, millimetres. What may be meant is not.
TEST(Urdf, WarnsOfGrossMistakes) {
  const std::string two = solid("a") + solid("b");
  const auto limited = [&](const std::string& limit) {
    return warnings_of(two + joint("j", "a", "b", "revolute", "<limit " + limit + "/>"));
  };
  const std::string able = " effort=\"1\" velocity=\"1\"";
  EXPECT_THAT(limited("lower=\"-1\" upper=\"1\" effort=\"0\" velocity=\"1\""),
              testing::ElementsAre(StartsWith("r.urdf:4: joint 'j': <limit> effort: 0 leaves the motor no torque")));
  EXPECT_THAT(limited("lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"0\""),
              testing::ElementsAre(StartsWith("r.urdf:4: joint 'j': <limit> velocity: 0 leaves the motor no torque")));
  EXPECT_THAT(limited("lower=\"-90\" upper=\"90\"" + able),
              testing::ElementsAre(testing::AllOf(StartsWith("r.urdf:4: joint 'j': <limit> -90 … 90 rad"),
                                                  HasSubstr("in degrees (-1.5708 … 1.5708 rad)?"))));
  EXPECT_THAT(limited("lower=\"-6.3\" upper=\"12.6\"" + able), testing::IsEmpty());
  EXPECT_THAT(limited("lower=\"-1e9\" upper=\"1e9\"" + able), testing::IsEmpty());
  EXPECT_THAT(warnings_of(two + joint("j", "a", "b", "continuous", "<origin rpy=\"90 0 0\"/>")),
              testing::ElementsAre(testing::AllOf(StartsWith("r.urdf:4: joint 'j': <origin> rpy: 90 rad"),
                                                  HasSubstr("degrees (1.5708 rad)?"))));
  EXPECT_THAT(warnings_of(two + joint("j", "a", "b", "continuous", "<origin rpy=\"6.2832 0 -6.2832\"/>")),
              testing::IsEmpty());
  const auto box = [](const std::string& size) {
    return warnings_of("<link name=\"a\">\n<collision><geometry><box size=\"" + size +
                       "\"/></geometry></collision></link>");
  };
  EXPECT_THAT(box("120 1 0.1"), testing::Contains(StartsWith("r.urdf:3: link 'a': <collision> is as large as 120 m")));
  EXPECT_THAT(box("5 5 5"), testing::Contains(StartsWith("r.urdf:2: link 'a': its shapes make 1.25e+05 kg")));
  EXPECT_THAT(box("4 4 4"), testing::Not(testing::Contains(HasSubstr("its shapes make"))));
}

// OBJ and STL give the same solid, scaled, as its convex hull.
TEST(Meshes, ObjAndStl) {
  const TemporaryFolder folder;
  folder.write("t.obj", kTetrahedronObj);
  folder.write("t.stl", kStl);
  for (const std::string mesh : {"t.obj", "t.stl"}) {
    const Robot r = load_urdf(folder.write("r.urdf", with_mesh(mesh)));
    const Shape& shape = r.link("a").collisions.at(0).shape;
    EXPECT_EQ(shape.kind, ShapeKind::mesh);
    EXPECT_EQ(shape.mesh->vertices.size(), 4u) << mesh;
    EXPECT_NEAR(shape.volume(), 2, 1e-6) << mesh;  // scale 2 in x; STL and OBJ are read in single precision
  }
}

// package://NAME/ is found in a parent folder called NAME, beside a parent, and in the folders of the package path.
TEST(Meshes, PackagePaths) {
  const TemporaryFolder folder, elsewhere;
  folder.write("my_robot/meshes/t.obj", kTetrahedronObj);
  const std::string inside = folder.write("my_robot/urdf/r.urdf", with_mesh("package://my_robot/meshes/t.obj"));
  EXPECT_EQ(load_urdf(inside).link("a").collisions.size(), 1u);
  const std::string beside = folder.write("other/urdf/r.urdf", with_mesh("package://my_robot/meshes/t.obj"));
  EXPECT_EQ(load_urdf(beside).link("a").collisions.size(), 1u);
  folder.write("src/far/meshes/t.obj", kTetrahedronObj);
  const std::string far = folder.write("urdf/r.urdf", with_mesh("package://far/meshes/t.obj"));
  EXPECT_THAT(input_error([&] { load_urdf(far); }), HasSubstr("package://far/meshes/t.obj"));
  UrdfOptions options;
  options.package_path = {(folder.path() / "src").string()};
  EXPECT_EQ(load_urdf(far, options).link("a").collisions.size(), 1u);
  options.package_path = {(folder.path() / "src/far").string()};
  EXPECT_EQ(load_urdf(far, options).link("a").collisions.size(), 1u);
}

// A mesh without any area is named for what it is, whatever the library that reads it says or takes.
TEST(Meshes, DegenerateOnesAreNamed) {
  const TemporaryFolder folder;
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 1 2 3\nvertex 1 2 3\nvertex 1 2 3\nendloop\nendfacet\n";
  folder.write("point.obj", "v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n");
  folder.write("point.stl", "solid p\n" + facet + "endsolid p\n");
  folder.write("line.obj", "v 0 0 0\nv 1 2 3\nv 2 4 6\nf 1 2 3\n");
  folder.write("none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  folder.write("none.stl", "solid p\nendsolid p\n");
  folder.write("none_binary.stl", std::string(84, '\0'));
  folder.write("empty.stl", "");
  folder.write("empty.obj", "");
  for (const auto& [mesh, rule] : {std::pair("point.obj", "lie in one place; its triangles must have an area"),
                                   std::pair("point.stl", "in one place"), std::pair("line.obj", "lie on one line"),
                                   std::pair("none.obj", "the mesh has no triangles; it must have some"),
                                   std::pair("none.stl", "the mesh has no triangles; it must have some"),
                                   std::pair("none_binary.stl", "the mesh has no triangles; it must have some"),
                                   std::pair("empty.stl", "is an empty file; a mesh must have triangles"),
                                   std::pair("empty.obj", "is an empty file; a mesh must have triangles")}) {
    const std::string file = folder.write("r.urdf", with_mesh(mesh));
    EXPECT_THAT(input_error([&] { load_urdf(file); }),
                testing::AllOf(HasSubstr("r.urdf:"), HasSubstr("link 'a'"), HasSubstr(mesh), HasSubstr(rule)));
  }
}

// A missing visual mesh is no matter; a collision mesh that is there but broken, flat or of another format is.
TEST(Meshes, MissingAndBroken) {
  const TemporaryFolder folder;
  EXPECT_TRUE(load_urdf(folder.write("r.urdf", with_mesh("no.obj", "visual"))).link("a").visuals.empty());
  folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n");
  folder.write("broken.stl", "solid");
  folder.write("model.scad", "cube(1);");
  std::filesystem::create_directory(folder.path() / "folder.obj");
  for (const auto& [mesh, rule] : {std::pair("flat.obj", "flat"), std::pair("broken.stl", "broken.stl"),
                                   std::pair("model.scad", "convert it to OBJ, STL or DAE"),
                                   std::pair("folder.obj", "folder.obj is a folder, not a file)")}) {
    const std::string file = folder.write("r.urdf", with_mesh(mesh));
    EXPECT_THAT(input_error([&] { load_urdf(file); }), testing::AllOf(HasSubstr("link 'a'"), HasSubstr(rule)));
  }
}

// The hull of points in and on a ball: all points are behind every face, the surface is closed (Euler), and its volume
// is that of the ball less the caps that the facets cut off.
TEST(ConvexHull, OfABall) {
  std::mt19937 random(1);
  std::normal_distribution<double> n;
  Mesh cloud;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = Vec3(n(random), n(random), n(random)).normalized();
    cloud.vertices.push_back(i % 2 ? p : Vec3(0.5 * p));
  }
  const auto hull = convex_hull(cloud);
  ASSERT_TRUE(hull);
  EXPECT_EQ(hull->vertices.size(), 1000u);
  EXPECT_EQ(hull->triangles.size(), 2 * hull->vertices.size() - 4);
  for (const Eigen::Vector3i& t : hull->triangles) {
    const Vec3 a = hull->vertices[t[0]];
    const Vec3 normal = (hull->vertices[t[1]] - a).cross(hull->vertices[t[2]] - a).normalized();
    for (const Vec3& p : cloud.vertices) ASSERT_LT(normal.dot(p - a), 1e-8);
  }
  const Shape shape{ShapeKind::mesh, Vec3::Ones(), hull, nullptr};
  EXPECT_LT(shape.volume(), 4.0 / 3 * M_PI);
  EXPECT_GT(shape.volume(), 4.0 / 3 * M_PI * 0.98);
}

// A cube whose faces are covered with coplanar points is still a cube of eight corners.
TEST(ConvexHull, OfACubeWithCoplanarPoints) {
  Mesh cloud;
  for (int i = 0; i <= 4; ++i) {
    for (int j = 0; j <= 4; ++j) {
      for (int k = 0; k <= 4; ++k) cloud.vertices.emplace_back(i / 4.0, j / 4.0, k / 4.0);
    }
  }
  const auto hull = convex_hull(cloud);
  ASSERT_TRUE(hull);
  const Shape shape{ShapeKind::mesh, Vec3::Ones(), hull, nullptr};
  EXPECT_NEAR(shape.volume(), 1, 1e-12);
  cloud.vertices.resize(25);  // one face only
  EXPECT_FALSE(convex_hull(cloud));
}

}  // namespace
}  // namespace graze
