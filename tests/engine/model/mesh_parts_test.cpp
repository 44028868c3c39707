// Claim: a concave mesh is split into the convex parts that stand in its folder, or that its file is made of.

#include "engine/model/mesh_parts.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "engine/model/limits.h"
#include "engine/settings/inputs.h"
#include "tests/engine/model/support.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Vertices and faces of a unit cube at (x, 0, 0) in an OBJ file that has `before` vertices already.
std::string cube(double x, int before = 0) {
  std::string out;
  for (int i = 0; i < 8; ++i) out += fmt::format("v {} {} {}\n", x + (i & 1), i >> 1 & 1, i >> 2 & 1);
  const int faces[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5}, {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
  for (const auto& f : faces) {
    out += fmt::format("f {} {} {} {}\n", f[0] + before, f[1] + before, f[2] + before, f[3] + before);
  }
  return out;
}

/// A unit cube whose top is dented down to its middle: two thirds of its hull.
const char* const kDented =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv 0.5 0.5 0.1\n"
    "f 1 3 2\nf 1 4 3\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n"
    "f 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9\n";

class MeshParts : public ::testing::Test {
 protected:
  std::vector<double> left_ends(const std::string& file) const {
    std::vector<double> out;
    for (const auto& part : convex_parts(file, doubts_)) {
      EXPECT_EQ(part->vertices.size(), 8u);
      double least = part->vertices[0].x();
      for (const Vec3& v : part->vertices) least = std::min(least, v.x());
      out.push_back(least);
    }
    return out;
  }
  std::string refusal(const std::string& file) const {
    return input_error([&] { convex_parts(file, doubts_); });
  }

  const TemporaryFolder folder_;
  mutable std::vector<std::string> doubts_;
};

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// Objects that touch, as those of V-HACD do, stay apart; pieces of one object are those that share no corner.
TEST_F(MeshParts, OfTheFile) {
  EXPECT_THAT(left_ends(folder_.write("o.obj", "o a\n" + cube(0) + "o b\n" + cube(1, 8))), ElementsAre(0, 1));
  EXPECT_THAT(left_ends(folder_.write("g.obj", "g a\n" + cube(3) + "g b\n" + cube(1, 8))), ElementsAre(3, 1));
  EXPECT_THAT(left_ends(folder_.write("p.obj", cube(0) + cube(5, 8) + cube(2, 16))), ElementsAre(0, 5, 2));
  EXPECT_THAT(left_ends(folder_.write("one.obj", cube(4))), ElementsAre(4));
  const std::string flat = "v 9 0 0\nv 10 0 0\nv 9 1 0\nf 9 10 11\n";
  EXPECT_THAT(left_ends(folder_.write("flat.obj", cube(0) + flat)), ElementsAre(0)) << "encloses nothing";
  EXPECT_THAT(left_ends(folder_.write("two.obj", "o a\n" + cube(0) + cube(5, 8) + "o b\n" + cube(2, 16))),
              ElementsAre(0, 5, 2))
      << "pieces of an object";
  EXPECT_THAT(left_ends(folder_.write("same.obj", "o a\n" + cube(0) + "o b\n" + cube(5, 8) + "o a\n" + cube(2, 16))),
              UnorderedElementsAre(0, 5, 2))
      << "two objects of one name";
  EXPECT_THAT(doubts_, IsEmpty());
}

// Contact and mass take the hull of a part that is not convex; nobody is left to think otherwise.
TEST_F(MeshParts, ThatAreNotConvexAreTold) {
  std::string dented = kDented;
  const std::string file = folder_.write("o.obj", "o dented\n" + dented + "o cube\n" + cube(3, 9));
  EXPECT_EQ(convex_parts(file, doubts_).size(), 2u);
  EXPECT_THAT(doubts_, ElementsAre(AllOf(HasSubstr("o.obj: part 1 of 2 is not convex: 29 % of its surface"))));
  doubts_.clear();
  std::filesystem::create_directory(folder_.path() / "o_parts");
  folder_.write("o_parts/a.obj", cube(0));
  folder_.write("o_parts/b.obj", kDented);
  EXPECT_EQ(convex_parts(file, doubts_).size(), 2u);
  EXPECT_THAT(doubts_, ElementsAre(HasSubstr("o_parts/b.obj is not convex")));
}

TEST_F(MeshParts, OfAFolder) {
  const std::string file = folder_.write("grip.obj", kDented);
  EXPECT_THAT(refusal(file),
              AllOf(HasSubstr("grip.obj: a concave mesh of one piece"),
                    HasSubstr("from a folder " + (folder_.path() / "grip_parts").string()), HasSubstr("V-HACD")));
  EXPECT_THAT(refusal(file), HasSubstr(", and there is no folder grip_parts; split"));
  folder_.write("grip_parts", "");
  EXPECT_THAT(refusal(file), HasSubstr(", and grip_parts is a file; split"));
  std::filesystem::remove(folder_.path() / "grip_parts");
  std::filesystem::create_directory(folder_.path() / "grip_parts");
  EXPECT_THAT(refusal(file), HasSubstr(", and the folder grip_parts has no meshes; split"));
  folder_.write("grip_parts/b.obj", cube(2));
  folder_.write("grip_parts/a.OBJ", cube(7));
  folder_.write("grip_parts/.c.obj", "hidden");
  folder_.write("grip_parts/README.md", "no mesh");
  InputFiles kept;
  {
    const InputRecord record;
    EXPECT_THAT(left_ends(file), ElementsAre(7, 2)) << "in the order of their names";
    kept = record.files();
  }
  {
    const InputReplay replay(kept, input_folder());
    EXPECT_THAT(left_ends(file), ElementsAre(7, 2));
  }
  std::filesystem::create_symlink("nowhere", folder_.path() / "grip_parts/e.stl");
  EXPECT_THAT(refusal(file), HasSubstr("grip_parts/e.stl: no such mesh file"));
  std::filesystem::remove(folder_.path() / "grip_parts/e.stl");
  folder_.write("grip_parts/d.stl", "no mesh");
  EXPECT_THAT(refusal(file), HasSubstr("grip_parts/d.stl: "));
}

TEST_F(MeshParts, AreBounded) {
  std::string objects, pieces, dust;
  for (int i = 0; i < 65; ++i) {
    objects += fmt::format("o c{}\n", i) + cube(2 * i, 8 * i);
    pieces += cube(2 * i, 8 * i);
    folder_.write(fmt::format("many_parts/{}.obj", i), cube(0));
  }
  EXPECT_THAT(refusal(folder_.write("objects.obj", objects)),
              AllOf(HasSubstr("65 objects; a mesh is split into at most 64"), HasSubstr("objects_parts")));
  EXPECT_THAT(refusal(folder_.write("pieces.obj", pieces)), HasSubstr("more than 64 separate pieces"));
  EXPECT_THAT(refusal(folder_.write("many.obj", kDented)), HasSubstr("many_parts has more than 64 mesh files"));
}

// Each part is a collider of its link, with a name of its own, scaled and placed as the mesh is; links that are not
// named keep one hull. Mass that is made up is that of the parts.
TEST_F(MeshParts, BecomeCollidersOfTheLink) {
  folder_.write("two.obj", cube(0) + cube(5, 8));
  const std::string shape =
      "<collision><origin xyz=\"0 0 3\"/><geometry><mesh filename=\"two.obj\" scale=\"2 1 1\"/></geometry></collision>";
  const std::string file = folder_.write(
      "r.urdf",
      "<robot name=\"r\"><link name=\"a\">" + shape +
          "<collision><geometry><sphere radius=\"1\"/></geometry></collision>" + "</link><link name=\"b\">" + shape +
          "</link><joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint></robot>");
  UrdfOptions options;
  EXPECT_EQ(load_urdf(file, options).link("a").collisions.size(), 2u);
  options.split = {"a*"};
  const Robot robot = load_urdf(file, options);
  const std::vector<Geometry>& of_a = robot.link("a").collisions;
  ASSERT_EQ(of_a.size(), 3u);
  EXPECT_EQ(of_a[0].name, "a");
  EXPECT_EQ(of_a[1].name, "a.1");
  EXPECT_EQ(of_a[2].shape.kind, ShapeKind::sphere);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(of_a[i].X_LG.translation(), Vec3(0, 0, 3));
    EXPECT_NEAR(of_a[i].shape.volume(), 2, 1e-12);
    ASSERT_TRUE(of_a[i].shape.hull);
    EXPECT_EQ(of_a[i].shape.hull->corners.size(), 8u);
  }
  EXPECT_EQ(robot.link("b").collisions.size(), 1u);
  EXPECT_NEAR(robot.link("b").inertia.mass, 12'000, 1e-6);
  EXPECT_NEAR(robot.link("a").inertia.mass, 1000 * (4 + 4.0 / 3 * M_PI), 1e-6);
}

// Where all links are to be split, a mesh that cannot be is one hull and told; where it is named, it is refused.
TEST_F(MeshParts, OfAllLinksLeaveWhatIsWhole) {
  folder_.write("grip.obj", kDented);
  folder_.write("two.obj", cube(0) + cube(5, 8));
  const auto shape = [](const std::string& mesh) {
    return "<collision><geometry><mesh filename=\"" + mesh + "\"/></geometry></collision>";
  };
  const std::string file = folder_.write(
      "r.urdf", "<robot name=\"r\"><link name=\"a\">" + shape("grip.obj") + shape("two.obj") + "</link></robot>");
  std::vector<std::string> told;
  UrdfOptions options;
  options.warn = [&](const std::string& text) { told.push_back(text); };
  options.split_all = true;
  EXPECT_EQ(load_urdf(file, options).link("a").collisions.size(), 3u);
  EXPECT_THAT(told, ::testing::Contains(HasSubstr("stay one hull each, since 'hulls' finds no convex parts of them: " +
                                                  (folder_.path() / "grip.obj").string() +
                                                  " (there is no folder grip_parts)")));
  options.split_all = false;
  options.split = {"*"};
  EXPECT_THAT(input_error([&] { load_urdf(file, options); }), HasSubstr("a concave mesh of one piece"));
}

// All meshes together have as many parts as a robot may have shapes.
TEST_F(MeshParts, CountAsShapes) {
  std::string pieces, shapes;
  for (int i = 0; i < 64; ++i) pieces += cube(2 * i, 8 * i);
  folder_.write("m.obj", pieces);
  for (int i = 0; i < 32; ++i) {
    shapes += "<collision><geometry><mesh filename=\"m.obj\"/></geometry></collision>\n";
  }
  const std::string file =
      folder_.write("r.urdf", "<robot name=\"r\"><link name=\"a\">\n" + shapes + "</link></robot>");
  UrdfOptions options;
  options.split = {"*"};
  EXPECT_THAT(input_error([&] { load_urdf(file, options); }),
              HasSubstr("r.urdf:33: more than 2000 collision shapes, with the parts of meshes"));
}

}  // namespace
}  // namespace graze
