// Claims: what a text mesh says wrong is refused with its line, where the library would leave it out and make another
// shape of the rest; XML that would take a library for ever, or is read otherwise than it is meant, is refused at once.
#include "engine/model/mesh_text.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/model/mesh_size.h"
#include "engine/model/urdf.h"
#include "engine/model/xml_text.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

using ::testing::HasSubstr;

constexpr const char* kTaken = "(taken)";

template <class F>
std::string said_of(const F& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return kTaken;
}

std::string of_obj(const std::string& text) {
  return said_of([&] { check_mesh_size(text, "a.obj"); });
}
std::string of_stl(const std::string& text) {
  return said_of([&] { check_mesh_size(text, "a.stl"); });
}

TEST(MeshText, VerticesOfObjAreThreeNumbers) {
  EXPECT_THAT(of_obj("v 0 0 0\nv abc 0 0\n"), HasSubstr("a.obj:2: v: 'abc' is not a number"));
  EXPECT_THAT(of_obj("v 0 0 0\nv 1 2\n"), HasSubstr("a.obj:2: v: 2 coordinates; a vertex has three"));
  EXPECT_THAT(of_obj("v 0 0 nan\n"), HasSubstr("a.obj:1: v: nan is not finite"));
  EXPECT_THAT(of_obj("v 1e300 0 0\n"), HasSubstr("1e300 is not finite, or too large to be read"));
  EXPECT_EQ(of_obj("v +1 -2.5e-3 1e-320 1 0.5 0.5 0.5\r\nvn 0 0 1\nvt x\n# v abc\n"), kTaken);
}

std::string stl_solid(const std::string& facet) { return "solid a\n" + facet + "endsolid a\n"; }
std::string stl_facet(const std::string& corners) {
  return "facet normal 0 0 1\n outer loop\n" + corners + " endloop\nendfacet\n";
}
const std::string kStlCorners = "  vertex 0 0 0\n  VERTEX 1 0 0\n  vertex 0 1 0\n";

TEST(MeshText, FacetsOfStlAreWhole) {
  EXPECT_EQ(of_stl(stl_solid(stl_facet(kStlCorners))), kTaken);
  EXPECT_EQ(of_stl("solid vertex of facet\nendsolid\nsolid\n" + stl_facet(kStlCorners) + "endsolid"), kTaken);
  EXPECT_THAT(of_stl(stl_solid(stl_facet(kStlCorners + "vertex 1 1 0\n"))),
              HasSubstr("a.stl:9: a facet of 4 vertices; each has three"));
  EXPECT_THAT(of_stl(stl_solid(stl_facet("vertex 0 0 0\n"))), HasSubstr("a facet of 1 vertices"));
  EXPECT_THAT(of_stl(stl_solid(stl_facet("vertex foo 0 0\n" + kStlCorners))),
              HasSubstr("a.stl:4: vertex: 'foo' is not a number"));
  EXPECT_THAT(of_stl("solid a\n" + stl_facet(kStlCorners)),
              HasSubstr("the file ends before its solid does ('endsolid'): it is cut off"));
}

TEST(MeshText, BinaryStlIsAsLongAsItsHeadSays) {
  std::string bytes(84 + 2 * 50, '\0');
  bytes[80] = 2;
  EXPECT_EQ(of_stl(bytes), kTaken);
  bytes.pop_back();
  EXPECT_THAT(of_stl(bytes),
              HasSubstr("of 2 triangles, as its head says, has 184 bytes, and this one 183: it is cut off"));
  EXPECT_THAT(of_stl(bytes + "more"), HasSubstr("and this one 187: it is damaged"));
  EXPECT_THAT(of_stl(std::string(20, '\0')), HasSubstr("20 bytes; a binary STL file has at least 84"));
}

TEST(MeshText, FacesOfPlyAreBounded) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n5000 0 0\n0 1 0\n";
  EXPECT_EQ(said_of([&] { check_ply_head(head + "3 0 1 2\n", "a.ply"); }), kTaken);
  EXPECT_THAT(said_of([&] { check_ply_head(head + "200000000 0 1\n", "a.ply"); }),
              HasSubstr("a.ply:13: a face of 200000000 corners; at most 1000"));
}

TEST(MeshText, MessagesFitALine) {
  const std::string long_one = fit_for_a_line("a\nb" + std::string(100'000, 'x'));
  EXPECT_LT(long_one.size(), 300u);
  EXPECT_EQ(long_one.substr(0, 3), "a b");
}

std::string of_urdf(const std::string& text) {
  return said_of([&] { parse_urdf(text, "r.urdf"); });
}

TEST(XmlText, AttributesAreBounded) {
  std::string many;
  for (int i = 0; i < 200'000; ++i) many += fmt::format(" a{}=\"1\"", i);
  EXPECT_THAT(of_urdf("<robot name=\"r\">\n<link name=\"a\"" + many + "/></robot>"),
              HasSubstr("r.urdf:2: <link> has more than 256 attributes"));
  tinyxml2::XMLDocument document;
  EXPECT_FALSE(read_xml("<a b='=====' c=\"" + std::string(1000, '=') + "\">" + std::string(1000, '=') + "<!--" +
                            std::string(1000, '=') + "--></a>",
                        document));
}

TEST(XmlText, EntitiesAreRefused) {
  EXPECT_THAT(of_urdf("<!DOCTYPE robot [\n<!ENTITY m \"gripper\">]><robot name=\"r\"><link name=\"&m;\"/></robot>"),
              HasSubstr("r.urdf:2: <!ENTITY>: entities are not read; write what they stand for"));
  EXPECT_THAT(of_urdf("<!DOCTYPE robot><robot name=\"r\"><link name=\"a\"/></robot>"), HasSubstr("mass 0"));
}

TEST(XmlText, FaultsAreToldInWords) {
  EXPECT_THAT(of_urdf("<robot name=\"r\"><link name=\"a\" name=\"b\"/></robot>"),
              HasSubstr("not XML (an attribute that is there twice, or is not name=\"value\")"));
  EXPECT_THAT(of_urdf("<robot name=\"r\"><link name=\"a\"></robot>"),
              HasSubstr("closed by another's name, or not at all"));
  EXPECT_THAT(of_urdf("\xff\xfe<\0"), HasSubstr("UTF-16; save it as UTF-8"));
}

}  // namespace
}  // namespace graze
