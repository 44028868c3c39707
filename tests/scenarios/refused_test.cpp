// Claim: every wrong scenario of refused.yaml is refused with exactly the message that stands there: path, value, rule
// and the nearest right answer.
#include <gmock/gmock.h>

#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// Without "file:line:column: " in front.
std::string only_message(const std::string& message) {
  for (std::size_t at = message.find(": "); at != std::string::npos; at = message.find(": ", at + 1)) {
    if (at > 0 && std::isdigit(static_cast<unsigned char>(message[at - 1]))) return message.substr(at + 2);
  }
  return message;
}

TEST(Refused, EachCaseWithItsMessage) {
  const Settings file = Settings::load(testing::kFolder + "refused.yaml");
  const Settings base = file.at("base");
  ASSERT_EQ(testing::message_of([&] { parse_scenario(base.resolved_text(), testing::kFolder + "base.yaml"); }),
            "(accepted)");
  for (const Settings& one : file.at("cases").items()) {
    one.allow({"key", "value", "remove", "error", "starts", "ends", "file", "schema", "accepted"});
    const Settings scenario =
        one.has("remove") ? base.without(one.at("remove").text()) : base.with(one.at("key").text(), one.at("value"));
    const std::string message = only_message(
        testing::message_of([&] { parse_scenario(scenario.resolved_text(), testing::kFolder + "case.yaml"); }));
    SCOPED_TRACE(one.place());
    if (one.flag_or("accepted", false)) {
      EXPECT_EQ(message, "(accepted)");
    }
    if (one.has("error")) {
      EXPECT_EQ(message, one.at("error").text());
    }
    if (one.has("starts")) {
      EXPECT_THAT(message, StartsWith(one.at("starts").text()));
    }
    if (one.has("ends")) {
      EXPECT_THAT(message, EndsWith(one.at("ends").text()));
    }
    if (one.has("file")) {
      EXPECT_THAT(message, HasSubstr(testing::kFolder + one.at("file").text()));
    }
  }
}

// Claim: every doubtful scenario of doubted.yaml is read, with exactly the warnings that stand there.
TEST(Doubted, EachCaseWithItsWarnings) {
  const Settings base = Settings::load(testing::kFolder + "refused.yaml").at("base");
  EXPECT_THAT(parse_scenario(base.resolved_text(), testing::kFolder + "base.yaml").warnings, IsEmpty());
  for (const Settings& one : Settings::load(testing::kFolder + "doubted.yaml").at("cases").items()) {
    one.allow({"key", "value", "also", "warns"});
    SCOPED_TRACE(one.place());
    Settings scenario = base.with(one.at("key").text(), one.at("value"));
    if (const auto also = one.find("also")) {
      for (const auto& [key, value] : also->entries()) scenario = scenario.with(key, value);
    }
    std::vector<std::string> wanted, warnings;
    for (const Settings& text : one.at("warns").items()) wanted.push_back(text.text());
    EXPECT_EQ(testing::message_of([&] {
                for (const std::string& warning :
                     parse_scenario(scenario.resolved_text(), testing::kFolder + "case.yaml").warnings) {
                  EXPECT_THAT(warning, StartsWith(testing::kFolder + "case.yaml:"));
                  warnings.push_back(only_message(warning));
                }
              }),
              "(accepted)");
    EXPECT_EQ(warnings, wanted);
  }
}

// Claim: the place in front of a message is the line and column of the value or key that is wrong.
TEST(Refused, NamesThePlace) {
  const std::string text = testing::hopper("task:\n  requirements:\n    up: {tilt: {link: bse, below: 1 rad}}\n");
  EXPECT_THAT(testing::message_of([&] { testing::read(text); }),
              StartsWith(testing::kFolder + "test.yaml:8:23: task.requirements.up.tilt.link: bse: "));
  EXPECT_EQ(testing::message_of([] { load_scenario(testing::kFolder + "none.yaml"); }),
            testing::kFolder + "none.yaml: there is no such file");
}

// Claim: a mistake in --set is shown as it was typed.
TEST(Refused, NamesTheOverride) {
  ScenarioOptions options;
  options.overrides = {{"time.end", "-1 s"}};
  EXPECT_EQ(testing::message_of([&] { parse_scenario(testing::hopper(""), testing::kFolder + "a.yaml", options); }),
            "--set time.end=-1 s: time.end: -1 s: must be > 0");
}

}  // namespace
}  // namespace graze
