// Claim: a description gives readers what it tells: defaults in SI, bounds, choices, and the refusal of other keys; and
// tables tell it as it is.
#include "engine/settings/description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace graze {
namespace {

using ::testing::HasSubstr;

const Description& kettle() {
  static const Description lid = {"what closes it",
                                  {{"mass", {Form::number(Quantity::mass)}, Default::value("20 g"), ""}}};
  static const Description text = {
      "boils water",
      {{"volume", {Form::number(Quantity::length, Bound::positive)}, Default::required(), "how `much`"},
       {"fill", {Form::fraction()}, Default::value("75 %"), "of it"},
       {"whistles", {Form::flag()}, Default::value("true"), ""},
       {"spout", {Form::word({"long", "short"})}, Default::value("short"), ""},
       {"handle", {Form::number(Quantity::length)}, Default::words("as wide as a hand"), ""},
       {"lid", {Form::map(lid)}, {}, ""},
       {"gas", {Form::number()}, {}, ""},
       {"current", {Form::number()}, {}, ""},
       {"tea", {Form::text("NAME"), Form::texts(-1, "NAME")}, {}, "", "lid"}},
      {{"gas", "current"}}};
  return text;
}

Settings yaml(const std::string& text) { return Settings::parse(text, "tea.yaml"); }

std::string error_of(const std::string& text) {
  try {
    const Settings settings = yaml(text);
    const Described own(settings, kettle());
    for (const char* key : {"volume", "fill"}) own.number(key);
    own.word("spout");
    own.flag("whistles");
  } catch (const InputError& e) {
    return e.what();
  }
  return "(accepted)";
}

TEST(Description, GivesTheDefaultsThatItTells) {
  const Settings settings = yaml("{volume: 2 cm, gas: 1}");
  const Described own(settings, kettle());
  EXPECT_EQ(own.number("volume"), 0.02);
  EXPECT_EQ(own.number("fill"), 0.75);
  EXPECT_TRUE(own.flag("whistles"));
  EXPECT_EQ(own.word("spout"), "short");
  EXPECT_FALSE(own.find_number("handle"));
  EXPECT_FALSE(own.find_number("current"));
  const Settings lid = yaml("{}");
  EXPECT_EQ(Described(lid, *kettle().find("lid")->forms[0].inner).number("mass"), 0.02);
}

TEST(Description, GivesWhatIsWritten) {
  const Settings settings = yaml("{volume: 1 m, fill: 10 %, whistles: false, spout: long, handle: 5 mm, gas: 1}");
  const Described own(settings, kettle());
  EXPECT_EQ(own.number("fill"), 0.1);
  EXPECT_FALSE(own.flag("whistles"));
  EXPECT_EQ(own.word("spout"), "long");
  EXPECT_EQ(own.find_number("handle"), 0.005);
}

TEST(Description, RefusesTheRest) {
  EXPECT_EQ(error_of("{volume: 1, fil: 1}"), "tea.yaml:1:13: fil: unknown key; did you mean 'fill'?");
  EXPECT_EQ(error_of("{gas: 1}"), "tea.yaml:1:1: the key 'volume' is missing");
  EXPECT_THAT(error_of("{volume: 0, gas: 1}"), HasSubstr("volume: 0: must be > 0"));
  EXPECT_THAT(error_of("{volume: 1 s, gas: 1}"), HasSubstr("the unit 's' does not fit; one of: m, cm, mm, in"));
  EXPECT_THAT(error_of("{volume: 1, fill: 2, gas: 1}"), HasSubstr("fill: 2: must lie within"));
  EXPECT_THAT(error_of("{volume: 1, spout: shrot, gas: 1}"), HasSubstr("one of: long, short; did you mean 'short'?"));
  EXPECT_THAT(error_of("3"), HasSubstr("must be a map"));
}

TEST(Description, TakesExactlyOneKeyOfAGroup) {
  EXPECT_EQ(error_of("{volume: 1}"), "tea.yaml:1:1: either 'gas' or 'current' must stand here");
  EXPECT_EQ(error_of("{volume: 1, current: 2, gas: 1}"),
            "tea.yaml:1:13: current: stands beside 'gas'; only one of the two may");
  EXPECT_EQ(error_of("{volume: 1, current: 2}"), "(accepted)");
}

TEST(Description, RefusesAKeyWithoutTheOneThatItGoesWith) {
  EXPECT_EQ(error_of("{volume: 1, gas: 1, tea: green}"),
            "tea.yaml:1:21: tea: goes with 'lid', which does not stand here");
  EXPECT_EQ(error_of("{volume: 1, gas: 1, tea: green, lid: {}}"), "(accepted)");
}

TEST(Description, BoundsCorrelations) {
  static const Description text = {"two of a kind",
                                   {{"likeness", {Form::number(Quantity::dimensionless, Bound::correlation)}, {}, ""}}};
  const auto read = [](const std::string& number) {
    return *Described(yaml("{likeness: " + number + "}"), text).find_number("likeness");
  };
  EXPECT_EQ(read("-1"), -1);
  EXPECT_EQ(read("1"), 1);
  EXPECT_THROW(read("1.01"), InputError);
  EXPECT_EQ(value_text(text.keys.front()), "-1 to 1");
}

TEST(Description, IsToldAsItIs) {
  const auto value = [](const char* key) { return value_text(*kettle().find(key)); };
  const auto otherwise = [](const char* key) { return default_text(kettle(), *kettle().find(key)); };
  EXPECT_EQ(value("volume"), "m, > 0");
  EXPECT_EQ(value("fill"), "0 to 1");
  EXPECT_EQ(value("spout"), "long, short");
  EXPECT_EQ(value("lid"), "map");
  EXPECT_EQ(value("tea"), "NAME or [NAME, …]");
  EXPECT_EQ(otherwise("volume"), "required");
  EXPECT_EQ(otherwise("fill"), "75 %");
  EXPECT_EQ(otherwise("handle"), "as wide as a hand");
  EXPECT_EQ(otherwise("gas"), "this or current");
  EXPECT_EQ(otherwise("lid"), "");
  std::vector<std::string> paths;
  for (const KeyRow& row : key_rows(kettle())) paths.push_back(row.path);
  EXPECT_THAT(paths, ::testing::ElementsAre("volume", "fill", "whistles", "spout", "handle", "lid", "lid.mass", "gas",
                                            "current", "tea"));
  EXPECT_EQ(plain("how `much`"), "how much");
  EXPECT_FALSE(kettle().may_be_empty());
}

}  // namespace
}  // namespace graze
