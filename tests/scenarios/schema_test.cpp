// Claim: data/scenario.schema.json has exactly the keys that the reader allows, section by section: those of the table
// in scenarios/keys.h, the names of witnesses, policies and trackers, and the keys that each policy's and tracker's own
// reader lists when it refuses one.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "scenarios/keys.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using Names = std::set<std::string>;

const nlohmann::json& schema() {
  static const nlohmann::json json = [] {
    std::ifstream stream(std::string(GRAZE_SOURCE_DIR) + "/data/scenario.schema.json");
    return nlohmann::json::parse(stream);
  }();
  return json;
}

/// Keys of a definition, or of the one map among its alternatives; `include` may stand in any map and is resolved
/// before the reader looks.
Names keys_in(const nlohmann::json& definition) {
  if (definition.contains("anyOf")) {
    for (const auto& one : definition["anyOf"]) {
      if (one.contains("properties")) return keys_in(one);
    }
  }
  Names out;
  for (const auto& [key, value] : definition.at("properties").items()) out.insert(key);
  EXPECT_EQ(out.erase("include"), 1u);
  return out;
}

Names schema_keys(const std::string& name) {
  EXPECT_TRUE(schema()["$defs"].contains(name)) << name;
  return keys_in(schema()["$defs"][name]);
}

Names operator+(Names a, const Names& b) {
  a.insert(b.begin(), b.end());
  return a;
}

Names set_of(const std::vector<std::string>& names) { return {names.begin(), names.end()}; }

TEST(Schema, HasTheKeysOfEverySection) {
  for (const auto& [section, keys] : scenario_keys()) {
    SCOPED_TRACE(section);
    EXPECT_EQ(section == "scenario" ? keys_in(schema()) : schema_keys(section), set_of(keys));
  }
}

TEST(Schema, HasAllWitnesses) {
  const Names witnesses = set_of(witness_names());
  const Names logic = {"all", "any", "not"}, times = {"at", "always", "once", "window"};
  EXPECT_EQ(schema_keys("requirement"), witnesses + Names({"window"}));
  EXPECT_EQ(schema_keys("predicate"), witnesses + logic + times);
}

TEST(Schema, HasAllPoliciesAndTrackers) {
  EXPECT_EQ(schema_keys("policy"), set_of(policy_names()) + Names({"control", "over"}));
  EXPECT_EQ(schema_keys("tracker"), set_of(tracker_names()));
  for (const std::string& name : policy_names()) EXPECT_TRUE(schema()["$defs"].contains("policy." + name)) << name;
  for (const std::string& name : tracker_names()) EXPECT_TRUE(schema()["$defs"].contains("tracker." + name)) << name;
}

/// What the reader lists when it meets a key that is like none of its own.
Names reader_keys(const std::string& policy) {
  const std::string message =
      testing::message_of([&] { testing::read("include: links.yaml\npolicies: {p: " + policy + "}\n"); });
  EXPECT_THAT(message, ::testing::HasSubstr("@@@@@@@@@@@@@@@@@@@@@@@@@@@@@@: unknown key")) << policy;
  Names out;
  const std::string marker = "; one of: ";
  const std::size_t list = message.find(marker);
  if (list == std::string::npos) return out;
  std::string names = message.substr(list + marker.size());
  for (std::size_t comma; !names.empty(); names = comma == std::string::npos ? "" : names.substr(comma + 2)) {
    comma = names.find(", ");
    out.insert(names.substr(0, comma));
  }
  return out;
}

TEST(Schema, HasTheKeysOfEveryPolicy) {
  const std::string wrong = "\"@@@@@@@@@@@@@@@@@@@@@@@@@@@@@@\": 1";
  const std::string joint = ", control: {joint_pd: {kp: 1}}}",
                    effector = ", control: {operational_pd: {kp: 1, kd: 1}}}";
  const std::string gait = "duration: 0.3 s, duty: 0.75, liftoff: 0, step_height: 1 cm";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"policy.gait", "{gait: {" + wrong + "}" + effector},
      {"policy.stance", "{gait: {" + gait + ", velocity: [0, 0, 0], stance: {" + wrong + "}}" + effector},
      {"policy.waypoints", "{gait: {" + gait + ", waypoints: {" + wrong + "}}" + effector},
      {"policy.waypoint_speed",
       "{gait: {" + gait + ", waypoints: {points: [[1, 0]], speed: {" + wrong + "}}}" + effector},
      {"policy.hold", "{hold: {" + wrong + "}" + joint},
      {"policy.joint_trajectory", "{joint_trajectory: {" + wrong + "}" + joint},
      {"policy.sinusoid", "{joint_trajectory: {sinusoid: {" + wrong + "}}" + joint},
      {"policy.torque", "{torque: {" + wrong + "}, control: {torque: {}}}"},
      {"tracker.joint_pd", "{hold: {}, control: {joint_pd: {" + wrong + "}}}"},
      {"tracker.operational_pd",
       "{gait: {" + gait + ", velocity: [0, 0, 0]}, control: {operational_pd: {" + wrong + "}}}"},
      {"tracker.prescribed", "{hold: {}, control: {prescribed: {" + wrong + "}}}"},
      {"tracker.torque", "{torque: {}, control: {torque: {" + wrong + "}}}"},
  };
  for (const auto& [section, policy] : cases) {
    SCOPED_TRACE(section);
    EXPECT_EQ(schema_keys(section), reader_keys(policy));
  }
  // Every definition of a policy or tracker in the schema is one of the cases.
  Names tested, all;
  for (const auto& one : cases) tested.insert(one.first);
  for (const auto& [name, value] : schema()["$defs"].items()) {
    if (name.starts_with("policy.") || name.starts_with("tracker.")) all.insert(name);
  }
  EXPECT_EQ(all, tested);
}

}  // namespace
}  // namespace graze
