// The grammar of options, the same for every verb: numbers, empty and missing values, unknown and doubled options.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "engine/settings/settings.h"
#include "jobs/cli/option_values.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// The message with which `act` refuses; empty: it does not.
template <class Act>
std::string refusal(const Act& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string whole_refusal(const std::string& text, std::uint64_t least, std::uint64_t most) {
  return refusal([&] { parse_whole(text, "--some", least, most); });
}

constexpr std::uint64_t kLargest = std::numeric_limits<std::uint64_t>::max();

// Claim: digits are decimal, whatever zeros they begin with, up to the largest number that there is.
TEST(WholeNumber, IsDecimal) {
  EXPECT_EQ(parse_whole("10", "--some", 0, kLargest), 10u);
  EXPECT_EQ(parse_whole("010", "--some", 0, kLargest), 10u);
  EXPECT_EQ(parse_whole("089", "--some", 0, 89), 89u);
  EXPECT_EQ(parse_whole("18446744073709551615", "--some", 0, kLargest), kLargest);
}

// Claim: whatever else is refused with option, value, rule and the nearest number that would do.
TEST(WholeNumber, RefusesTheRestWithTheNearestRightAnswer) {
  const std::vector<std::pair<std::string, std::string>> right = {{"-1", "0"},
                                                                  {"18446744073709551616", "18446744073709551615"},
                                                                  {"99999999999999999999999", "18446744073709551615"},
                                                                  {"1e400", "18446744073709551615"},
                                                                  {"1e6", "1000000"},
                                                                  {"1_000", "1000"},
                                                                  {"1,000", "1000"},
                                                                  {"+5", "5"},
                                                                  {" 5", "5"},
                                                                  {"5s", "5"},
                                                                  {"0x10", "0"},
                                                                  {"2.6", "3"}};
  for (const auto& [text, answer] : right) {
    EXPECT_EQ(whole_refusal(text, 0, kLargest), "--some " + text +
                                                    ": is not a whole number from 0 to 18446744073709551615, in "
                                                    "digits; nearest right answer: " +
                                                    answer);
    EXPECT_EQ(whole_refusal(answer, 0, kLargest), "") << "the nearest right answer is right";
  }
  EXPECT_THAT(whole_refusal("0", 1, 9), HasSubstr("nearest right answer: 1"));
  EXPECT_THAT(whole_refusal("10", 1, 9), HasSubstr("nearest right answer: 9"));
  for (const char* none : {"", "many", "-", "nan", "inf", "ten"}) {
    EXPECT_THAT(whole_refusal(none, 0, 9), AllOf(HasSubstr("whole number from 0 to 9"), Not(HasSubstr("nearest"))));
  }
}

// Claim: a time is read as in scenarios, and refused with the nearest right answer.
TEST(Seconds, AreReadAsInScenarios) {
  EXPECT_EQ(parse_seconds("5", "--some", 0.01, 100), 5.0);
  EXPECT_EQ(parse_seconds("5s", "--some", 0.01, 100), 5.0);
  EXPECT_EQ(parse_seconds("0.5 s", "--some", 0.01, 100), 0.5);
  EXPECT_EQ(parse_seconds("20 ms", "--some", 0.01, 100), 0.02);
  const auto refused = [](const std::string& text) {
    return refusal([&] { parse_seconds(text, "--some", 0.01, 1000); });
  };
  EXPECT_THAT(refused("-1"), AllOf(StartsWith("--some -1: "), HasSubstr("nearest right answer: 0")));
  EXPECT_EQ(parse_seconds("0", "--some", 0.01, 1000), 0.0);
  EXPECT_THAT(refused("1 us"), HasSubstr("nearest right answer: 0.01"));
  EXPECT_THAT(refused("1e9"), HasSubstr("nearest right answer: 1000"));
  EXPECT_THAT(refused("5 min"), HasSubstr("nearest right answer: 300"));
  EXPECT_THAT(refused("soon"), AllOf(HasSubstr("seconds from 0.01 to 1000"), Not(HasSubstr("nearest"))));
}

class OptionGrammar : public ::testing::Test {
 protected:
  testing::BallCampaign campaign;

  /// Exit code 2, and one line that begins with "graze: " and says all of `parts`.
  void refused(const std::string& arguments, const std::vector<std::string>& parts) {
    const testing::Result run = campaign.graze(arguments);
    EXPECT_EQ(run.code, 2) << arguments << run.err;
    EXPECT_THAT(run.err, StartsWith("graze: ")) << arguments;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << arguments << run.err;
    for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part)) << arguments;
    EXPECT_EQ(run.out, "") << arguments;
  }
};

// Claim: every whole-number option of every verb has the one grammar.
TEST_F(OptionGrammar, EveryWholeNumberIsReadInTheSameWay) {
  const std::vector<std::pair<std::string, std::string>> options = {{"run ball.yaml", "--seed"},
                                                                    {"run ball.yaml", "--particles"},
                                                                    {"run ball.yaml", "--threads"},
                                                                    {"run ball.yaml", "--every"},
                                                                    {"sample ball.yaml", "--seed"},
                                                                    {"check ball.yaml", "--particles"},
                                                                    {"resume a.graze", "--particles"},
                                                                    {"resume a.graze", "--threads"},
                                                                    {"replay a.graze", "--particle"},
                                                                    {"submit ball.yaml --time 9", "--nodes"},
                                                                    {"submit ball.yaml --time 9", "--ntasks-per-node"},
                                                                    {"submit ball.yaml --time 9", "--cpus-per-task"},
                                                                    {"submit ball.yaml --time 9", "--array"},
                                                                    {"submit ball.yaml --time 9", "--seed"}};
  for (const auto& [verb, option] : options) {
    refused(verb + " " + option + " -1", {option + " -1: is not a whole number from ", "nearest right answer: "});
    refused(verb + " " + option + " 1_000x", {option + " 1_000x: is not a whole number", "right answer: 1000"});
    refused(verb + " " + option + " 1e30", {option + " 1e30: is not a whole number", "nearest right answer: "});
  }
  refused("run ball.yaml -n 4294967296", {"--particles 4294967296", "nearest right answer: 4294967295"});
  refused("resume a.graze -n 4294967296", {"--particles 4294967296", "nearest right answer: 4294967295"});
}

// Claim: zeros in front mean nothing, in the archive too.
TEST_F(OptionGrammar, LeadingZerosAreDecimal) {
  ASSERT_EQ(campaign.graze("run ball.yaml -n 010 --seed 010 --threads 02 --quiet -o a.graze").code, 0);
  const Archive archive(campaign.folder / "a.graze");
  EXPECT_EQ(archive.info().particles, 10u);
  EXPECT_EQ(archive.info().seed, 10u);
  EXPECT_THAT(campaign.graze("replay a.graze --particle 08").out, HasSubstr("particle 8 under policy still"));
}

// Claim: an option that a verb does not have is named with the nearest one that it has.
TEST_F(OptionGrammar, UnknownOptionsNameTheNearest) {
  refused("run ball.yaml --polcy free", {"run: --polcy: ", "did you mean '--policy'?"});
  refused("run --polcy free ball.yaml", {"run: --polcy: ", "did you mean '--policy'?"});
  refused("run ball.yaml --treads=2", {"run: --treads: ", "'--threads'"});
  refused("run ball.yaml -seed 5", {"run: -seed: ", "'--seed'"});
  refused("replay a.graze --particl 1", {"replay: --particl: ", "'--particle'"});
  refused("submit ball.yaml --time 9 --untl 'p > 0.5'", {"submit: --untl: ", "'--until'"});
  refused("submit ball.yaml --time 9 --partion x", {"submit: --partion: ", "'--partition'"});
  refused("score a.graze --elephant", {"--elephant", "'graze score --help'"});
  refused("--verson", {"--verson", "did you mean '--version'?"});
  refused("--json score a.graze", {"--json", "options of a verb stand behind it"});
  refused("", {"verbs: new, check"});
  refused("run ball.yaml other.yaml", {"run: 'other.yaml' is one word too many"});
  refused("replay a.graze", {"replay: --particle is required", "graze replay --help"});
  refused("run ball.yaml --telemetry failres", {"--telemetry failres: is none of", "nearest right answer: failures"});
  refused("run ball.yaml --watchdog 5x", {"--watchdog 5x: ", "nearest right answer: 5"});
  refused("run ball.yaml --watchdog 1us", {"--watchdog 1us: ", "from 0.01 to ", "nearest right answer: 0.01"});
  EXPECT_EQ(campaign.graze("run ball.yaml -n 2 --watchdog 5s --quiet").code, 0);
}

// Claim: what may be given once is refused the second time, with both values; what may be repeated is not.
TEST_F(OptionGrammar, DoubledOptionsAreRefused) {
  refused("run ball.yaml -n 8 --particles=9", {"run: --particles: is given twice, as 8 and as 9"});
  EXPECT_EQ(campaign.graze("run ball.yaml -n 2 --policy still --policy 's*' --quiet").code, 0);
}

// Claim: no option takes an empty value, nor the option behind it for its value; a value that looks like one can still
// be written behind '='.
TEST_F(OptionGrammar, EmptyAndMissingValuesAreRefused) {
  refused("run ball.yaml -o ''", {"run: -o: its value is empty"});
  refused("run ball.yaml --output=", {"run: --output: its value is empty"});
  refused("run ''", {"run: one of the words is empty"});
  refused("run ball.yaml --policy", {"run: --policy: its value is missing"});
  refused("run ball.yaml --policy --json", {"--policy: its value is missing: --json is an option itself"});
  refused("run ball.yaml --policy=--json", {"--policy --json"});
  refused("submit ball.yaml --time 90 --partition= --dry-run", {"submit: --partition: its value is empty"});
  refused("submit ball.yaml --time 90 --until '' --dry-run", {"submit: --until: its value is empty"});
  EXPECT_FALSE(std::filesystem::exists(campaign.folder / "ball.graze"));
}

// Claim: dashes and '=' that stand where they do nothing are told, with what would do.
TEST_F(OptionGrammar, DashesAreToldApart) {
  refused("sample ball.yaml -o --", {"sample: -o: its value is missing: -- ends the options", "-o ./--"});
  refused("run ball.yaml -o=eq.graze", {"run: -o=eq.graze: '=' goes with long", "nearest right answer: -o eq.graze"});
  refused("run ball.yaml -n=8", {"run: -n=8: '='", "nearest right answer: -n 8"});
  refused("submit ball.yaml --time 9 -o=x --dry-run", {"submit: -o=x: '='"});
  testing::write_file(campaign.folder / "-my ball.yaml", testing::ball_scenario());
  refused("check '-my ball.yaml'", {"the file of that name is './-my ball.yaml'"});
  refused("run -- '-my ball.yaml' -n 8", {"run: '-n' stands behind '--'"});
  refused("run ball.yaml -- other.yaml", {"run: ", "other.yaml"});
  EXPECT_EQ(campaign.graze("check './-my ball.yaml'").code, 0);
  EXPECT_EQ(campaign.graze("check -- '-my ball.yaml'").code, 0);
  EXPECT_FALSE(std::filesystem::exists(campaign.folder / "--"));
}

// Claim: --set KEY= is refused; KEY=~ takes away what the scenario says there.
TEST_F(OptionGrammar, SetNeedsAValue) {
  refused("check ball.yaml --set time.end=", {"--set time.end=: the value is empty; --set time.end=~"});
  refused("check ball.yaml --set 'time.end= '", {"--set time.end="});
  EXPECT_THAT(campaign.graze("check ball.yaml --set time.end=~").out, HasSubstr("time         1 s in steps"));
}

// Claim: a list or map that is not closed is told so, and quoted brackets are text.
TEST_F(OptionGrammar, SetTellsOfBrackets) {
  refused("check ball.yaml --set 'time.end=[1'", {"--set time.end=[1: '[' has no ']'; nearest right answer: [1]"});
  refused("check ball.yaml --set 'time={end: 1 s'", {"'{' has no '}'; nearest right answer: {end: 1 s}"});
  refused("check ball.yaml --set 'time={end: [1}'", {"'}' stands where ']' should"});
  refused("check ball.yaml --set 'robot.initial.position=[0, 0, 1]]'", {"']' closes nothing"});
  EXPECT_EQ(campaign.graze("check ball.yaml --set 'description=[\"a]\"' --set name='a[b'").code, 2);
  EXPECT_THAT(campaign.graze("check ball.yaml --set 'name=\"[a\"'").out, StartsWith("[a"));
  EXPECT_THAT(campaign.graze("check ball.yaml --set 'name=a [b'").out, StartsWith("a [b"));
}

// Claim: help is given whatever else is on the line, and 'graze help' gives it, too.
TEST_F(OptionGrammar, HelpIsGivenInAnyForm) {
  const std::string all = campaign.graze("--help").out, run = campaign.graze("run --help").out;
  EXPECT_THAT(all, HasSubstr("graze help VERB"));
  EXPECT_EQ(campaign.graze("help").out, all);
  EXPECT_EQ(campaign.graze("help run").out, run);
  EXPECT_EQ(campaign.graze("run -n x --polcy --help").out, run);
  EXPECT_EQ(campaign.graze("run -h").code, 0);
  refused("help scoer", {"'scoer' is not a verb", "'score'"});
}

/// In one line, with single blanks.
std::string flat(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool blank = c == ' ' || c == '\n';
    if (!blank || (!out.empty() && out.back() != ' ')) out += blank ? ' ' : c;
  }
  return out;
}

// Claim: what verbs have in common, the archive and --policy, their help says in the same words.
TEST_F(OptionGrammar, SharedOptionsHaveOneHelpText) {
  const auto help = [&](const std::string& verb) { return flat(campaign.graze(verb + " --help").out); };
  for (const char* verb : {"status", "verify", "replay", "events", "unknown", "explain", "report", "view", "compare"}) {
    EXPECT_THAT(help(verb), HasSubstr("TEXT REQUIRED Campaign directory or packed file ")) << verb;
  }
  for (const char* verb : {"run", "score", "compare", "events", "unknown", "explain", "report", "view"}) {
    EXPECT_THAT(help(verb), HasSubstr("--policy TEXT ... Only these policies (globs; may be repeated; default: all) "))
        << verb;
  }
}

}  // namespace
}  // namespace graze
