// Robots of others load, with repair where they need it. Their files are not part of this project: tests look for them
// in GRAZE_TEST_ROBOTS or in ../shared/robots, and are skipped, which the report says, where there are none.

#include <gmock/gmock.h>

#include <map>

#include "tests/engine/model/support.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

struct Expected {
  const char* file;
  int repairs;  // -1: refused
  int nv;
  const char* word;  // of the refusal
};

/// One for each of the kinds of problem.
const Expected kRobots[] = {
    {"a1.urdf", 0, 18, ""},
    {"laikago.urdf", 13, 18, ""},
    {"iiwa.urdf", 8, 7, ""},
    {"laikago_toes/laikago_toes.urdf", 9, 18, ""},
    {"mini_cheetah/mini_cheetah.urdf", 4, 18, ""},
    {"spirit40/spirit40newer.urdf", 0, 18, ""},
    {"racecar/racecar_differential.urdf", 2, 20, ""},
    {"cassie/cassie_v2.urdf", 20, 22, ""},
    {"atlas/atlas_minimal_contact.urdf", 16, 36, ""},
    {"acrobot/Acrobot.urdf", 1, 2, ""},
    {"iiwa14_spheres/iiwa14_spheres_collision.urdf", 0, 13, ""},
    {"allegro/allegro_hand_description_right.urdf", 0, 22, ""},
    {"anymal_c/anymal.urdf", 5, 18, ""},
    {"g1/g1_29dof_rev_1_0.urdf", 0, 35, ""},
    {"dex3_1/dex3_1_l.urdf", 0, 13, ""},
    {"humanoid.urdf", -1, 0, "spherical"},
    {"husky/husky.urdf", -1, 0, "xacro"},
};

// Each is repaired in as many places as it was found to need, and in no other; the repaired document loads as it is,
// into the same model.
TEST(OtherRobots, LoadWithRepair) {
  if (third_party_robot("").empty()) GTEST_SKIP() << "no third-party robots here; set GRAZE_TEST_ROBOTS";
  std::size_t i = 0;
  for (const Expected& robot : kRobots) {
    if (!test::tried(i++, 3)) continue;
    SCOPED_TRACE(robot.file);
    const std::string file = third_party_robot(robot.file);
    ASSERT_NE(file, "") << "is not among the robots";
    UrdfOptions options;
    options.repair = true;
    int repairs = 0;
    options.warn = [&](const std::string& text) { repairs += text.find("; repaired: ") != std::string::npos; };
    std::string document;
    options.read = [&](const std::string& text) { document = text; };
    if (robot.repairs < 0) {
      EXPECT_THAT(input_error([&] { load_urdf(file, options); }), testing::HasSubstr(robot.word));
      continue;
    }
    World first, second;
    first.robot = load_urdf(file, options);
    EXPECT_EQ(repairs, robot.repairs);
    second.robot = parse_urdf(document, file);
    const Model a = compile(first), b = compile(second);
    EXPECT_EQ(a.nv, robot.nv);
    ASSERT_EQ(a.bodies.size(), b.bodies.size());
    for (std::size_t i = 0; i < a.bodies.size(); ++i) {
      EXPECT_EQ(a.bodies[i].mass, b.bodies[i].mass);
      EXPECT_EQ(a.bodies[i].com, b.bodies[i].com);
      EXPECT_EQ(a.bodies[i].inertia, b.bodies[i].inertia);
    }
    EXPECT_EQ(a.colliders.size(), b.colliders.size());
  }
}

}  // namespace
}  // namespace graze
