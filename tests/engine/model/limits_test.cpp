// Claim: robots and meshes that would exhaust memory or time are refused with file, line, number and bound, before they
// do; what is merely large is read in time that grows with its size.

#include "engine/model/limits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstring>
#include <ctime>

#include "engine/model/convex_hull.h"
#include "engine/model/fabrication.h"
#include "tests/engine/model/support.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kBody =
    R"(<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>)";
const std::string kSphere = R"(<collision><geometry><sphere radius="1"/></geometry></collision>)";

/// Links l0, l1 … each on a joint of `type` to the one before; element i stands in lines 2 i + 2 and 2 i + 3.
std::string chain(std::size_t links, const std::string& type, const std::string& shape = "") {
  std::string out = "<robot name=\"r\">\n";
  for (std::size_t i = 0; i < links; ++i) {
    out += fmt::format("<link name=\"l{}\">{}{}</link>\n", i, kBody, shape);
    if (i == 0) {
      out += '\n';
    } else {
      out += fmt::format("<joint name=\"j{0}\" type=\"{2}\"><parent link=\"l{1}\"/><child link=\"l{0}\"/></joint>\n", i,
                         i - 1, type);
    }
  }
  return out + "</robot>";
}

std::string refusal_of_file(const std::string& xml) {
  return input_error([&] { parse_urdf(xml, "r.urdf"); });
}

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

TEST(Limits, LinksJointsAndShapes) {
  EXPECT_EQ(refusal_of_file(chain(20'010, "fixed")), "r.urdf:40002: more than 20000 links; a robot has at most 20000");
  EXPECT_EQ(refusal_of_file(chain(1'010, "continuous")),
            "r.urdf:2005: more than 1000 joints that move; a robot has at most 1000");
  std::string shapes;
  for (int i = 0; i < 2'001; ++i) shapes += kSphere + "\n";
  EXPECT_EQ(refusal_of_file("<robot name=\"r\"><link name=\"a\">" + kBody + shapes + "</link></robot>"),
            "r.urdf:2001: more than 2000 collision shapes; a robot has at most 2000");
}

// Each link was searched for in all joints, and each uncertain path in all links: this took 5 s instead of 0.2 (0.4
// where memory is slow to come). Of a sanitized program the time is not looked at.
TEST(Limits, AsManyLinksAsAllowedAreQuick) {
  auto world = std::make_shared<World>();
  std::vector<std::string> paths;
  for (std::size_t i = 0; i < kMaxLinks; ++i) {
    Link link;
    link.name = fmt::format("l{}", i);
    link.inertia = MassMoments::from_inertia(1, Vec3::Zero(), Mat3::Identity());
    world->robot.links.push_back(link);
    paths.push_back("robot.link." + link.name + ".mass");
    if (i == 0) continue;
    Joint joint;
    joint.name = fmt::format("j{}", i);
    joint.parent = fmt::format("l{}", i - 1);
    joint.child = link.name;
    world->robot.joints.push_back(joint);
  }
  const double begin = processor_seconds();
  const Fabricator fabricator(world, paths);
  const double taken = processor_seconds() - begin;
  EXPECT_TRUE(GRAZE_SANITIZED || taken < 1.5) << taken << " s";
  EXPECT_DOUBLE_EQ(fabricator.fabricate(0, std::vector<double>(paths.size(), 2)).model.bodies.at(0).mass,
                   2.0 * static_cast<double>(kMaxLinks));
}

TEST(Limits, Pairs) {
  World world;
  world.robot = parse_urdf(chain(500, "continuous", kSphere), "r.urdf");
  EXPECT_THAT(input_error([&] { compile(world); }), StartsWith("more than 100000 pairs of shapes may touch"));
  world.contact.self_collision = false;
  EXPECT_EQ(compile(world).pairs.size(), 0u);
}

TEST(Limits, NamesAndWarnings) {
  const std::string mega(1 << 20, 'n');
  const std::string text = refusal_of_file("<robot name=\"r\"><link name=\"" + mega + "\"/></robot>");
  EXPECT_EQ(text, "r.urdf:1: link: <link> name: " + std::string(40, 'n') + "…: 1048576 bytes; at most 1000");
  EXPECT_LT(refusal_of_file("<" + mega + "/>").size(), 200u);
  std::vector<std::string> warnings;
  UrdfOptions options;
  options.warn = [&](const std::string& warning) { warnings.push_back(warning); };
  std::string odd;
  for (int i = 0; i < 1'000; ++i) odd += "<lnk/>";
  parse_urdf("<robot name=\"r\"><link name=\"a\">" + kBody + "</link>" + odd + "</robot>", "r.urdf", options);
  ASSERT_EQ(warnings.size(), kMaxWarnings + 1);
  EXPECT_EQ(warnings.back(), "r.urdf: 950 more unknown elements are ignored");
}

TEST(Limits, FilesByTheirSize) {
  const TemporaryFolder folder;
  for (const auto& [name, most] : {std::pair("big.stl", kMaxMeshBytes), std::pair("big.obj", kMaxMeshBytes)}) {
    const std::string file = folder.write(name, "");
    std::filesystem::resize_file(file, most + 1);
    EXPECT_EQ(input_error([&] { load_mesh(file); }),
              fmt::format("{}: {} bytes; at most 64 MiB are read", file, most + 1));
  }
  const std::string urdf = folder.write("big.urdf", "");
  std::filesystem::resize_file(urdf, kMaxUrdfBytes + 1);
  EXPECT_EQ(input_error([&] { load_urdf(urdf); }), urdf + ": 16777217 bytes; at most 16 MiB are read");
}

// What is written in mm is a robot all the same, and is told; so is a link that is all at one point of its shape, or
// spread far beyond it.
TEST(Limits, BodiesOfTensOfMetresAndOfNoneAreDoubted) {
  const TemporaryFolder folder;
  const auto told = [&](double mass, double moment, double com, const char* shape = "") {
    std::vector<std::string> out;
    UrdfOptions options;
    options.warn = [&](const std::string& text) { out.push_back(text); };
    load_urdf(folder.write("r.urdf", fmt::format(R"(<robot name="r"><link name="a"><inertial>
<origin xyz="{1} 0 0"/><mass value="{0}"/><inertia ixx="{2}" iyy="{2}" izz="{2}" ixy="0" ixz="0" iyz="0"/></inertial>
{3}</link></robot>)",
                                                 mass, com, moment, shape)),
              options);
    return fmt::format("{}", fmt::join(out, "\n"));
  };
  EXPECT_EQ(told(1, 0.01, 0.1), "");
  EXPECT_EQ(told(2e4, 1e6, 9), "");
  EXPECT_THAT(told(1, 1667, 0), testing::AllOf(testing::HasSubstr("r.urdf:"), testing::HasSubstr("link 'a': 1 kg"),
                                               testing::HasSubstr("50 m from their centre; URDF has kg and metres")));
  EXPECT_THAT(told(1, 0.01, 35),
              testing::HasSubstr("centre of mass lies 35 m from its origin; URDF has metres: is it"));
  const char* box = R"(<collision><geometry><box size="0.3 0.3 0.3"/></geometry></collision>)";
  EXPECT_EQ(told(1, 1.6e-5, 0, box), "");  // a box of 0.3 m has 0.015 kg m^2
  EXPECT_THAT(told(1, 1.4e-5, 0, box),
              testing::HasSubstr("of 4.2e-05 kg m^2 in all, 0.000933 of what its shapes would have with that mass"));
  EXPECT_EQ(told(1, 14, 0, box), "");
  EXPECT_THAT(told(1, 16, 0, box),
              testing::HasSubstr("48 kg m^2 in all, 1.07e+03 times what its shapes would have with that mass"));
  const char* part = R"(<collision><geometry><box size="0.01 0.01 0.01"/></geometry></collision>)";
  EXPECT_THAT(told(0.001, 0.017, 0, part), testing::HasSubstr("are they meant in kg mm^2?"));  // 1.7e-8 kg m^2
  const char* point = R"(<collision><geometry><sphere radius="0.001"/></geometry></collision>)";
  EXPECT_EQ(told(1, 0.01, 0, point), "");  // of a foot; the leg has no shape
}

TEST(Limits, AMasslessRootMayBeMeantForTheWorld) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& rest) {
    const std::string urdf = folder.write("r.urdf", "<robot name=\"r\"><link name=\"a\"/>" + rest + "</robot>");
    return input_error([&] { load_urdf(urdf); });
  };
  const std::string arm = R"(<link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>)";
  EXPECT_THAT(refused(arm),
              testing::HasSubstr(
                  "must have a positive mass; if it is bolted to the world: robot.base: fixed in the scenario, or "
                  "<mass value=\"0\"/> here"));
  EXPECT_THAT(refused(""), testing::Not(testing::HasSubstr("robot.base")));
}

const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
const std::string kFaces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST(Limits, FacesOfAnObjFile) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& more) {
    const std::string file = folder.write("m.obj", kCorners + more + kFaces);
    const std::string text = input_error([&] { load_mesh(file); });
    EXPECT_THAT(text, StartsWith(file + ":"));
    return text.substr(std::min(text.size(), file.size() + 1));
  };
  std::string polygon;
  for (int i = 0; i < 400; ++i) polygon += " 1 2 3";
  EXPECT_EQ(refused("f" + polygon + "\n"), "5: a face of more than 1000 corners; cut it into triangles");
  EXPECT_EQ(refused("f" + polygon.substr(0, 1200) + " \\\n" + polygon.substr(0, 1206) + "\n"),
            "6: a face of more than 1000 corners; cut it into triangles");
  std::string groups;
  for (std::size_t i = 0; i <= kMaxMeshParts; ++i) groups += "o a\n";
  EXPECT_EQ(refused(groups), "10005: more than 10000 parts (objects, groups, materials); simplify the mesh");
  std::string points;
  for (std::size_t i = 0; i <= kMaxMeshCorners / 2; ++i) points += "f 1\n";
  EXPECT_EQ(refused(points), "2000003: more than 4000000 vertices and corners of faces; simplify the mesh");
  const std::string whole = folder.write("ok.obj", kCorners + "f" + polygon.substr(0, 1800) + "\n" + kFaces);
  EXPECT_EQ(load_mesh(whole)->vertices.size(), 4u);
}

// An OBJ file may name a file of materials. It is not opened: as a FIFO it would be waited for.
TEST(Limits, AMeshIsOneFile) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder.path() / "fifo").c_str(), 0600), 0);
  const std::string file = folder.write("m.obj", "mtllib fifo\n" + kCorners + kFaces);
  EXPECT_EQ(load_mesh(file)->triangles.size(), 4u);
}

/// Binary STL: triangle i has the same corners and a normal of its own.
std::string one_triangle_often(std::uint32_t count) {
  std::string bytes(84 + 50 * std::size_t{count}, '\0');
  std::memcpy(&bytes[80], &count, sizeof count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const float facet[12] = {1, static_cast<float>(i), 0, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::memcpy(&bytes[84 + 50 * std::size_t{i}], facet, sizeof facet);
  }
  return bytes;
}

// Vertices in one place are joined in time that grows with their number; its square takes minutes here.
TEST(Limits, EqualVerticesAreJoinedQuickly) {
  const TemporaryFolder folder;
  const std::string file = folder.write("same.stl", one_triangle_often(100'000));
  const double begin = processor_seconds();
  EXPECT_EQ(load_mesh(file)->vertices.size(), 3u);
  EXPECT_LT(processor_seconds() - begin, 3);
}

// The hull of more than a million vertices is not begun.
TEST(Limits, HullPoints) {
  Mesh cloud;
  cloud.file = "cloud.stl";
  cloud.vertices.resize(kMaxHullPoints + 1, Vec3::Zero());
  EXPECT_THAT(input_error([&] { convex_hull(cloud); }),
              StartsWith("cloud.stl: a collision mesh of 1000001 vertices: at most 1000000"));
}

// A hull with too many corners is given up, with the number. Slow: such a hull takes seconds.
TEST(Limits, HullCorners) {
  if (!std::getenv("GRAZE_LONG")) GTEST_SKIP() << "takes seconds; set GRAZE_LONG";
  std::mt19937 random(1);
  std::normal_distribution<double> n;
  Mesh cloud;
  cloud.file = "ball.stl";
  for (std::size_t i = 0; i < kMaxHullCorners + 100; ++i) {
    cloud.vertices.push_back(Vec3(n(random), n(random), n(random)).normalized());
  }
  EXPECT_THAT(
      input_error([&] { convex_hull(cloud); }),
      testing::AllOf(StartsWith("ball.stl: the convex hull of its 50100 vertices"), HasSubstr("50000 corners")));
}

// Lengths beyond 1e6 m, at which a double's neighbours are 1.2e-10 m away, are refused wherever a robot has them.
TEST(Limits, Lengths) {
  const auto link = [&](const std::string& inside) {
    return refusal_of_file("<robot name=\"r\"><link name=\"a\">\n" + kBody + inside + "</link></robot>");
  };
  const auto shape = [&](const std::string& one) {
    return link("<collision><geometry>\n" + one + "</geometry></collision>");
  };
  const std::string rule = " m: at most 1e+06 m; beyond it rounding makes gaps wrong";
  EXPECT_EQ(shape("<sphere radius=\"1e12\"/>"), "r.urdf:3: link 'a': <sphere> radius: 1e+12" + rule);
  EXPECT_EQ(shape("<box size=\"1 1.1e6 1\"/>"), "r.urdf:3: link 'a': <box> size: 1.1e+06" + rule);
  EXPECT_EQ(shape("<cylinder radius=\"1\" length=\"2e6\"/>"), "r.urdf:3: link 'a': <cylinder> length: 2e+06" + rule);
  EXPECT_EQ(link("<collision><origin xyz=\"0 0 -2e6\"/><geometry><sphere radius=\"1e6\"/></geometry></collision>"),
            "r.urdf:2: link 'a': <origin> xyz: -2e+06" + rule);
  const auto sliding = [&](const std::string& inside) {
    return "<robot name=\"r\"><link name=\"a\">" + kBody + "</link><link name=\"b\">" + kBody +
           "</link>\n<joint name=\"j\" type=\"prismatic\"><parent link=\"a\"/><child link=\"b\"/>" + inside +
           "</joint></robot>";
  };
  const auto joint = [&](const std::string& inside) { return refusal_of_file(sliding(inside)); };
  const std::string limit = "<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>";
  EXPECT_EQ(joint("<origin xyz=\"1e7 0 0\"/>" + limit), "r.urdf:2: joint 'j': <origin> xyz: 1e+07" + rule);
  EXPECT_EQ(joint("<limit lower=\"2e6\" upper=\"3e6\" effort=\"1\" velocity=\"1\"/>"),
            "r.urdf:2: joint 'j': <limit> lower: 2e+06" + rule);
  const std::string free = sliding("<limit lower=\"-1e9\" upper=\"1e9\" effort=\"1\" velocity=\"1\"/>");
  EXPECT_NO_THROW(parse_urdf(free, "r.urdf")) << "bounds that leave a slide free";
  const TemporaryFolder folder;
  const std::string file = folder.write("m.obj", kCorners + kFaces);
  EXPECT_EQ(shape("<mesh filename=\"" + file + "\" scale=\"1 1 1e12\"/>"),
            "r.urdf:2: link 'a': collision mesh '" + file + "' reaches as far as 1e+12" + rule);
}

}  // namespace
}  // namespace graze
