// Claim: what witnesses, distributions, shapes and sections tell of themselves is what their readers do: a scenario
// with only what is required reads the same as with every default that is told written out.
#include <gmock/gmock.h>

#include "engine/model/channels.h"
#include "engine/model/fabrication.h"
#include "scenarios/distributions.h"
#include "scenarios/keys.h"
#include "scenarios/shapes.h"
#include "scenarios/witnesses.h"
#include "tests/engine/settings/spelled_out.h"
#include "tests/scenarios/support.h"
#include "tests/scenarios/task_bench.h"

namespace graze {
namespace {

using testing::hopper;

Scenario read(const Settings& settings) { return testing::read(settings.resolved_text()); }

Settings parsed(const std::string& text) { return Settings::parse(text, testing::kFolder + "test.yaml"); }

class WitnessDescriptions : public testing::TaskBench {};

// The robot touches nothing, and its margins tell how far gaps are measured.
TEST_F(WitnessDescriptions, TellTheirDefaults) {
  const std::pair<const char*, const char*> least[] = {
      {"tilt", "{link: base, below: 1}"},
      {"height", "{link: base, above: -1}"},
      {"position", "{link: base, x: {above: -1}}"},
      {"speed", "{link: base, below: 1}"},
      {"contact", "{between: [foot, block]}"},
      {"no_contact", "{between: [foot, block]}"},
      {"contact_impulse", "{between: [foot, block], below: 1}"},
      {"contact_force", "{between: [foot, block], below: 1}"},
      {"self_collision", "{}"},
      {"joint_limits", "{}"},
      {"torque_limits", "{}"},
      {"torque_speed", "{}"},
      {"joint_speed", "{below: 1}"},
  };
  ASSERT_EQ(std::size(least), witness_kinds().size());
  for (const auto& [name, keys] : least) {
    SCOPED_TRACE(name);
    const WitnessKind* const kind = kind_of(witness_kinds(), name);
    ASSERT_NE(kind, nullptr);
    const Settings required = parsed(keys);
    int count = 0;
    const Settings whole = spelled_out(required, "", kind->text, count);
    const ReadWitness a = kind->read(Described(required, kind->text), model_);
    const ReadWitness b = kind->read(Described(whole, kind->text), model_);
    EXPECT_EQ(a.description, b.description) << whole.resolved_text();
    EXPECT_EQ(a.unit, b.unit);
    if (kind->unit != "rad or m") {
      EXPECT_EQ(a.unit, kind->unit);
    }
    EXPECT_EQ(margin(*a.witness), margin(*b.witness)) << whole.resolved_text();
  }
  const auto told = [](const char* name) {
    return kind_of(witness_kinds(), name)->text.find("within")->otherwise.text;
  };
  EXPECT_EQ(told("no_contact"), "2 cm");
  EXPECT_EQ(margin("{no_contact: {between: [foot, block]}}"), 0.02);
  EXPECT_EQ(margin("{no_contact: {between: [foot, block], within: 3 cm}}"), 0.03);
  EXPECT_EQ(told("contact"), "2 cm");
  EXPECT_EQ(margin("{contact: {between: [foot, block]}}"), -0.02);
}

TEST(Descriptions, OfDistributionsAreRead) {
  const std::pair<const char*, const char*> least[] = {
      {"normal", "{std: 0.1}"},
      {"uniform", "{min: 1, max: 2}"},
      {"log_normal", "{log_std: 0.1}"},
      {"log_uniform", "{min: 1, max: 2}"},
      {"triangular", "{min: 0.5, max: 2}"},
      {"choice", "{values: [1, 2]}"},
      {"empirical", "{values: [1, 2]}"},
  };
  ASSERT_EQ(std::size(least), distribution_kinds().size());
  Parameter parameter;
  parameter.nominal = 1;
  for (const auto& [name, keys] : least) {
    SCOPED_TRACE(name);
    const DistributionKind* const kind = kind_of(distribution_kinds(), name);
    ASSERT_NE(kind, nullptr);
    const Settings settings = parsed(keys), wrong = parsed("{zzzzzzzzzzzz: 1}");
    const DrawnFor drawn{parameter, 1, 1, Standing::beside_nominal};
    EXPECT_GT(kind->read(Described(settings, kind->text), drawn).persistent.median(), 0);
    EXPECT_THROW(Described(wrong, kind->text), InputError);
    for (const Key& key : kind->text.keys) {  // what is not told as required is not
      EXPECT_EQ(key.otherwise.kind == Default::Kind::required && !settings.has(key.name), false) << key.name;
    }
  }
}

TEST(Descriptions, OfShapesTellTheirDefaults) {
  const std::string grid = "{size: [1, 2], heights: [[0, 1], [1, 0.5]]}";
  const Settings required = parsed(grid);
  const ShapeForm& form = *kind_of(shape_forms(), "heightfield");
  int count = 0;
  const Settings whole = spelled_out(required, "", form.text, count);
  EXPECT_EQ(count, 1);
  const Shape a = form.read(Described(required, form.text)), b = form.read(Described(whole, form.text));
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.grid->height, b.grid->height);
}

TEST(Descriptions, OfSectionsTellTheirDefaults) {
  Settings whole = parsed(hopper(""));
  int count = 0;
  for (const char* section :
       {"", "robot", "robot.initial", "contact", "time", "actuators", "control", "sampling", "task", "record"}) {
    const std::string path = section, name = path.substr(path.rfind('.') + 1);
    // What is described by another section stays out of this one, and a map must be there to be filled.
    if (!path.empty()) {
      const bool inner = path == "robot.initial";
      if (inner ? !whole.at("robot").has("initial") : !whole.has(path)) whole = whole.overridden({{path, "{}"}});
    }
    whole = spelled_out(whole, path, section_of(path.empty() ? "scenario" : name), count);
  }
  whole = spelled_out(whole, "environment.block", section_of("object"), count);
  EXPECT_GE(count, 20);
  const Scenario a = testing::read(hopper("")), b = read(whole);
  EXPECT_EQ(a.timing.end, b.timing.end);
  EXPECT_EQ(a.timing.step, b.timing.step);
  EXPECT_EQ(a.timing.control, b.timing.control);
  EXPECT_EQ(a.recording.telemetry, b.recording.telemetry);
  EXPECT_EQ(a.recording.every, b.recording.every);
  EXPECT_EQ(a.recording.last, b.recording.last);
  EXPECT_EQ(a.recording.events, b.recording.events);
  EXPECT_EQ(a.design, b.design);
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.particles, b.particles);
  EXPECT_EQ(a.physics, b.physics);
  EXPECT_EQ(a.torque_speed, b.torque_speed);
  EXPECT_EQ(a.task.stop_at_violation, b.task.stop_at_violation);
  EXPECT_EQ(a.world->gravity, b.world->gravity);
  EXPECT_EQ(a.world->control_lag, b.world->control_lag);
  EXPECT_EQ(a.world->contact.friction, b.world->contact.friction);
  EXPECT_EQ(a.world->contact.restitution, b.world->contact.restitution);
  for (const Spring& spring : {a.world->contact.spring, b.world->contact.spring, b.world->objects[1].spring}) {
    EXPECT_TRUE(std::isnan(spring.stiffness) && std::isnan(spring.damping));
  }
  EXPECT_EQ(a.world->contact.self_collision, b.world->contact.self_collision);
  const State before = initial_state(*a.world, a.model), after = initial_state(*b.world, b.model);
  EXPECT_EQ(before.q, after.q);
  EXPECT_EQ(before.v, after.v);
  for (std::size_t i = 0; i < a.world->robot.links.size(); ++i) {
    EXPECT_EQ(a.world->robot.links[i].inertia.mass, b.world->robot.links[i].inertia.mass);
  }
  EXPECT_TRUE(a.world->objects[1].X_WO.isApprox(b.world->objects[1].X_WO, 0));
  EXPECT_EQ(a.world->objects[1].movable, b.world->objects[1].movable);
}

// Every channel of a robot is described with the quantity that it has as a parameter.
TEST(Descriptions, OfChannelsTellTheirQuantities) {
  const Scenario scenario = testing::read(hopper(""));
  const ParameterTable table(*scenario.world);
  int revolute = 0;
  for (const std::string& name : channel_names(scenario.world->robot)) {
    const Parameter* const parameter = table.find(name);
    ASSERT_NE(parameter, nullptr) << name;
    for (const ChannelFamily& family : channel_families()) {
      for (const Key& key : family.text.keys) {
        std::string pattern = key.name;
        for (const char* place : {"JOINT", "LINK"}) {
          const std::size_t at = pattern.find(place);
          if (at != std::string::npos) pattern.replace(at, std::string(place).size(), "*");
        }
        if (!matches(pattern, name) || name.find("slide") != std::string::npos) continue;
        EXPECT_EQ(parameter->quantity, key.forms[0].quantity) << name;
        EXPECT_EQ(parameter->nominal, 0) << name;
        ++revolute;
      }
    }
  }
  EXPECT_GT(revolute, 20);
}

}  // namespace
}  // namespace graze
