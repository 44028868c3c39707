// `graze help TOPIC` lists what there is, and tells each by its name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <sstream>

#include "archive/files/utf8.h"
#include "engine/physics.h"
#include "engine/settings/settings.h"
#include "engine/settings/units.h"
#include "jobs/cli/help_topics.h"
#include "jobs/cli/key_topics.h"
#include "jobs/cli/scenario_schema.h"
#include "jobs/cli/wrapped_text.h"
#include "tests/jobs/program.h"

namespace graze::testing {
namespace {

using ::testing::HasSubstr;

/// The width of whoever runs the tests is none of theirs.
[[maybe_unused]] const int forgotten = unsetenv("COLUMNS");

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
  EXPECT_THAT(shell(folder.path(), "GRAZE_DATA=/nowhere '" + std::string(GRAZE_PROGRAM) + "' check quadruped_walk").err,
              HasSubstr("quadruped_walk: there is no such file, and no shipped scenarios were found; the environment "
                        "variable GRAZE_DATA"));
  EXPECT_THAT(graze(folder.path(), "check quadruped_wak").err,
              HasSubstr("quadruped_wak: there is no such file; did you mean the shipped scenario 'quadruped_walk'?"));
  EXPECT_THAT(graze(folder.path(), "check rabbit").err, ::testing::Not(HasSubstr("did you mean")));
}

/// In characters.
std::size_t longest_line(const std::string& text) {
  std::istringstream lines(text);
  std::size_t longest = 0;
  for (std::string line; std::getline(lines, line);) longest = std::max(longest, width_of(line));
  return longest;
}

// Claim: help fits the width that COLUMNS tells, every topic of it; the words are those of the whole lines, which a
// pipe or a file gets without it.
TEST(HelpTopics, FitTheTerminal) {
  const TemporaryFolder folder;
  const auto words = [](const std::string& text) {
    std::istringstream in(text);
    std::multiset<std::string> out;
    for (std::string word; in >> word;) out.insert(word);
    return out;
  };
  std::vector<std::string> topics = help_topics();
  for (const char* one : {"gait", "noise", "record", "object", "contact", "torque", "environment", "uncertain", "over",
                          "velocity", "quadruped_walk", "initial", "encoder"}) {
    topics.push_back(one);
  }
  for (const std::string& topic : topics) {
    if (topic == "schema") continue;  // is JSON
    SCOPED_TRACE(topic);
    const std::string narrow = help_on(topic, 80).value_or("");
    EXPECT_EQ(words(narrow), words(help_on(topic).value_or("")));
    EXPECT_EQ(narrow.find(" \n"), std::string::npos) << "blanks at an end";
    if (topic == "scenarios" || topic == "quadruped_walk") continue;  // paths of this machine may be longer
    EXPECT_LE(longest_line(narrow), topic == "sensors" || topic == "encoder" ? 100u : 80u) << narrow;
  }
  EXPECT_EQ(shell(folder.path(), "COLUMNS=80 '" + std::string(GRAZE_PROGRAM) + "' help gait").out, help_on("gait", 80));
  EXPECT_EQ(graze(folder.path(), "help gait").out, help_on("gait"));
  for (const char* verb : {"", "check", "run", "score", "replay", "submit"}) {
    SCOPED_TRACE(verb);
    const std::string given = "COLUMNS=80 '" + std::string(GRAZE_PROGRAM) + "' " + verb + " --help";
    const std::string told = shell(folder.path(), given).out;
    EXPECT_LE(longest_line(told.substr(0, told.find("\nExamples:"))), 80u) << told;
  }
}

// Claim: lines break between words, what is wrapped hangs below its column, and a word that is too long stays whole.
TEST(HelpTopics, WrapLines) {
  EXPECT_EQ(wrapped("one two three", kUnlimited), "one two three");
  EXPECT_EQ(wrapped("one two three", 8), "one two\nthree");
  EXPECT_EQ(wrapped("  one two three\n\nb", 8, 2), "  one\n    two\n    three\n\nb");
  EXPECT_EQ(wrapped("a unbreakable b", 5), "a\nunbreakable\nb");
  EXPECT_EQ(columns_text({{"key", "m²"}, {"k", "x"}}, kUnlimited), "  key  m²\n  k    x\n");
  EXPECT_EQ(columns_text({{"key", "what it is for, in words"}}, 22), "  key  what it is for,\n       in words\n");
}

// Claim: several topics and verbs are told one after the other; a topic in a verb's place points to its help.
TEST(HelpTopics, AreToldOneAfterTheOther) {
  const TemporaryFolder folder;
  const auto told = [&](const std::string& line) { return graze(folder.path(), line).out; };
  EXPECT_EQ(told("help gait hold"), told("help gait") + "\n" + told("help hold"));
  EXPECT_EQ(told("help gait run"), told("help gait") + "\n" + told("run --help"));
  EXPECT_THAT(graze(folder.path(), "help gait nosuch").err, HasSubstr("'nosuch' is not a verb, and no topic of help"));
  EXPECT_EQ(told("help gait --help"), told("help gait"));
  for (const char* line : {"gait", "gait --help", "gait -n 3"}) {
    const Result run = graze(folder.path(), line);
    EXPECT_EQ(run.code, 2);
    EXPECT_THAT(run.err, HasSubstr("'gait' is not a verb; 'graze help gait' tells what it is"));
  }
}

// Claim: what is written in a scenario is a topic, too: maps of names that the author gives, keys, paths, words, units,
// scenarios.
TEST(HelpTopics, LeadFromWhatIsWritten) {
  const auto told = [](const std::string& topic) { return help_on(topic).value_or("(none)"); };
  EXPECT_THAT(told("environment"), ::testing::AllOf(HasSubstr("object, a section"), HasSubstr("\n  heightfield  ")));
  EXPECT_THAT(told("uncertain"), ::testing::AllOf(HasSubstr("robot.joint.JOINT.axis"), HasSubstr("docs/parameters.md"),
                                                  HasSubstr("\n  log_normal "), HasSubstr("spread, a section")));
  EXPECT_THAT(told("over"), HasSubstr("over: {gait.step_height: [1 cm, 2 cm]}"));
  EXPECT_THAT(told("include"), HasSubstr("include: base.yaml"));
  EXPECT_THAT(told("requirements"), ::testing::AllOf(HasSubstr("\n  tilt "), HasSubstr("\n  window ")));
  EXPECT_THAT(told("measures"), HasSubstr("decide nothing"));
  EXPECT_EQ(told("predicate"), told("objective"));
  const std::string units = told("units");
  for (std::size_t i = 1; i < quantity_names().size(); ++i) {
    EXPECT_THAT(units, HasSubstr("  " + units_of(static_cast<Quantity>(i)) + "\n"));
  }
  EXPECT_THAT(told("time.step"), ::testing::ContainsRegex("\n  time.step +s, > 0 +1 ms +of the physics\n"));
  EXPECT_THAT(told("policies.walk.gait.velocity"), ::testing::ContainsRegex("\n  gait.velocity +3 numbers"));
  EXPECT_THAT(told("step_height"), HasSubstr("\n  gait.step_height "));
  EXPECT_THAT(told("contacts.from"), HasSubstr("\n  inverse_dynamics.contacts.from "));
  EXPECT_EQ(told("robot.initial"), told("initial"));
  EXPECT_THAT(told("sensor.encoder"), HasSubstr("encoder, a sensor: "));
  EXPECT_THAT(told("sensor.torque.hip"), HasSubstr("torque, a sensor: "));
  EXPECT_THAT(told("robot.link.base.mass"), HasSubstr("robot.link.LINK.{density,mass"));
  EXPECT_THAT(told("sobol"), ::testing::ContainsRegex("a value of:\n\n.*\n  sampling.design "));
  EXPECT_THAT(told("quadruped_walk"),
              ::testing::AllOf(HasSubstr(Settings::load(data("scenarios/quadruped_walk.yaml")).at("name").text()),
                               HasSubstr("quadruped_walk.yaml\n")));
  EXPECT_THAT(told("help"), HasSubstr("\n  policies "));
  EXPECT_THAT(told("control"), ::testing::AllOf(HasSubstr("control, a section"), HasSubstr("control: {TRACKER: {…}}")));
  EXPECT_THAT(told("noise"), HasSubstr("Only below jitter"));
  EXPECT_THAT(told("cone"), HasSubstr("robot.joint.JOINT.axis"));
  for (const std::string& topic : key_topics()) EXPECT_NE(told(topic), "(none)") << topic;
  for (const std::string& topic : component_topics()) EXPECT_NE(told(topic), "(none)") << topic;
  for (const char* none : {"", ".", "gait.", ".gait", "gait.nosuch", "nosuch.gait.", "time.nosuch"}) {
    EXPECT_EQ(told(none), "(none)") << none;
  }
}

// Claim: a path is help's if it is a parameter's or a key's; a misspelt one is answered with the nearest.
TEST(HelpTopics, TellPathsThatThereAre) {
  const TemporaryFolder folder;
  for (const char* path : {"contact.friction", "robot.link.LF_SHIN.density", "robot.link.a.b.size.x", "gravity.z",
                           "robot.joint.hip.axis", "environment.curb.position.y", "initial.base.velocity.x"}) {
    EXPECT_EQ(graze(folder.path(), std::string("help ") + path).code, 0) << path;
  }
  EXPECT_THAT(graze(folder.path(), "help contact.slover").err,
              HasSubstr("'contact.slover' is not a verb, and no topic of help (did you mean 'contact.solver'?)"));
  for (const char* path : {"contact.nothing.at.all", "robot.link.foot", "gravity.w", "environment."}) {
    EXPECT_THAT(graze(folder.path(), std::string("help ") + path).err, HasSubstr("no topic of help")) << path;
  }
}

// Claim: of a key that holds a map its own keys are told, not those of another thing that is called the same.
TEST(HelpTopics, TellTheMapOfAKey) {
  const TemporaryFolder folder;
  const std::string told = graze(folder.path(), "help robot.mesh").out;
  EXPECT_THAT(told, HasSubstr("robot.mesh, a key of robot"));
  EXPECT_THAT(told, HasSubstr("concave meshes as several hulls"));
  EXPECT_THAT(told, ::testing::Not(HasSubstr("a shape")));
}

// Claim: what is no topic is answered with the nearest, verb or topic, if one is near; the overview names the topics.
TEST(HelpTopics, LeadToPagesOfTheDocumentation) {
  const TemporaryFolder folder;
  for (const char* page : {"determinism", "controllers", "tutorial"}) {
    const Result told = graze(folder.path(), std::string("help ") + page);
    EXPECT_EQ(told.code, 0) << page << told.err;
    EXPECT_THAT(told.out, HasSubstr(std::string("docs/") + page + ".md")) << page;
  }
  EXPECT_EQ(graze(folder.path(), "help ../README").code, 2);
}

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
  EXPECT_THAT(refused("gait.velocty"), HasSubstr("did you mean 'gait.velocity'?"));
  EXPECT_THAT(refused("quadruped_wlk"), HasSubstr("did you mean 'quadruped_walk'?"));
  EXPECT_THAT(refused("table:gaits"), HasSubstr("no topic of help"));
  EXPECT_THAT(refused("chekc"), HasSubstr("did you mean 'check'?"));
  EXPECT_EQ(refused("elephants"),
            "graze: 'elephants' is not a verb, and no topic of help; 'graze help help' lists the topics\n");
  for (const char* far : {"planets", "rabbit", "jointing"}) {
    EXPECT_THAT(refused(far), ::testing::Not(HasSubstr("did you mean"))) << far;
  }
  const std::string overview = graze(folder.path(), "--help").out, topics = graze(folder.path(), "help help").out;
  EXPECT_THAT(overview, HasSubstr("graze help scenarios, policies, trackers"));
  for (const std::string& topic : help_topics()) {
    EXPECT_THAT(overview, HasSubstr(topic));
    EXPECT_THAT(topics, HasSubstr(topic));
  }
}

}  // namespace
}  // namespace graze::testing
