// Claim: names that may be anybody's come through unharmed: in YAML, in comments, in globs and in messages that list
// what there is.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <random>

#include "scenarios/names.h"
#include "scenarios/overlaps.h"
#include "scenarios/proposal_words.h"
#include "tests/reference_kinematics.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

Settings a_place() { return Settings::parse("of: here", "names.yaml").at("of"); }

/// What is said when a pattern is none of the names.
std::string unmatched(const std::string& pattern, const std::vector<std::string>& names) {
  return testing::message_of([&] { match_names(a_place(), pattern, names, "thing"); });
}

// Claim: a glob matches what a matcher finds that tries every way, on random names and patterns; indices come in order.
bool matches_slowly(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  if (pattern[0] == '{') {
    const std::size_t end = pattern.find('}');
    for (std::size_t from = 1; from <= end;) {
      const std::size_t to = std::min(pattern.find(',', from), end);
      const std::string rest = std::string(pattern.substr(from, to - from)) + std::string(pattern.substr(end + 1));
      if (matches_slowly(rest, name)) return true;
      from = to + 1;
    }
    return false;
  }
  if (pattern[0] == '*') {
    for (std::size_t skip = 0; skip <= name.size(); ++skip) {
      if (matches_slowly(pattern.substr(1), name.substr(skip))) return true;
    }
    return false;
  }
  return !name.empty() && (pattern[0] == '?' || pattern[0] == name[0]) &&
         matches_slowly(pattern.substr(1), name.substr(1));
}

/// Whether a name that is written in the braces of a pattern stands for nothing.
bool has_idle(const std::string& pattern, const std::vector<std::string>& names) {
  const std::size_t open = pattern.find('{'), close = pattern.find('}');
  if (open == std::string::npos) return false;
  const std::size_t comma = pattern.find(',', open);
  for (const auto& [from, to] : {std::pair(open + 1, comma), std::pair(comma + 1, close)}) {
    const std::string one = pattern.substr(0, open) + pattern.substr(from, to - from) + pattern.substr(close + 1);
    const auto is_one = [&](const std::string& name) { return matches_slowly(one, name); };
    if (to > from && std::none_of(names.begin(), names.end(), is_one)) return true;
  }
  return false;
}

TEST(Names, AreMatchedAsAnExhaustiveMatcherDoes) {
  std::mt19937 random(4);
  const auto letters = [&](const std::string& from, std::size_t most) {
    std::string out;
    for (std::size_t n = random() % (most + 1); n > 0; --n) out += from[random() % from.size()];
    return out;
  };
  int matched = 0, idle = 0;
  for (int i = 0; i < 400; ++i) {
    std::vector<std::string> names;
    for (int n = 0; n < 8; ++n) names.push_back("a" + letters("ab.", 4));
    const std::string pattern = letters("ab*?.", 3) +
                                (random() % 2 ? "{" + letters("ab*", 2) + "," + letters("b.?", 2) + "}" : "") +
                                letters("ab*", 2);
    std::vector<int> right;
    for (int n = 0; n < 8; ++n) {
      EXPECT_EQ(match_names(a_place(), names[n], {names[n]}, "thing"), std::vector<int>{0}) << "itself";
      if (matches_slowly(pattern, names[n])) right.push_back(n);
    }
    if (right.empty()) {
      EXPECT_THAT(unmatched(pattern, names), HasSubstr(pattern + ": matches no thing")) << pattern;
    } else if (has_idle(pattern, names)) {
      EXPECT_THAT(unmatched(pattern, names), HasSubstr("of it matches no thing")) << pattern;
      ++idle;
    } else {
      EXPECT_EQ(match_names(a_place(), pattern, names, "thing"), right) << pattern;
      ++matched;
    }
  }
  EXPECT_GT(matched, 100);
  EXPECT_GT(idle, 20);
}

TEST(Names, ThatAreNoneAreToldWithTheNearest) {
  EXPECT_EQ(unmatched("knie", {"hip", "knee"}), "names.yaml:1:5: of: knie: matches no thing; did you mean 'knee'?");
  EXPECT_EQ(unmatched("wing", {"hip", "knee"}), "names.yaml:1:5: of: wing: matches no thing; there are: hip, knee");
  EXPECT_EQ(unmatched("wing", {}), "names.yaml:1:5: of: wing: matches no thing; there are none");
  std::vector<std::string> many;
  for (int i = 0; i < 20; ++i) many.push_back(fmt::format("joint_number_{}", i));
  EXPECT_THAT(unmatched("w", many), EndsWith(", joint_number_19"));
  many.emplace_back("joint_number_20");
  EXPECT_THAT(unmatched("w", many), EndsWith(", joint_number_19, …"));
  EXPECT_THAT(unmatched("w", many), Not(HasSubstr("joint_number_20")));
}

TEST(Names, OfAModelAreThoseOfItsLinksJointsAndParts) {
  const Model model = testing::read(testing::hopper("")).model;
  EXPECT_THAT(frame_names(model), ElementsAre("base", "thigh", "foot", "disc"));
  EXPECT_THAT(driven_names(model), ElementsAre("hip", "slide", "wheel"));
  EXPECT_THAT(part_names(model), ElementsAre("base", "thigh", "foot", "ground", "block")) << "each once";
}

/// A text of any bytes but NUL, many of which mean something to YAML.
std::string strange_text(std::mt19937& random) {
  static const std::string kCommon = "'\"\\#:{}[],&*!|>%@`-? \n\t\r\x01\x7f";
  std::string out;
  for (std::size_t n = 1 + random() % 12; n > 0; --n) {
    out += random() % 3 ? kCommon[random() % kCommon.size()] : static_cast<char>('a' + random() % 26);
  }
  return out;
}

// Whatever a robot's joint is called, a proposed scenario reads it back as it was.
TEST(ProposalWords, QuotedNamesReadBack) {
  std::mt19937 random(8);
  for (int i = 0; i < 2000; ++i) {
    const std::string text = strange_text(random);
    const Settings read =
        Settings::parse("robot: {joints: {" + quoted(text) + ": 1}, last: " + quoted(text) + "}", "q.yaml");
    EXPECT_EQ(read.at("robot").at("joints").entries().front().first, text) << quoted(text);
    EXPECT_EQ(read.at("robot").at("last").text(), text) << quoted(text);
    const std::string comment = in_comment(text);
    EXPECT_EQ(comment.find_first_of("\n\r\t\x01\x7f"), std::string::npos);
    EXPECT_EQ(comment.size(), text.size());
    EXPECT_FALSE(Settings::parse("# " + comment + "\nkey: 1\n", "q.yaml").has(text));
  }
  EXPECT_EQ(quoted("hip"), "'hip'");
  EXPECT_EQ(quoted("d'hip"), "'d''hip'");
  EXPECT_EQ(quoted("a\n\"b\\"), "\"a\\x0a\\\"b\\\\\"");
  EXPECT_LE(in_comment(std::string(500, 'n')).size(), 83u) << "80 and an ellipsis";
}

TEST(ProposalWords, NumbersHaveTwoDigits) {
  for (const auto& [x, right] : {std::pair{0.0, 0.0},
                                 {1234.0, 1200.0},
                                 {1250.0, 1200.0},
                                 {0.0349, 0.035},
                                 {9.96, 10.0},
                                 {-1.16, -1.2},
                                 {1e-320, 1e-320}}) {
    EXPECT_DOUBLE_EQ(rounded(x), right);
  }
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    const double x = std::ldexp(1 + random() / 4294967296.0, static_cast<int>(random() % 60) - 30);
    EXPECT_NEAR(rounded(x), x, 0.0501 * x) << "half of the second digit at most";
    EXPECT_EQ(rounded(rounded(x)), rounded(x));
  }
  EXPECT_EQ(counted(0, "link"), "0 links");
  EXPECT_EQ(counted(1, "link"), "1 link");
  EXPECT_EQ(counted(12, "driven joint"), "12 driven joints");
}

TEST(ProposalWords, MessagesLoseThePlaceInAFileThatIsNotThere) {
  EXPECT_EQ(without_place("a.yaml", "a.yaml:3:4: time.end: 0: must be > 0\nmore"), "time.end: 0: must be > 0");
  EXPECT_EQ(without_place("a.yaml", "a.yaml: no policy"), "no policy");
  EXPECT_EQ(without_place("a.yaml", "b.yaml:3:4: x"), "b.yaml:3:4: x") << "of another file it stays";
  EXPECT_EQ(without_place("a.yaml", "a.yaml:3"), "a.yaml:3") << "nothing but a place";
}

Clearance::Overlap overlap_of(int a, int b, double depth) {
  Clearance::Overlap out;
  out.a = a, out.b = b, out.depth = depth;
  return out;
}

// Three overlaps are told and the rest counted; lengths below 10 cm are told in mm.
TEST(OverlapWords, TellTheFirstThree) {
  const Model model = testing::read(testing::hopper("")).model;
  std::vector<Clearance::Overlap> some = {overlap_of(0, 1, 0.0123), overlap_of(1, 2, 0.099), overlap_of(0, 3, 0.1234)};
  EXPECT_EQ(overlaps_text(model, some), "base and thigh by 12 mm, thigh and foot by 99 mm, base and ground by 0.123 m");
  EXPECT_EQ(ignore_text(model, some), "[[base, thigh], [thigh, foot], [base, ground]]");
  some.push_back(overlap_of(0, 4, 0.1));
  EXPECT_THAT(overlaps_text(model, some), EndsWith("base and ground by 0.123 m and 1 pair more"));
  some.push_back(overlap_of(2, 4, 0.2));
  EXPECT_THAT(overlaps_text(model, some), EndsWith("base and ground by 0.123 m and 2 pairs more"));
  EXPECT_EQ(overlaps_text(model, {overlap_of(2, 4, 0.1)}), "foot and block by 0.1 m");
  EXPECT_THAT(ignore_text(model, some), EndsWith(", [base, block], [foot, block]]"));
  EXPECT_EQ(overlaps_text(model, {}), "");
  EXPECT_EQ(ignore_text(model, {}), "[]");
}

// The block that a beginning is: bodies stand where an independent kinematics puts them.
TEST(Beginnings, HaveThePosesOfTheirState) {
  std::mt19937 random(6);
  const Scenario s = testing::read(testing::hopper(""));
  for (int i = 0; i < 20; ++i) {
    State state = initial_state(*s.world, s.model);
    for (double& x : state.q) x += 1e-9 * static_cast<double>(random() % 1'000'000'000);
    for (double& x : state.v) x = 1e-9 * static_cast<double>(random() % 1'000'000'000);
    state.q.head<4>().normalize();
    const BlockState block = beginning(s.model, state);
    const std::vector<Pose> X_WB = reference_poses(s.model, state.q);
    for (int body = 0; body < static_cast<int>(X_WB.size()); ++body) {
      EXPECT_TRUE(block.pose(body, kBeginningLane).isApprox(X_WB[static_cast<std::size_t>(body)], 1e-12)) << body;
    }
    EXPECT_EQ(block.q.column(kBeginningLane), state.q);
    EXPECT_EQ(block.v.column(kBeginningLane), state.v);
  }
}

}  // namespace
}  // namespace graze
