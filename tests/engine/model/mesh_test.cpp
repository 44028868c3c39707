// Claim: whatever a mesh file holds, reading it ends with a mesh of finite vertices or with a message that names the
// file, in bounded memory and time.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cstdint>
#include <cstring>
#include <ctime>
#include <limits>

#include "engine/model/convex_hull.h"
#include "engine/model/limits.h"
#include "tests/engine/model/support.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// A triangle with the normal (0, 0, 1).
using Triangle = std::array<float, 9>;

const std::vector<Triangle> kTetrahedron = {
    {0, 0, 0, 0, 2, 0, 1, 0, 0}, {0, 0, 0, 1, 0, 0, 0, 0, 3}, {0, 0, 0, 0, 0, 3, 0, 2, 0}, {1, 0, 0, 0, 2, 0, 0, 0, 3}};

std::string ascii_stl(const std::vector<Triangle>& triangles, const std::string& name = "t") {
  std::string out = "solid " + name + "\n";
  for (const Triangle& t : triangles) {
    out += "facet normal 0 0 1\nouter loop\n";
    for (int k = 0; k < 3; ++k) out += fmt::format("vertex {} {} {}\n", t[3 * k], t[3 * k + 1], t[3 * k + 2]);
    out += "endloop\nendfacet\n";
  }
  return out + "endsolid " + name + "\n";
}

/// `said`: how many triangles the head announces.
std::string binary_stl(const std::vector<Triangle>& triangles, std::uint32_t said) {
  std::string out(80, ' ');
  out.append(reinterpret_cast<const char*>(&said), sizeof said);
  for (const Triangle& t : triangles) {
    const float normal[3] = {0, 0, 1};
    out.append(reinterpret_cast<const char*>(normal), sizeof normal);
    out.append(reinterpret_cast<const char*>(t.data()), sizeof t);
    out.append(2, '\0');
  }
  return out;
}

std::string dae_mesh(const std::string& numbers = "0 0 0 1 0 0 0 2 0 0 0 3",
                     const std::string& indices = "0 2 1 0 1 3 0 3 2 1 2 3") {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="12">)" +
         numbers + R"(</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
      <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>)" +
         indices + R"(</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>)";
}

const char* const kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
    "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 2 0\n0 0 3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n"
    "3 1 2 3\n";

/// What the tests below write and read.
class MeshFile : public ::testing::Test {
 protected:
  /// Of load_mesh() and collision_hull(); "" if there is a hull. Checks what every answer must be.
  std::string answer(const std::string& name, const std::string& bytes) const {
    const std::string file = folder_.write(name, bytes);
    try {
      const auto mesh = load_mesh(file);
      for (const Vec3& vertex : mesh->vertices) EXPECT_TRUE(vertex.allFinite()) << name;
      for (const Eigen::Vector3i& t : mesh->triangles) {
        EXPECT_TRUE(t.minCoeff() >= 0 && t.maxCoeff() < static_cast<int>(mesh->vertices.size())) << name;
      }
      collision_hull(*mesh);
      return "";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), StartsWith(file)) << name;
      return error.what();
    }
  }

  const TemporaryFolder folder_;
};

// What the cases below are changed from.
TEST_F(MeshFile, SoundOnesAreRead) {
  EXPECT_EQ(answer("t.obj", kTetrahedronObj), "");
  EXPECT_EQ(answer("t.stl", ascii_stl(kTetrahedron)), "");
  EXPECT_EQ(answer("b.stl", binary_stl(kTetrahedron, 4)), "");
  EXPECT_EQ(answer("t.dae", dae_mesh()), "");
  EXPECT_EQ(answer("t.ply", kPly), "");
}

// assimp ended the program for a face without corners.
TEST_F(MeshFile, FaceWithoutCorners) {
  const std::string ply = kPly;
  EXPECT_THAT(answer("none.ply", ply.substr(0, ply.rfind("3 1 2 3")) + "0\n"), HasSubstr("has no corners"));
}

// assimp looked for the end of such a head for ever.
TEST_F(MeshFile, PlyHeadWithoutEnd) {
  const std::string ply = kPly;
  for (const char* end : {"end_heaer", "", "end_headerx", "comment end_header"}) {
    std::string odd = ply;
    EXPECT_THAT(answer("odd.ply", odd.replace(odd.find("end_header"), 10, end)), HasSubstr("a line 'end_header'"));
  }
}

// Cut after every byte: a mesh or a message, and a message where the corners of the last triangle are not all there.
TEST_F(MeshFile, TruncatedAnywhere) {
  const std::pair<const char*, std::string> whole[] = {{"cut.obj", kTetrahedronObj},
                                                       {"cut.stl", ascii_stl(kTetrahedron)},
                                                       {"cutb.stl", binary_stl(kTetrahedron, 4)},
                                                       {"cut.dae", dae_mesh()},
                                                       {"cut.ply", kPly}};
  for (const auto& [name, bytes] : whole) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      if (test::tried(size, 3)) answer(name, bytes.substr(0, size));
    }
  }
  // The library's own words name the file, not what the library calls it.
  EXPECT_THAT(answer("none.stl", "no facets here"), Not(HasSubstr("magic")));
  const std::string binary = binary_stl(kTetrahedron, 4);
  for (const std::size_t size : {0, 1, 79, 80, 83, 84, 85, 133, 134, 184, 283}) {
    EXPECT_NE(answer("cutb.stl", binary.substr(0, size)), "") << size;
  }
  const std::string text = dae_mesh();
  for (std::size_t size = 0; size + 10 < text.size(); ++size) {
    if (!test::tried(size, 3)) continue;
    EXPECT_NE(answer("cut.dae", text.substr(0, size)), "");
  }
}

// Coordinates that are no numbers, or none of a length.
TEST_F(MeshFile, CoordinatesThatAreNone) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float odd : {nan, inf, -inf}) {
    std::vector<Triangle> triangles = kTetrahedron;
    triangles[1][4] = odd;
    EXPECT_THAT(answer("odd.stl", binary_stl(triangles, 4)), HasSubstr("a vertex of the mesh is not finite")) << odd;
  }
  for (const char* odd : {"nan", "inf", "-inf", "1e999", "x", "", "0x"}) {
    SCOPED_TRACE(odd);
    std::string text = ascii_stl(kTetrahedron), obj = kTetrahedronObj;
    text.replace(text.find("vertex 0 2 0"), 12, fmt::format("vertex 0 {} 0", odd));
    obj.replace(obj.find("0 2 0"), 5, fmt::format("0 {} 0", odd));
    answer("odd.stl", text);
    answer("odd.obj", obj);
    answer("odd.dae", dae_mesh(fmt::format("0 0 0 1 {} 0 0 2 0 0 0 3", odd)));
  }
  EXPECT_THAT(answer("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"),
              HasSubstr("not finite"));
}

// Nothing that encloses a volume: each is told what it is.
TEST_F(MeshFile, WithoutVolume) {
  const Triangle point = {1, 2, 3, 1, 2, 3, 1, 2, 3}, line = {0, 0, 0, 1, 1, 1, 2, 2, 2};
  const Triangle one = {0, 0, 1, 1, 0, 1, 0, 1, 1}, other = {5, 5, 1, 6, 5, 1, 5, 7, 1};
  EXPECT_THAT(answer("point.stl", binary_stl({point, point}, 2)), HasSubstr("lie in one place"));
  EXPECT_THAT(answer("point.stl", ascii_stl({point, point})), HasSubstr("lie in one place"));
  EXPECT_THAT(answer("line.stl", binary_stl({line, line}, 2)), HasSubstr("lie on one line"));
  EXPECT_THAT(answer("flat.stl", binary_stl({one, other}, 2)), HasSubstr("the mesh is flat"));
  EXPECT_THAT(answer("point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n"), HasSubstr("lie in one place"));
  EXPECT_THAT(answer("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), HasSubstr("lie on one line"));
  EXPECT_THAT(answer("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n"), HasSubstr("is flat"));
  EXPECT_THAT(answer("flat.dae", dae_mesh("0 0 0 1 0 0 0 2 0 3 3 0")), HasSubstr("is flat"));
  EXPECT_THAT(answer("point.dae", dae_mesh("1 1 1 1 1 1 1 1 1 1 1 1")), HasSubstr("lie in one place"));
  // Triangles without area among others do not hurt.
  std::vector<Triangle> more = kTetrahedron;
  more.push_back({0, 0, 0, 0, 0, 0, 1, 0, 0});
  EXPECT_EQ(answer("more.stl", binary_stl(more, 5)), "");
}

// Corners that no vertex has.
TEST_F(MeshFile, IndicesOutOfRange) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n";
  const auto with = [&](const std::string& index) {
    return answer("i.obj", corners + "f 1 3 2\nf 1 2 " + index + "\nf 1 4 3\nf 2 3 4\n");
  };
  for (const char* index :
       {"5", "99999999", "-5", "-99999999", "2147483647", "2147483648", "4294967297", "18446744073709551617"}) {
    EXPECT_NE(with(index), "") << index;
  }
  for (const char* index : {"0", "1/9", "1//9", "1/9/9", "/", "1e3", "x"}) with(index);
  for (const char* index : {"4", "12", "99999999", "2147483647", "4294967296", "18446744073709551617", "-1", "0.5"}) {
    SCOPED_TRACE(index);
    EXPECT_NE(answer("i.dae", dae_mesh("0 0 0 1 0 0 0 2 0 0 0 3", fmt::format("0 2 1 0 1 3 0 3 2 1 2 {}", index))), "");
  }
}

// Faces of a PLY whose corners no vertex has, which the library passes on.
TEST_F(MeshFile, PlyIndicesOutOfRange) {
  const auto with = [&](const std::string& faces, int count, const std::string& vertices = "4") {
    return answer("i.ply", fmt::format("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
                                       "property float z\nelement face {}\nproperty list uchar int vertex_indices\n"
                                       "end_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n{}",
                                       vertices, count, faces));
  };
  EXPECT_EQ(with("3 0 1 2\n3 0 1 3\n3 1 2 3\n3 0 2 3\n", 4), "");
  EXPECT_THAT(with("3 0 1 99999999\n3 0 1 3\n", 2),
              AllOf(HasSubstr("i.ply: "), HasSubstr("index 99999999"), HasSubstr("there are 4 vertices")));
  EXPECT_THAT(with("3 0 1 4\n", 1), HasSubstr("index 4,"));
  EXPECT_NE(with("3 0 1 -1\n3 0 1 4\n", 2), "");
  EXPECT_THAT(with("3 0 1 2\n", 1, "99999999"), AllOf(HasSubstr("i.ply:3: "), HasSubstr("99999999")));
}

// What crashes the library, or keeps it busy for ever, is refused by the name of the file.
constexpr const char* kWithoutMaterial = "a 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\n";

// A mesh's other files are not looked for: the library crashed on such a file of materials.
TEST_F(MeshFile, NoOtherFileIsOpened) {
  folder_.write("x", kWithoutMaterial);
  EXPECT_EQ(answer("q.obj", std::string("mtllib x\n") + kWithoutMaterial), "");
}

TEST_F(MeshFile, WhatTheLibraryCannotBear) {
  EXPECT_THAT(answer("q.obj", std::string("mtllib q.obj\n") + kWithoutMaterial),
              AllOf(HasSubstr("q.obj: "), HasSubstr("crashed")));
  if (!std::getenv("GRAZE_LONG")) return;
  EXPECT_THAT(answer("s.smd", "version 1\nnodes\n0 \"r\" -1\n1 \"b"),
              AllOf(HasSubstr("s.smd: "), HasSubstr("took more than")));
}

/// kB, of this process and of those that read for it.
long peak_memory() {
  long most = 0;
  for (const int whose : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(whose, &usage);
    most = std::max(most, usage.ru_maxrss);
  }
  return most;
}

// A head that announces more triangles than there are makes no room for them.
TEST_F(MeshFile, MoreIsAnnouncedThanThere) {
  const long before = peak_memory();
  for (const std::uint32_t said : {5u, 10'000'000u, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
    EXPECT_NE(answer("bomb.stl", binary_stl(kTetrahedron, said)), "") << said;
    EXPECT_NE(answer("bomb.stl", binary_stl({}, said)), "") << said;
  }
  for (const char* count : {"10000000", "4294967295", "18446744073709551615", "-1"}) {
    std::string text = dae_mesh();
    text.replace(text.find("triangles count=\"4\""), 19, fmt::format("triangles count=\"{}\"", count));
    EXPECT_NE(answer("bomb.dae", text), "") << count;
  }
  EXPECT_LT(peak_memory() - before, 100'000);
}

// Ten million triangles are refused by the size of their file, before a byte is read.
TEST_F(MeshFile, TenMillionTriangles) {
  constexpr std::uint32_t kTriangles = 10'000'000;
  const std::string file = folder_.write("large.stl", binary_stl({}, kTriangles));
  std::filesystem::resize_file(file, 84 + 50ull * kTriangles);
  const long before = peak_memory();
  const std::clock_t begin = std::clock();
  EXPECT_EQ(input_error([&] { load_mesh(file); }), file + ": 500000084 bytes; at most 64 MiB are read");
  EXPECT_LT(peak_memory() - before, 10'000);
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 0.5);
}

// As many as may be: a ball of 1.3 million triangles takes seconds and less than a gigabyte.
TEST_F(MeshFile, AsManyTrianglesAsAllowed) {
  if (!std::getenv("GRAZE_LONG")) GTEST_SKIP() << "takes seconds; set GRAZE_LONG";
  constexpr int kRows = 818;
  const auto point = [](int i, int j) {
    const double z = std::cos(M_PI * i / kRows), r = std::sin(M_PI * i / kRows), angle = 2 * M_PI * j / kRows;
    return std::array<float, 3>{static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)),
                                static_cast<float>(z)};
  };
  std::vector<Triangle> triangles;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kRows; ++j) {
      const auto a = point(i, j), b = point(i + 1, j), c = point(i + 1, j + 1), d = point(i, j + 1);
      triangles.push_back({a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]});
      triangles.push_back({a[0], a[1], a[2], c[0], c[1], c[2], d[0], d[1], d[2]});
    }
  }
  const std::clock_t begin = std::clock();
  EXPECT_THAT(answer("ball.stl", binary_stl(triangles, static_cast<std::uint32_t>(triangles.size()))),
              AnyOf("", HasSubstr("corners; simplify it")));
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 60);
  EXPECT_LT(peak_memory(), 2'000'000);
}

// XML in XML, as deep as may be and deeper: elements that mean nothing, and nodes.
TEST_F(MeshFile, DeepDae) {
  for (const int depth : {90, 150, 100'000}) {
    std::string nodes, ends;
    for (int i = 0; i < depth; ++i) {
      nodes += "<node>";
      ends += "</node>";
    }
    std::string text = dae_mesh();
    text.replace(text.find("<node>"), 6, nodes).replace(text.find("</node>"), 7, ends);
    const std::string found = answer("deep.dae", text);
    if (depth < 100) {
      EXPECT_EQ(found, "");
    } else {
      EXPECT_THAT(found, AnyOf(HasSubstr("more than 100 deep"), HasSubstr("not XML")));
    }
    std::string extra, extra_ends;
    for (int i = 0; i < depth; ++i) {
      extra += "<extra>";
      extra_ends += "</extra>";
    }
    std::string other = dae_mesh();
    other.replace(other.find("<asset>"), 7, extra + extra_ends + "<asset>");
    answer("extra.dae", other);
  }
  // Entities are not expanded.
  std::string laughs = "<?xml version=\"1.0\"?>\n<!DOCTYPE lolz [<!ENTITY a \"ha\">";
  for (int i = 0; i < 30; ++i) laughs += fmt::format("<!ENTITY {0} \"&{1};&{1};\">", char('b' + i), char('a' + i));
  EXPECT_NE(answer("laughs.dae", laughs + "]>\n<COLLADA>&z;</COLLADA>"), "");
}

// A file of one kind under the name of another, and what is no mesh at all.
TEST_F(MeshFile, OfAnotherKind) {
  for (const char* name : {"x.obj", "x.stl", "x.dae", "x.ply", "x.glb", "x.gltf", "x.off", "x.3ds"}) {
    for (const std::string& bytes :
         {std::string(kTetrahedronObj), ascii_stl(kTetrahedron), binary_stl(kTetrahedron, 4), dae_mesh(),
          std::string("\x89PNG\r\n\x1a\n"), std::string(1000, '\0'), std::string(1000, '\xff')}) {
      answer(name, bytes);
    }
  }
}

}  // namespace
}  // namespace graze
