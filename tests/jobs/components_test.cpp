// Claim: a component is told of wherever there is something to tell by its description alone: its registration makes it
// a topic of help and a part of the schema and of the reader; and what the program ships tells the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>

#include "engine/control/policy.h"
#include "engine/settings/units.h"
#include "jobs/cli/description_text.h"
#include "jobs/cli/help_topics.h"
#include "jobs/cli/scenario_schema.h"
#include "scenarios/distributions.h"
#include "scenarios/scenario.h"
#include "scenarios/shapes.h"
#include "scenarios/witnesses.h"
#include "tests/jobs/program.h"

namespace graze::testing {
namespace {

using ::testing::HasSubstr;

Description toy(const std::string& help) {
  return {help,
          {{"spring", {Form::number(Quantity::stiffness, Bound::positive)}, Default::value("5 N/m"), "how `hard`"},
           {"colour", {Form::word({"red", "blue"})}, Default::value("red"), "of the paint"}}};
}

class Rest : public Policy {
  void start(int) override {}
  void act(const Observation&, LaneMask, Targets&) override {}
};

const PolicyRegistration policy("tin_soldier", toy("a policy that stands to attention"),
                                [](const ControlContext&, const Described&, TargetKind) {
                                  return std::make_unique<Rest>();
                                });

struct Always : Witness {
  void evaluate(const WitnessInput&, const BlockArray&, double* out, double*) const override {
    std::fill_n(out, kLanes, 1.0);
  }
};

const WitnessRegistration witness(
    {"tin_ear", toy("a witness that hears nothing"), "m", [](const Described& own, const Model&) {
       return ReadWitness{std::make_shared<Always>(), "spring of " + std::to_string(own.number("spring")), "m"};
     }});

const DistributionRegistration distribution({"tin_dice", toy("a distribution that always gives its spring"),
                                             [](const Described& own, const DrawnFor&) {
                                               Spread out;
                                               out.persistent = Distribution::constant(own.number("spring"));
                                               return out;
                                             }});

const ShapeRegistration shape({"tin_ball", toy("a ball of a thousandth of its spring"), [](const Described& own) {
                                 return Shape{ShapeKind::sphere, {own.number("spring") / 1000, 0, 0}, nullptr, nullptr};
                               }});

TEST(Components, AreTopicsOfHelp) {
  const std::array<const char*, 3> toys[] = {
      {"tin_soldier", "policies", "a policy that stands to attention"},
      {"tin_ear", "witnesses", "a witness that hears nothing"},
      {"tin_dice", "distributions", "a distribution that always gives its spring"},
      {"tin_ball", "shapes", "a ball of a thousandth of its spring"}};
  for (const auto& [name, group, help] : toys) {
    SCOPED_TRACE(name);
    const std::string own = help_on(name).value_or("");
    EXPECT_THAT(own, HasSubstr(help));
    EXPECT_THAT(own, HasSubstr("\n  key     value      default  meaning\n"));
    EXPECT_THAT(own, HasSubstr("\n  spring  N/m, > 0   5 N/m    how hard\n"));
    EXPECT_THAT(own, HasSubstr("\n  colour  red, blue  red      of the paint\n"));
    EXPECT_THAT(help_on(group).value_or(""), HasSubstr(help));
    EXPECT_THAT(docs_table(group).value_or(""), HasSubstr("| `" + std::string(name) + ": {spring, colour}` | "));
    EXPECT_THAT(component_topics(), ::testing::Contains(name));
  }
  EXPECT_THAT(docs_table("policy tin_soldier").value_or(""),
              HasSubstr("\n| `spring` | N/m, > 0 | 5 N/m | how `hard` |\n"));
}

TEST(Components, StandInTheSchema) {
  const auto schema = nlohmann::json::parse(scenario_schema());
  const std::array<const char*, 3> toys[] = {
      {"tin_soldier", "policy", "policy"},    {"tin_ear", "witness", "requirement"},
      {"tin_ear", "witness", "predicate"},    {"tin_dice", "distribution", "spread"},
      {"tin_dice", "distribution", "jitter"}, {"tin_ball", "shape", "object"}};
  for (const auto& [name, kind, holder] : toys) {
    SCOPED_TRACE(name);
    const std::string definition = std::string(kind) + "." + name;
    ASSERT_TRUE(schema["$defs"].contains(definition));
    EXPECT_EQ(schema["$defs"][holder]["properties"][name]["$ref"], "#/$defs/" + definition);
    const auto& ways = schema["$defs"][definition]["anyOf"];  // nothing, because no key is required; or the map
    EXPECT_EQ(ways[0]["type"], "null");
    const auto& keys = ways[1]["properties"];
    EXPECT_EQ(keys["spring"]["exclusiveMinimum"], 0);
    EXPECT_EQ(keys["spring"]["default"], "5 N/m");
    EXPECT_EQ(keys["spring"]["description"], "how hard");
    EXPECT_EQ(keys["colour"]["enum"], nlohmann::json({"red", "blue"}));
  }
  const auto& defs = schema["$defs"];
  EXPECT_EQ(defs["shape.box"]["$ref"], "#/$defs/list.length.3.positive");
  EXPECT_EQ(defs["list.length.3.positive"]["anyOf"][0]["items"]["anyOf"][0]["exclusiveMinimum"], 0);
  EXPECT_EQ(defs["witness.self_collision"]["anyOf"][0]["const"], true);
}

TEST(Components, AreReadByTheirDescriptions) {
  const auto read = [](const std::string& keys) {
    const std::string text = R"(graze: 1
robot: {urdf: robots/pendulum.urdf, base: fixed}
environment: {marble: {tin_ball: {)" +
                             keys + R"(}, position: [9, 9, 9]}}
time: {end: 10 ms}
uncertain: {gravity.x: {tin_dice: {}}}
policies: {p: {tin_soldier: {}, control: {torque: {}}}}
task: {measures: {m: {tin_ear: {spring: 7 N/m}}}}
)";
    return parse_scenario(text, data("test.yaml"));
  };
  const Scenario scenario = read("spring: 20 N/m");
  EXPECT_EQ(scenario.world->objects[0].shape.size.x(), 0.02);
  EXPECT_EQ(read("").world->objects[0].shape.size.x(), 0.005);
  EXPECT_EQ(scenario.space.parameters[0].persistent.median(), 5);
  EXPECT_THAT(scenario.task.requirements[0].description, HasSubstr("spring of 7"));
  try {
    read("sprin: 1");
    FAIL() << "no InputError";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("environment.marble.tin_ball.sprin: unknown key; did you mean 'spring'?"));
  }
}

// What no reader would notice: a default that is no value of its key, a partner that is not there, a line too many.
TEST(Components, AreDescribedSensibly) {
  const auto check = [](const Description& text, const std::string& name) {
    SCOPED_TRACE(name);
    EXPECT_GT(text.help.size(), 8u);
    for (const KeyRow& row : key_rows(text)) {
      SCOPED_TRACE(row.path);
      const Key& key = *row.key;
      EXPECT_FALSE(key.forms.empty());
      EXPECT_FALSE(key.help.empty());
      EXPECT_EQ(key.help.find('\n'), std::string::npos);
      EXPECT_TRUE(key.with.empty() || row.description->find(key.with) != nullptr);
      if (key.otherwise.kind != Default::Kind::value) continue;
      const Form& form = key.forms.front();
      const auto written = split_number(key.otherwise.text);
      if (form.kind == Form::Kind::number || form.kind == Form::Kind::joint_numbers) {
        EXPECT_TRUE(written && to_si(form.quantity, written->value, written->unit));
      } else if (form.kind == Form::Kind::flag) {
        EXPECT_TRUE(key.otherwise.text == "true" || key.otherwise.text == "false");
      } else if (form.kind == Form::Kind::word) {
        EXPECT_THAT(form.words, ::testing::Contains(key.otherwise.text));
      }
    }
  };
  for (const ComponentGroup& group : component_groups()) {
    for (const Component& component : group.all) check(component.text, group.one + " " + component.name);
  }
}

// The pages and the schema are those of the program, which has none of the tests' own components.
TEST(Components, AreToldInDocsAndSchemaAsTheyAre) {
  const TemporaryFolder folder;
  const std::string source = GRAZE_SOURCE_DIR;
  const Result run = shell(
      folder.path(), "/usr/bin/python3 '" + source + "/tests/docs/tables.py' '" + source + "' '" + GRAZE_PROGRAM + "'");
  EXPECT_EQ(run.code, 0) << run.out << run.err;
}

}  // namespace
}  // namespace graze::testing
