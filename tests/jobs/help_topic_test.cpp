// `graze help TOPIC` lists what there is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/control/policy.h"
#include "engine/physics.h"
#include "jobs/cli/shipped.h"
#include "scenarios/witnesses.h"
#include "tests/jobs/program.h"

namespace graze::testing {
namespace {

using ::testing::HasSubstr;

std::string docs(const std::string& page) { return read_file(std::string(GRAZE_SOURCE_DIR) + "/docs/" + page); }

/// A component has a line of help, and its page names it in code style.
void expect_told(const std::string& name, const std::string& help, const std::string& listed, const std::string& page) {
  EXPECT_GT(help.size(), 10u) << name;
  EXPECT_EQ(help.find('\n'), std::string::npos) << name;
  EXPECT_THAT(listed, HasSubstr("\n  " + name + " "));
  EXPECT_THAT(listed, HasSubstr("  " + help + "\n"));
  const bool named =
      page.find("`" + name + "`") != std::string::npos || page.find("`" + name + ":") != std::string::npos;
  EXPECT_TRUE(named || page.find("`" + name + " {") != std::string::npos) << name << " stands in no line of its page";
}

// Claim: every registered policy, tracker and witness has a line of help, is listed with it, and stands in its page.
TEST(HelpTopics, NameEveryComponent) {
  const TemporaryFolder folder;
  const std::string control = docs("control.md"), scenario = docs("scenario.md");
  const std::string policies = graze(folder.path(), "help policies").out,
                    trackers = graze(folder.path(), "help trackers").out,
                    witnesses = graze(folder.path(), "help witnesses").out;
  for (const std::string& name : policy_names()) {
    if (name == "faulty") continue;  // of the tests of containment, which share this program
    expect_told(name, policy_text(name).help, policies, control);
    EXPECT_THAT(scenario, HasSubstr("`" + name + "`"));
  }
  for (const std::string& name : tracker_names()) {
    expect_told(name, tracker_text(name).help, trackers, control);
    EXPECT_THAT(scenario, HasSubstr("`" + name + "`"));
  }
  for (const WitnessKind& kind : witness_kinds()) expect_told(kind.name, kind.help, witnesses, scenario);
  EXPECT_THAT(policies, HasSubstr("docs/control.md"));
  EXPECT_THAT(trackers, HasSubstr("docs/control.md"));
  EXPECT_THAT(witnesses, HasSubstr("docs/scenario.md"));
}

// Claim: back ends are listed with their contact models, the defaults first; all stand in their page.
TEST(HelpTopics, NameBackEndsAndContactModels) {
  const TemporaryFolder folder;
  const std::string page = docs("physics.md"), listed = graze(folder.path(), "help physics").out;
  std::size_t place = 0;
  for (const std::string& name : physics_names()) {
    expect_told(name, physics_text(name).help, listed, page);
    EXPECT_GT(listed.find("\n  " + name + " "), place) << name;
    place = listed.find("\n  " + name + " ");
    for (const auto& [model, help] : physics_text(name).contact_models) {
      EXPECT_GT(help.size(), 10u) << model;
      EXPECT_THAT(listed, HasSubstr("  " + help + "\n"));
      EXPECT_THAT(page, HasSubstr("`" + model + "`"));
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
  EXPECT_THAT(refused("tracker"), HasSubstr("did you mean 'trackers'?"));
  EXPECT_THAT(refused("chekc"), HasSubstr("did you mean 'check'?"));
  EXPECT_THAT(refused("elephants"),
              HasSubstr("topics: scenarios, policies, trackers, witnesses, physics; verbs: check, "));
  EXPECT_THAT(graze(folder.path(), "--help").out, HasSubstr("graze help scenarios, policies, trackers"));
}

}  // namespace
}  // namespace graze::testing
