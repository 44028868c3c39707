// What messages say of the nearest right answer: similar names, tags, merged maps, maps as one types them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "engine/settings/merged.h"
#include "engine/settings/settings.h"
#include "engine/settings/similar.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using testing::message_of;

// Claim: a name or glob that matches nothing is answered with what is near, what has the word in it, or all.
TEST(Words, SimilarNames) {
  const std::vector<std::string> legs = {"FL_hip_joint", "FL_knee_joint", "FR_hip_joint", "FR_knee_joint"};
  EXPECT_EQ(similar_names("FL_hip_jont", legs, true), "; did you mean FL_hip_joint?");
  EXPECT_EQ(similar_names("*_hip", legs, true), "; did you mean '*_hip*' (FL_hip_joint, …)?");
  EXPECT_EQ(similar_names("knee", legs, true), "; did you mean '*knee*' (FL_knee_joint, …)?");
  EXPECT_EQ(similar_names("knee", legs, false), "; there are: FL_knee_joint, FR_knee_joint");
  EXPECT_EQ(similar_names("FR_k*", {"FL_a", "RFR_kick_joint"}, true), "; did you mean RFR_kick_joint?");
  EXPECT_EQ(similar_names("joint_1", {"iiwa_joint_1", "iiwa_joint_2"}, false), "; did you mean iiwa_joint_1?");
  EXPECT_EQ(similar_names("elbow", {"hip", "toe"}, true), "; there are: hip, toe");
  EXPECT_EQ(similar_names("*", {}, true), "; there are none");
}

// Claim: what merging puts together that must stand alone is told with the tag that keeps it apart; one file has no
// such excuse, and neither has the command line.
TEST(Merged, HintsAtReplace) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "graze_merged";
  std::filesystem::create_directories(folder);
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return (folder / name).string();
  };
  const std::string base = write("base.yaml", "d: {normal: {std: 1}}\n");
  const std::string main = write("main.yaml", "include: base.yaml\nd: {uniform: [1, 2]}\n");
  const auto merged = Settings::load(main).at("d").entries();
  EXPECT_EQ(replace_hint(merged.at(0), merged.at(1)),
            "; 'normal' stands at " + base +
                ":1:5, and the maps of included files are merged: '!replace {uniform: …}' "
                "takes its place");
  const auto set = Settings::load(base, {{"d.uniform", "[1, 2]"}}).at("d").entries();
  EXPECT_EQ(replace_hint(set.at(0), set.at(1)), "");
  const auto one = Settings::parse("{normal: 1, uniform: 2}", "a.yaml").entries();
  EXPECT_EQ(replace_hint(one.at(0), one.at(1)), "");
  std::filesystem::remove_all(folder);
}

// Claim: a tag that says nothing is refused where it stands, with the nearest; YAML's own types say nothing new.
TEST(Yaml, RefusesUnknownTags) {
  const auto message = [](const std::string& text) { return message_of([&] { Settings::parse(text, "a.yaml"); }); };
  EXPECT_EQ(message("d:\n  !Replace {uniform: [1, 2]}\n"),
            "a.yaml:2:3: !Replace: an unknown tag; did you mean !replace?");
  EXPECT_EQ(message("d: !!replace {a: 1}"), "a.yaml:1:4: !!replace: an unknown tag; did you mean !replace?");
  const std::string other =
      ": an unknown tag; the only one is !replace, by which a map takes the place of an included one";
  EXPECT_EQ(message("time: !foo {end: 1}"), "a.yaml:1:7: !foo" + other);
  EXPECT_EQ(message("list: [1, !foo 2]"), "a.yaml:1:11: !foo" + other);
  EXPECT_EQ(message("list: !foo [1]"), "a.yaml:1:7: !foo" + other);
  EXPECT_EQ(message("a: !foo"), "a.yaml:1:4: !foo" + other);
  EXPECT_EQ(message("!foo a: 1"), "a.yaml:1:1: !foo" + other);
  EXPECT_EQ(message("a: !!binary aGk="), "a.yaml:1:4: !!binary" + other);
  EXPECT_EQ(message("a: !replace {b: !!str 1, c: !!float 2, d: 'x'}"), "(accepted)");
}

// Claim: a map in a message stands in one line as one would type it.
TEST(Maps, AreShownAsTyped) {
  EXPECT_EQ(message_of([] {
              Settings::parse("c:\n  kp: 100\n  kd: {a: [1, 2]}\n", "a.yaml").at("c").single({"x", "y"});
            }),
            "a.yaml:2:3: c: {kp: 100, kd: {a: [1, 2]}}: must be a map with exactly one key; one of: x, y");
}

}  // namespace
}  // namespace graze
