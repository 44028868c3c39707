// The files beside a URDF: meshes of more kinds, packages of ROS, pairs that an SRDF disables.

#include <gmock/gmock.h>

#include "engine/model/srdf.h"
#include "engine/model/urdf.h"
#include "engine/settings/inputs.h"
#include "tests/engine/model/support.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;

/// A tetrahedron with legs of 1, 2 and 3, in millimetres, 1 m along x by its node, of a drawing whose "up" is y.
std::string dae(const std::string& nodes = R"(<node id="n"><matrix>1 0 0 1000 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
    <instance_geometry url="#g"/></node>)",
                const std::string& library = "") {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0 1000 0 0 0 2000 0 0 0 3000</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
      <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
  </mesh></geometry></library_geometries>
  <library_nodes>)" +
         library + R"(</library_nodes>
  <library_visual_scenes><visual_scene id="s">)" +
         nodes + R"(</visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>)";
}

/// `text` with `after` where `before` stood.
std::string with(std::string text, const std::string& before, const std::string& after) {
  return text.replace(text.find(before), before.size(), after);
}

std::string of_mesh(const std::string& file) {
  return "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" "
         "iyy=\"1\" "
         "iyz=\"0\" izz=\"1\"/></inertial><collision><geometry><mesh filename=\"" +
         file + "\"/></geometry></collision></link></robot>";
}

// Units and nodes of a DAE count, and which axis it calls "up" does not, as in ROS.
TEST(MeshKinds, Dae) {
  const TemporaryFolder folder;
  folder.write("t.dae", dae());
  const Robot r = load_urdf(folder.write("r.urdf", of_mesh("t.dae")));
  const Shape& shape = r.link("a").collisions.at(0).shape;
  EXPECT_NEAR(shape.volume(), 1, 1e-6);
  Eigen::AlignedBox3d box;
  for (const Vec3& vertex : shape.mesh->vertices) box.extend(vertex);
  EXPECT_LT((box.min() - Vec3(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((box.max() - Vec3(2, 2, 3)).norm(), 1e-6);
}

// PLY is one of the kinds that need no word of ours.
TEST(MeshKinds, Ply) {
  const TemporaryFolder folder;
  folder.write("t.ply",
               "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
               "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
               "0 0 0\n1 0 0\n0 2 0\n0 0 3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const Robot r = load_urdf(folder.write("r.urdf", of_mesh("t.ply")));
  EXPECT_NEAR(r.link("a").collisions.at(0).shape.volume(), 1, 1e-6);
}

// A few lines of DAE cannot stand for any number of copies, or for themselves, and what is broken is told.
TEST(MeshKinds, BadDaeIsRefused) {
  const TemporaryFolder folder;
  std::string bomb = "<node id=\"n0\"><instance_geometry url=\"#g\"/></node>";
  for (int i = 1; i < 40; ++i) {
    const std::string inner = "<instance_node url=\"#n" + std::to_string(i - 1) + "\"/>";
    bomb += "<node id=\"n" + std::to_string(i) + "\">" + inner + inner + "</node>\n";
  }
  std::string chain = "<node id=\"c0\"><instance_geometry url=\"#g\"/></node>";
  for (int i = 1; i < 200; ++i) {
    chain += "<node id=\"c" + std::to_string(i) + "\"><instance_node url=\"#c" + std::to_string(i - 1) + "\"/></node>";
  }
  const std::string loop =
      "<node id=\"l\"><instance_node url=\"#m\"/></node><node id=\"m\"><instance_node url=\"#l\"/></node>";
  const std::string whole = dae();
  const std::vector<std::tuple<std::string, std::string, std::string>> cases = {
      {"bomb.dae", dae("<node><instance_node url=\"#n39\"/></node>", bomb), "more than 10000 nodes; simplify the mesh"},
      {"loop.dae", dae("<node><instance_node url=\"#l\"/></node>", loop), "a node that holds itself"},
      {"chain.dae", dae("<node><instance_node url=\"#c199\"/></node>", chain), "nodes in nodes, more than 100 deep"},
      {"index.dae", with(whole, "<p>0 2 1", "<p>0 2e8 1"), "is not an index"},
      {"count.dae", with(whole, "triangles count=\"4\"", "triangles count=\"4000000000\""), "at most 4000000"},
      {"stride.dae", with(whole, "stride=\"3\"", "stride=\"3000000\""), "reaches beyond the 12 numbers of its array"},
      {"short.dae", with(whole, "count=\"12\"", "count=\"13\""), "there are 12 numbers"},
      {"cut.dae", whole.substr(0, whole.size() / 2), "not XML"},
      {"none.dae", dae(""), "no triangles"},
      {"empty.dae", "", "is an empty file"},
  };
  for (const auto& [name, text, rule] : cases) {
    folder.write(name, text);
    const std::string file = folder.write("r.urdf", of_mesh(name));
    EXPECT_THAT(input_error([&] { load_urdf(file); }),
                testing::AllOf(HasSubstr("link 'a'"), HasSubstr(name), HasSubstr(rule)));
  }
}

/// A variable of the environment while it is alive.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) { setenv(name, value.c_str(), 1); }
  ~Variable() { unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

// Packages are looked for in ROS_PACKAGE_PATH last, and a replay finds them there without the variable.
TEST(RobotFiles, RosPackagePath) {
  const TemporaryFolder folder;
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n", faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  folder.write("ws/far/m.obj", corners + faces);
  const std::string file = folder.write("robots/r.urdf", of_mesh("package://far/m.obj"));
  EXPECT_THAT(input_error([&] { load_urdf(file); }), HasSubstr("is not there"));
  InputFiles kept;
  {
    const Variable path("ROS_PACKAGE_PATH", "/nowhere:" + (folder.path() / "ws").string());
    const InputRecord record;
    EXPECT_EQ(load_urdf(file).link("a").collisions.size(), 1u);
    folder.write("robots/far/m.obj", corners + "v 1 2 -3\n" + faces + "f 1 2 5\n");
    EXPECT_EQ(load_urdf(file).link("a").collisions.at(0).shape.mesh->vertices.size(), 5u) << "nearer ones come first";
    std::filesystem::remove_all(folder.path() / "robots/far");
    kept = record.files();
    kept.erase((folder.path() / "robots/far/m.obj").string());
  }
  const InputReplay replay(kept, input_folder());
  EXPECT_EQ(load_urdf(file).link("a").collisions.size(), 1u);
}

// A mesh that is in none of the folders is told with all of them, and with the file there that is nearest.
TEST(RobotFiles, RosPackagePathIsNamed) {
  const TemporaryFolder folder;
  const std::string near = folder.write("ws/src/foo/meshes/a.STL", "");
  const std::string file = folder.write("robots/r.urdf", of_mesh("package://foo/meshes/a.stl"));
  const std::string src = (folder.path() / "ws/src").string(), here = (folder.path() / "robots").string();
  UrdfOptions options;
  options.package_path = {(folder.path() / "mine").string()};
  const Variable path("ROS_PACKAGE_PATH", "/nowhere:" + src);
  EXPECT_THAT(input_error([&] { load_urdf(file, options); }),
              HasSubstr(" is not there (looked for its package in " + options.package_path[0] + " (package_path), " +
                        here + " and above, /nowhere, " + src + " (ROS_PACKAGE_PATH); did you mean '" + near + "'?)"));
}

// Without any folder to look in, what could name one is told.
TEST(RobotFiles, PackagesThatAreNowhereTellWhereToNameThem) {
  const TemporaryFolder folder;
  const std::string file = folder.write("robots/r.urdf", of_mesh("package://foo_description/meshes/a.stl"));
  const std::string hint = "; its folder may stand in 'robot.package_path' or in ROS_PACKAGE_PATH, which is empty)";
  const Variable none("ROS_PACKAGE_PATH", "");
  EXPECT_THAT(input_error([&] { load_urdf(file); }), HasSubstr(hint));
  const Variable some("ROS_PACKAGE_PATH", "/nowhere");
  EXPECT_THAT(input_error([&] { load_urdf(file); }), Not(HasSubstr(hint)));
}

// A robot that is written elsewhere needs no variable to be read again.
TEST(RobotFiles, RosPackagePathIsNotNeededByWhatIsWritten) {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.write("ws/far/m.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string file = folder.write("robots/r.urdf", of_mesh("package://far/m.obj"));
  std::string written;
  UrdfOptions options;
  options.read = [&](const std::string& text) { written = text; };
  options.read_folder = (folder.path() / "out").string();
  const Variable path("ROS_PACKAGE_PATH", (folder.path() / "ws").string());
  load_urdf(file, options);
  EXPECT_THAT(written, HasSubstr("filename=\"" + mesh + "\""));
}

// A file that says nothing, or hardly what was meant, is taken with a word.
TEST(RobotFiles, DoubtfulSrdf) {
  const TemporaryFolder folder;
  Robot robot;
  robot.name = "r";
  robot.links.resize(2);
  robot.links[0].name = "a", robot.links[1].name = "b";
  const std::string pair = "<disable_collisions link1=\"a\" link2=\"b\"/>";
  const std::string file = (folder.path() / "r.srdf").string();
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"<robot name=\"r\"><virtual_joint/><my_own/>" + pair + "</robot>", {}},
      {"<robot>" + pair + "</robot>", {}},
      {"<robot/>", {file + ":1: no <disable_collisions>: the file names no pair"}},
      {"<robot name=\"q\">" + pair + "</robot>", {file + ":1: the SRDF is of robot 'q', and the URDF of 'r'"}},
      {"<robot name=\"r\">\n<link name=\"a\"/></robot>", {file + ":2: <link>: an SRDF has none; is this file a URDF?"}},
      {"<robot>\n" + pair + "\n<disable_colisions link1=\"a\" link2=\"b\"/></robot>",
       {file + ":3: unknown element <disable_colisions> is ignored; did you mean <disable_collisions>?"}}};
  for (const auto& [text, told] : cases) {
    std::vector<std::string> warnings;
    load_srdf(folder.write("r.srdf", text), robot, [&](const std::string& warning) { warnings.push_back(warning); });
    ASSERT_EQ(warnings.size(), told.size()) << text;
    for (std::size_t i = 0; i < told.size(); ++i) EXPECT_THAT(warnings[i], HasSubstr(told[i]));
  }
}

// Pairs that an SRDF disables, without those that have no shapes, and each once; links that are not there are told.
TEST(RobotFiles, Srdf) {
  const TemporaryFolder folder;
  Robot robot;
  robot.name = "r";
  for (const char* name : {"a", "b*", "c", "bare"}) {
    Link link;
    link.name = name;
    if (link.name != "bare") link.collisions.emplace_back();
    robot.links.push_back(link);
  }
  std::vector<std::string> told;
  const auto warn = [&](const std::string& text) { told.push_back(text); };
  const std::string file = folder.write(
      "r.srdf",
      "<robot name=\"r\"><group name=\"arm\"/>\n<disable_collisions link1=\"c\" link2=\"a\" reason=\"Never\"/>\n"
      "<disable_collisions link1=\"a\" link2=\"c\"/><disable_collisions link1=\"a\" link2=\"b*\"/>\n"
      "<disable_collisions link1=\"a\" link2=\"bare\"/>\n<disable_collisions link1=\"a\" link2=\"bore\"/></robot>");
  EXPECT_THAT(load_srdf(file, robot, warn), ElementsAre(Pair("a", "b?"), Pair("a", "c")));
  EXPECT_THAT(told, ElementsAre(file + ":5: link 'bore' is not in the robot; did you mean 'bare'?"));
  for (const auto& [text, rule] :
       {std::pair("<robot", "not XML"), std::pair("<sdf/>", "must be <robot>"),
        std::pair("<robot><disable_collisions link1=\"a\"/></robot>", "needs a non-empty link2"),
        std::pair("", "not XML"),
        std::pair("<robot><disable_collisions link1=\"a\" lnk2=\"b\"/></robot>",
                  "did you mean link2 by lnk2=\"b\"?")}) {
    const std::string bad = folder.write("bad.srdf", text);
    EXPECT_THAT(input_error([&] { load_srdf(bad, robot, warn); }),
                testing::AllOf(HasSubstr(bad + ":1: "), HasSubstr(rule)));
  }
}

}  // namespace
}  // namespace graze
