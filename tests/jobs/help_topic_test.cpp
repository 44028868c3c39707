// `graze help TOPIC` lists what there is, and tells each by its name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "engine/physics.h"
#include "engine/settings/settings.h"
#include "tests/jobs/program.h"

namespace graze::testing {
namespace {

using ::testing::HasSubstr;

std::string docs(const std::string& page) { return read_file(std::string(GRAZE_SOURCE_DIR) + "/docs/" + page); }

/// The names that stand in a list, "  NAME  what it is".
std::vector<std::string> names_in(const std::string& listed) {
  std::vector<std::string> out;
  std::istringstream lines(listed);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ")) out.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return out;
}

// Claim: every component that the program has is listed with its kind and told by its name: all that have the name,
// with what their keys are; and docs/ name it.
TEST(HelpTopics, NameEveryComponent) {
  const TemporaryFolder folder;
  const std::string pages = docs("control.md") + docs("scenario.md") + docs("sampling.md");
  const std::pair<const char*, const char*> kinds[] = {
      {"policies", "policy"}, {"trackers", "tracker"},           {"witnesses", "witness"}, {"shapes", "shape"},
      {"sensors", "sensor"},  {"distributions", "distribution"}, {"sections", "section"}};
  for (const auto& [kind, one] : kinds) {
    SCOPED_TRACE(kind);
    const std::string listed = graze(folder.path(), std::string("help ") + kind).out;
    EXPECT_EQ(graze(folder.path(), std::string("help ") + one).out, listed);
    EXPECT_THAT(listed, HasSubstr("docs/"));
    EXPECT_GE(names_in(listed).size(), 4u);
    for (const std::string& name : names_in(listed)) {
      SCOPED_TRACE(name);
      const Result told = graze(folder.path(), "help " + name);
      EXPECT_EQ(told.code, 0) << told.err;
      EXPECT_THAT("\n" + told.out, HasSubstr("\n" + name + ", " + "a " + one + ": "));
      if (std::string(kind) == "sections") continue;  // pages name them by the keys that they stand behind
      const bool named =
          pages.find("`" + name + "`") != std::string::npos || pages.find("`" + name + ":") != std::string::npos;
      EXPECT_TRUE(named || pages.find("`" + name + ".") != std::string::npos) << "stands on no page";
    }
  }
}

// Claim: keys are told with what they hold, their defaults and a line; a name that several components have tells of
// each.
TEST(HelpTopics, TellKeys) {
  const TemporaryFolder folder;
  const auto told = [&](const std::string& topic) { return graze(folder.path(), "help " + topic).out; };
  const std::string gait = told("gait");
  EXPECT_THAT(gait, HasSubstr("\n  key "));
  EXPECT_THAT(gait, ::testing::ContainsRegex("\n  duration +s, > 0 +required +of one cycle\n"));
  EXPECT_THAT(gait, ::testing::ContainsRegex("\n  redirect +0 to 1 +75 % +share of a swing"));
  EXPECT_THAT(gait,
              ::testing::ContainsRegex("\n  stance.height +m, > 0 or number, > 0 +0.9 of the shortest leg's reach"));
  EXPECT_THAT(gait, ::testing::ContainsRegex("\n  velocity +3 numbers or 6 numbers +this or waypoints"));
  EXPECT_THAT(told("no_contact"), ::testing::ContainsRegex("\n  within +m, > 0 +2 cm "));
  EXPECT_THAT(told("box"), HasSubstr("box, a shape: its edge lengths, [x, y, z]\nValue: 3 numbers, m, > 0\n"));
  EXPECT_THAT(told("normal"), ::testing::ContainsRegex("\n  std +parameter's unit, or % +required "));
  EXPECT_THAT(told("encoder"), HasSubstr("sensor.encoder.JOINT.velocity"));
  EXPECT_THAT(told("objective"), ::testing::ContainsRegex("\n  any +.PREDICATE, …. "));
  const std::string torque = told("torque");
  for (const char* kind : {"torque, a policy: ", "torque, a tracker: ", "torque, a sensor: "}) {
    EXPECT_THAT(torque, HasSubstr(kind));
  }
  EXPECT_THAT(told("contact"), ::testing::AllOf(HasSubstr("contact, a witness: "), HasSubstr("contact, a section: ")));
}

// Claim: back ends are listed with their contact models, the defaults first; all stand in their page.
TEST(HelpTopics, NameBackEndsAndContactModels) {
  const TemporaryFolder folder;
  const std::string page = docs("physics.md"), listed = graze(folder.path(), "help physics").out;
  std::size_t place = 0;
  for (const std::string& name : physics_names()) {
    EXPECT_THAT(listed, HasSubstr("  " + physics_text(name).help + "\n"));
    EXPECT_THAT(page, HasSubstr("`" + name + "`"));
    EXPECT_THAT(graze(folder.path(), "help " + name).out, HasSubstr(name + ", a back end: "));
    EXPECT_GT(listed.find("\n  " + name + " "), place) << name;
    place = listed.find("\n  " + name + " ");
    for (const auto& [model, help] : physics_text(name).contact_models) {
      EXPECT_GT(help.size(), 10u) << model;
      EXPECT_THAT(listed, HasSubstr("  " + help + "\n"));
      EXPECT_THAT(page, HasSubstr("`" + model + "`"));
      EXPECT_THAT(graze(folder.path(), "help " + model).out, HasSubstr(model + ", a contact model: "));
      EXPECT_GT(listed.find("\n    " + model + " "), place) << model;
      place = listed.find("\n    " + model + " ");
    }
  }
  EXPECT_LT(listed.find("\n  lanes "), listed.find("\n  bullet "));
}

// Claim: the shipped scenarios are listed with the names that they give themselves, wherever the data lie.
TEST(HelpTopics, NameTheShippedScenarios) {
  const TemporaryFolder folder;
  const Result shipped = graze(folder.path(), "help scenarios");
  EXPECT_EQ(shipped.code, 0) << shipped.err;
  ASSERT_FALSE(std::filesystem::is_empty(data("scenarios")));
  for (const auto& entry : std::filesystem::directory_iterator(data("scenarios"))) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string name = Settings::load(entry.path().string()).text_or("name", "");
    EXPECT_THAT(shipped.out, HasSubstr("\n  " + entry.path().stem().string() + " "));
    EXPECT_THAT(shipped.out, HasSubstr("  " + name + "\n")) << entry.path();
  }
  fs::create_directories(folder / "scenarios");
  write_file(folder / "scenarios" / "good.yaml", "name: A good one\n");
  write_file(folder / "scenarios" / "broken.yaml", "name: [\n");
  const std::string given = "GRAZE_DATA='" + folder.path().string() + "' '" + GRAZE_PROGRAM + "' help scenarios";
  const Result own = shell(folder.path(), given);
  EXPECT_EQ(own.code, 0) << own.err;
  EXPECT_THAT(own.out, HasSubstr("\n  broken\n"));
  EXPECT_THAT(own.out, HasSubstr("\n  good    A good one\n"));
  EXPECT_THAT(shell(folder.path(), "GRAZE_DATA=/nowhere '" + std::string(GRAZE_PROGRAM) + "' help scenarios").out,
              HasSubstr("GRAZE_DATA names the folder"));
}

// Claim: what is no topic is answered with the nearest, verb or topic; the overview names the topics.
TEST(HelpTopics, RefuseUnknownOnes) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& word) {
    const Result run = graze(folder.path(), "help " + word);
    EXPECT_EQ(run.code, 2);
    EXPECT_EQ(run.out, "");
    return run.err;
  };
  EXPECT_THAT(refused("senarios"),
              HasSubstr("'senarios' is not a verb, and no topic of help (did you mean 'scenarios'?)"));
  EXPECT_THAT(refused("trakers"), HasSubstr("did you mean 'trackers'?"));
  EXPECT_THAT(refused("no_contct"), HasSubstr("did you mean 'no_contact'?"));
  EXPECT_THAT(refused("table:gaits"), HasSubstr("no topic of help"));
  EXPECT_THAT(refused("chekc"), HasSubstr("did you mean 'check'?"));
  EXPECT_THAT(refused("elephants"),
              HasSubstr("topics: scenarios, sections, policies, trackers, sensors, shapes, distributions, witnesses, "
                        "objectives, physics, contact_models, schema; verbs: check, "));
  EXPECT_THAT(graze(folder.path(), "--help").out, HasSubstr("graze help scenarios, policies, trackers"));
}

}  // namespace
}  // namespace graze::testing
