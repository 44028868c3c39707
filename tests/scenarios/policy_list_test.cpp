// Claim: `over` makes one policy of each combination of its values, in order, named by them; names are paths that an
// archive can have; and what would not be seen to be wrong is refused.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <random>

#include "scenarios/policies.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Settings policies_of(const std::string& yaml) { return Settings::parse("policies: " + yaml, "p.yaml").at("policies"); }

std::vector<std::string> listed(const std::string& yaml) {
  std::vector<std::string> out;
  for (const PolicySpec& one : read_policies(policies_of(yaml))) out.push_back(one.name);
  return out;
}

std::string refused_policies(const std::string& yaml) {
  return testing::message_of([&] { read_policies(policies_of(yaml)); });
}

// As an odometer counts: the last path fastest, and each policy has the values of its name and no other change.
TEST(PolicyList, CountsAsAnOdometer) {
  std::mt19937 random(13);
  for (int round = 0; round < 60; ++round) {
    const std::vector<std::string> paths = {"gait.duty", "gait.step", "control.pd.kp", "speed"};
    std::vector<std::vector<int>> values(1 + random() % 4);
    std::string over;
    std::size_t count = 1;
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::string list;
      for (std::size_t k = 1 + random() % 4; k > 0; --k) {
        values[i].push_back(static_cast<int>(1000 * i + 10 * values[i].size() + random() % 10));
        list += fmt::format("{}{}", list.empty() ? "" : ", ", values[i].back());
      }
      over += fmt::format("{}{}: [{}]", i ? ", " : "", paths[i], list);
      count *= values[i].size();
    }
    const auto all = read_policies(policies_of(
        "{walk: {gait: {duty: -1, step: -1, keep: 7}, control: {pd: {kp: -1}}, speed: -1, over: {" + over + "}}}"));
    ASSERT_EQ(all.size(), count);
    for (std::size_t n = 0; n < count; ++n) {
      std::size_t rest = n;
      std::string name;
      std::vector<int> expected(paths.size(), -1);
      for (std::size_t i = values.size(); i-- > 0; rest /= values[i].size()) {
        expected[i] = values[i][rest % values[i].size()];
        name = fmt::format("/{}{}", expected[i], name);
      }
      EXPECT_EQ(all[n].name, "walk" + name);
      const Settings& one = all[n].settings;
      EXPECT_EQ(one.at("gait").at("duty").integer(), expected[0]);
      EXPECT_EQ(one.at("gait").at("step").integer(), expected[1]);
      EXPECT_EQ(one.at("control").at("pd").at("kp").integer(), expected[2]);
      EXPECT_EQ(one.at("speed").integer(), expected[3]);
      EXPECT_EQ(one.at("gait").at("keep").integer(), 7);
      EXPECT_FALSE(one.has("over"));
    }
  }
}

TEST(PolicyList, ValuesAreNamedByTheirTexts) {
  EXPECT_THAT(listed("{p: {a: {}, over: {a.x: [1 cm, -2.5e-3, 75 %, a_b+c]}}}"),
              ElementsAre("p/1cm", "p/-2.5e-3", "p/75%", "p/a_b+c"));
  EXPECT_THAT(listed("{p: {a: {}, over: {a.x: [\"N m/rad\", \"ü\", \"x/y:z\"]}}}"),
              ElementsAre("p/Nm_rad", "p/__", "p/x_y_z"))
      << "other characters are one _ for each byte";
  EXPECT_THAT(listed("{p: {a: {}, over: {a.x: [[1, 2], {y: 3}, \"\", \".\", \"..\", ...]}}}"),
              ElementsAre("p/1", "p/2", "p/3", "p/4", "p/5", "p/..."))
      << "what has no text is numbered, and what would be another folder";
  EXPECT_THAT(listed("{b: {x: {}}, a: {y: {}, over: {y.z: [2, 1]}}}"), ElementsAre("b", "a/2", "a/1")) << "in order";
}

TEST(PolicyList, NamesArePathsOfAnArchive) {
  for (const char* good : {"p", "P_0-+.9", "...", "a.b", "-"}) {
    EXPECT_THAT(listed(fmt::format("{{\"{}\": {{x: {{}}}}}}", good)), ElementsAre(good));
  }
  for (const char* bad : {"", "a b", "a/b", "a%", "ä", "a:b", "a*", "a\\\\b"}) {
    EXPECT_THAT(refused_policies(fmt::format("{{\"{}\": {{x: {{}}}}}}", bad)),
                HasSubstr("a policy's name is made of letters, digits and _ - + ."))
        << bad;
  }
  for (const char* dots : {".", ".."}) {
    EXPECT_THAT(refused_policies(fmt::format("{{\"{}\": {{x: {{}}}}}}", dots)),
                EndsWith("a policy's name must have a letter or a digit"));
  }
  EXPECT_THAT(refused_policies("{step: {x: {}, over: {x.y: [1, 2]}}, step/1: {x: {}}}"),
              EndsWith("; step/1 is one that 'over' of step makes, and its settings are policies.step"));
  EXPECT_THAT(refused_policies("{stop: {x: {}}, step/1: {x: {}}}"), EndsWith("digits and _ - + ."));
  EXPECT_EQ(refused_policies("{}"), "p.yaml:1:11: policies: names no policy");
  EXPECT_EQ(refused_policies("{a: {x: {}, over: {x.y: [1 cm, 1cm]}}}"),
            "p.yaml:1:12: policies.a: two policies would be named a/1cm; the values of 'over' must differ");
}

TEST(PolicyList, LengthsAndCountsAreBounded) {
  const auto named = [](std::size_t n) { return "{" + std::string(n, 'p') + ": {x: {}}}"; };
  EXPECT_EQ(refused_policies(named(200)), "(accepted)");
  EXPECT_THAT(refused_policies(named(201)), EndsWith("a policy's name of 201 bytes; at most 200"));
  const auto over = [](std::size_t n) { return "{p: {x: {}, over: {x.y: [" + std::string(n, '7') + "]}}}"; };
  EXPECT_EQ(refused_policies(over(198)), "(accepted)");
  EXPECT_THAT(refused_policies(over(199)), EndsWith("a policy's name of 201 bytes; at most 200"));
  const auto many = [](int first, int second) {
    std::string a, b;
    for (int i = 0; i < first; ++i) a += fmt::format("{}{}", i ? ", " : "", i);
    for (int i = 0; i < second; ++i) b += fmt::format("{}{}", i ? ", " : "", i);
    return fmt::format("{{p: {{x: {{}}, over: {{x.y: [{}], x.z: [{}]}}}}}}", a, b);
  };
  EXPECT_EQ(refused_policies(many(40, 25)), "(accepted)");
  EXPECT_THAT(refused_policies(many(77, 13)), EndsWith("policies.p.over.x.z: more than 1000 policies"));
  const std::string two = many(40, 25);
  EXPECT_THAT(refused_policies(two.substr(0, two.size() - 1) + ", q: {x: {}}}"),
              EndsWith("policies.q: more than 1000 policies"))
      << "all of them together";
}

// A path that leads past the one policy or tracker that stands there would set one beside it.
TEST(PolicyList, OverLeadsToWhatStandsThere) {
  const auto led = [](const std::string& path, const std::string& control = "{joint_pd: {kp: 1}}") {
    return refused_policies("{p: {hold: {}, control: " + control + ", over: {" + path + ": [1, 2]}}}");
  };
  for (const char* good : {"hold.x", "hold", "control.joint_pd.kp", "control", "hodl_x.y", "zzz"}) {
    EXPECT_EQ(led(good), "(accepted)") << good;
  }
  EXPECT_THAT(led("control.torque.x"), EndsWith("does not lead to what stands there, joint_pd (at p.yaml:1:36)"))
      << "two trackers";
  EXPECT_THAT(led("control.joint_pdd.kp"), EndsWith("; a tracker is called joint_pd"));
  EXPECT_THAT(led("control.joint_pd.kp", "{joint_pdd: {kp: 1}}"), EndsWith("; a tracker is called joint_pd"));
  EXPECT_EQ(led("control.torque.x", "{joint_pd: {}, torque: {}}"), "(accepted)") << "refused for its two trackers";
  EXPECT_THAT(led("control.joint_pd.kp", "[1]"), EndsWith("'joint_pd': is not one of the list's indices 0 to 0"));
  EXPECT_THAT(led("gait.duty"), StartsWith("p.yaml:1:63: policies.p.over.gait.duty: does not lead to what stands "
                                           "there, hold (at p.yaml:1:16)"));
  EXPECT_THAT(led("gait.duty"), Not(HasSubstr("is called"))) << "both are policies";
  EXPECT_THAT(led("holt.x"), EndsWith("; a policy is called hold"));
  EXPECT_THAT(refused_policies("{p: {x: {}, over: {x.y: 3}}}"),
              EndsWith("must be a list of values, one policy for each"));
}

// --set on a value that `over` gives is refused, on the path itself and below it, and nowhere else.
TEST(PolicyList, OverWinsOverSetAndSaysSo) {
  const Settings policies =
      policies_of("{step: {gait: {}, over: {gait.height: [1, 2], gait.duty: [0.5]}}, rest: {hold: {}}, odd: 3}");
  const auto hidden = [&](const std::string& path) {
    return testing::message_of([&] { refuse_hidden(policies, {{"time.end", "1"}, {path, "7"}}); });
  };
  EXPECT_EQ(
      hidden("policies.step.gait.height"),
      "--set policies.step.gait.height=7: 'over' (p.yaml:1:36) gives each of the policies step/… a value of its own "
      "there; with --set policies.step.over=~ there is one policy, step, and this is its value");
  EXPECT_THAT(hidden("policies.step.gait.duty.low"), StartsWith("--set policies.step.gait.duty.low=7: 'over'"));
  for (const char* path : {"policies.step.gait", "policies.step.gait.heights", "policies.step.over.gait.height",
                           "policies.rest.gait.height", "gait.height", "policies.odd"}) {
    EXPECT_EQ(hidden(path), "(accepted)") << path;
  }
}

}  // namespace
}  // namespace graze
