// Claim: Settings reads what people write, and every mistake is answered with its place, the value, the rule and the
// nearest right answer.
#include "engine/settings/settings.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>

#include "engine/settings/inputs.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using testing::message_of;

Settings parse(const std::string& text) { return Settings::parse(text, "a.yaml"); }

std::string parse_message(const std::string& text) {
  return message_of([&] { parse(text); });
}

TEST(Numbers, TakeUnitsOfTheirQuantity) {
  const Settings s =
      parse("a: 2.5 mm\nb: 3 deg\nc: 75 %\nd: 1e-3\ne: +4\nf: 60 rpm\ng: \"1.1 g/cm^3\"\nh: 2 Nm\ni: .5\n");
  EXPECT_EQ(s.at("a").number(Quantity::length), 0.0025) << "the nearest double, not one beside it";
  EXPECT_DOUBLE_EQ(s.at("b").number(Quantity::angle), 3 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(s.at("c").number(), 0.75);
  EXPECT_DOUBLE_EQ(s.at("d").number(Quantity::time), 0.001);
  EXPECT_DOUBLE_EQ(s.at("e").number(), 4);
  EXPECT_DOUBLE_EQ(s.at("f").number(Quantity::angular_velocity), 2 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(s.at("g").number(Quantity::density), 1100);
  EXPECT_DOUBLE_EQ(s.at("h").number(Quantity::torque), 2);
  EXPECT_DOUBLE_EQ(s.at("i").number(), 0.5);
}

TEST(Numbers, RefuseWhatIsNotOne) {
  const Settings s = parse("a: 2.5 mm\nb: word\nc: .inf\nd: nan\ne: 1e999\nf: [1]\ng: -1\nh: 1.5\n");
  EXPECT_EQ(message_of([&] { s.at("a").number(Quantity::angle); }),
            "a.yaml:1:4: a: 2.5 mm: the unit 'mm' does not fit; one of: rad, deg");
  EXPECT_EQ(message_of([&] { s.at("b").number(); }),
            "a.yaml:2:4: b: word: must be a number, with or without a unit (%)");
  EXPECT_EQ(message_of([&] { s.at("c").number(); }),
            "a.yaml:3:4: c: .inf: must be a number, with or without a unit (%)");
  EXPECT_EQ(message_of([&] { s.at("d").number(); }),
            "a.yaml:4:4: d: nan: must be a number, with or without a unit (%)");
  EXPECT_EQ(message_of([&] { s.at("e").number(); }),
            "a.yaml:5:4: e: 1e999: must be a number, with or without a unit (%)");
  EXPECT_EQ(message_of([&] { s.at("f").number(); }),
            "a.yaml:6:4: f: [1]: must be a number, with or without a unit (%)");
  EXPECT_EQ(message_of([&] { s.at("g").positive(); }), "a.yaml:7:4: g: -1: must be > 0");
  EXPECT_EQ(message_of([&] { s.at("g").non_negative(); }), "a.yaml:7:4: g: -1: must be >= 0");
  EXPECT_EQ(message_of([&] { s.at("g").within(0, 2, Quantity::length); }),
            "a.yaml:7:4: g: -1: must lie within [0, 2] m");
  EXPECT_EQ(message_of([&] { s.at("h").integer(); }), "a.yaml:8:4: h: 1.5: must be a whole number");
}

TEST(Numbers, WholeOnesAreInDigits) {
  const auto whole = [](const std::string& text) {
    return message_of([&] { parse("a: " + text + "\n").at("a").integer(); });
  };
  for (const char* digits : {"0", "-7", "+7", "1000000000000001", "9007199254740992"}) {
    EXPECT_EQ(whole(digits), "(accepted)") << digits;
  }
  const std::string place = "a.yaml:1:4: a: ", rule = ": must be a whole number";
  EXPECT_EQ(whole("1e3"), place + "1e3" + rule + ", in digits; nearest right answer: 1000");
  EXPECT_EQ(whole("2e15"), place + "2e15" + rule + ", in digits; nearest right answer: 2000000000000000");
  EXPECT_EQ(whole("9.007199254740992e15"),
            place + "9.007199254740992e15" + rule + ", in digits; nearest right answer: 9007199254740992");
  EXPECT_EQ(whole("1.5"), place + "1.5" + rule);
  for (const char* large : {"1e16", "9007199254740994"}) {
    EXPECT_EQ(whole(large), place + large + rule + " of at most 9007199254740992");
  }
}

TEST(Numbers, ListsTakeOneUnitForAllOrOneEach) {
  const Settings s = parse(
      "a: \"[25, 75, 0, 50] %\"\nb: [25, 75, \"%\"]\nc: [1 m, 1 cm, 4 mm]\nd: [1, 2]\ne: 5 cm\nf: [1 cm, 2, mm]\n");
  EXPECT_EQ(s.at("a").numbers(4), (std::vector<double>{0.25, 0.75, 0, 0.5}));
  EXPECT_EQ(s.at("b").numbers(2), (std::vector<double>{0.25, 0.75}));
  EXPECT_EQ(s.at("c").numbers(3, Quantity::length), (std::vector<double>{1, 0.01, 0.004}));
  EXPECT_EQ(s.at("e").numbers(-1, Quantity::length), (std::vector<double>{0.05}));
  EXPECT_EQ(message_of([&] { s.at("d").numbers(3); }),
            "a.yaml:4:4: d: [1, 2]: must be a list of 3 numbers; this has 2");
  EXPECT_EQ(message_of([&] { s.at("f").numbers(2, Quantity::length); }),
            "a.yaml:6:5: f[0]: 1 cm: the unit 'cm mm' does not fit; one of: m, cm, mm, in");
}

TEST(Maps, RefuseUnknownAndMissingKeys) {
  const Settings s = parse("time:\n  end: 3\n  stpe: 1 ms\n");
  EXPECT_EQ(message_of([&] {
              s.at("time").allow({"end", "step", "control"});
            }),
            "a.yaml:3:3: time.stpe: unknown key; did you mean 'step'?");
  EXPECT_EQ(message_of([&] {
              s.at("time").allow({"end", "control"});
            }),
            "a.yaml:3:3: time.stpe: unknown key; one of: end, control");
  EXPECT_EQ(message_of([&] { s.at("time").at("begin"); }), "a.yaml:2:3: time: the key 'begin' is missing");
  EXPECT_EQ(message_of([&] { s.at("time").single({"normal"}); }),
            "a.yaml:2:3: time: {end: 3, stpe: 1 ms}: must be a map with exactly one key; one of: normal");
  EXPECT_EQ(message_of([&] { parse("a: 1").at("a").find("b"); }), "a.yaml:1:4: a: 1: must be a map (key: value)");
}

TEST(Maps, RefuseDuplicateKeys) {
  EXPECT_EQ(parse_message("a: 1\nb: 2\na: 3\n"),
            "a.yaml:3:1: the key 'a' stands here for the second time; the first is at a.yaml:1:1");
}

TEST(Words, ChoiceNamesTheNearest) {
  const Settings s = parse("a: sobl\n");
  EXPECT_EQ(message_of([&] {
              s.at("a").choice({"random", "sobol"});
            }),
            "a.yaml:1:4: a: sobl: must be one of: random, sobol; did you mean 'sobol'?");
  EXPECT_EQ(nearest("tiem", {"name", "time"}), "time");
  EXPECT_EQ(nearest("LF_SHN", {"LF_SHIN", "RF_SHIN"}), "LF_SHIN");
  EXPECT_EQ(nearest("banana", {"time", "name"}), "");
}

TEST(Words, GlobsMatchWholeNames) {
  EXPECT_TRUE(matches("robot.link.*_SHIN.length", "robot.link.LF_SHIN.length"));
  EXPECT_TRUE(matches("{LF,RF}_FOOT", "RF_FOOT"));
  EXPECT_TRUE(matches("L?_*", "LH_LEG_1"));
  EXPECT_FALSE(matches("*_SHIN", "LF_SHIN.length"));
  EXPECT_FALSE(matches("{LF,RF}_FOOT", "LH_FOOT"));
  EXPECT_FALSE(matches("", "a"));
  EXPECT_TRUE(matches("*", ""));
}

TEST(Words, HostileGlobsEndSoon) {
  // Backtracking over these would take longer than the age of the universe.
  std::string stars, braces;
  for (int i = 0; i < 40; ++i) {
    stars += "*a";
    braces += "{a,a}";
  }
  EXPECT_FALSE(matches(stars + "b", std::string(200, 'a')));
  EXPECT_THROW(matches(braces + "b", std::string(40, 'a')), InputError);
}

TEST(Overrides, FollowTheLongestKey) {
  const Settings base = parse("time: {end: 3}\nuncertain: {robot.link.*_S.length: 1}\nlist: [1, 2]\n");
  const Settings s = base.overridden({{"time.end", "2 s"},
                                      {"time.step", "1 ms"},
                                      {"uncertain.robot.link.*_S.length", "{normal: {std: 1 mm}}"},
                                      {"uncertain.robot.joint.*.zero", "0"},
                                      {"list.1", "7"},
                                      {"name", "x"}});
  EXPECT_FALSE(base.overridden({{"time.end", "~"}}).at("time").has("end")) << "nothing takes a key out";
  EXPECT_DOUBLE_EQ(s.at("time").at("end").number(Quantity::time), 2);
  EXPECT_DOUBLE_EQ(s.at("time").at("step").number(Quantity::time), 0.001);
  EXPECT_TRUE(s.at("uncertain").at("robot.link.*_S.length").has("normal"));
  EXPECT_TRUE(s.at("uncertain").has("robot.joint.*.zero"));
  EXPECT_EQ(s.at("list").numbers(2), (std::vector<double>{1, 7}));
  EXPECT_EQ(s.at("name").text(), "x");
  EXPECT_DOUBLE_EQ(base.at("time").at("end").number(), 3) << "the tree itself never changes";
}

// Claim: --set makes the maps that are missing on its way; keys of `uncertain` and `over` keep their dots.
TEST(Overrides, MakeMissingParents) {
  const Settings s = parse("time: {end: 3}\nnothing:\n");
  const Settings made = s.overridden({{"record.telemetry", "all"},
                                      {"robot.initial.joints.hip", "0.5"},
                                      {"robot.initial.height", "on_ground"},
                                      {"nothing.at", "1"},
                                      {"uncertain.control.lag", "1 ms"},
                                      {"policies.p.over.gait.step_height", "[1 cm]"}});
  EXPECT_EQ(made.at("record").at("telemetry").text(), "all");
  EXPECT_EQ(made.at("record").at("telemetry").place(), "--set record.telemetry=all");
  EXPECT_EQ(made.at("record").key_place(), "--set record.telemetry=all");
  EXPECT_DOUBLE_EQ(made.at("robot").at("initial").at("joints").at("hip").number(), 0.5);
  EXPECT_EQ(made.at("robot").at("initial").at("height").text(), "on_ground");
  EXPECT_EQ(made.at("nothing").at("at").integer(), 1);
  EXPECT_TRUE(made.at("uncertain").has("control.lag"));
  EXPECT_TRUE(made.at("policies").at("p").at("over").has("gait.step_height"));
  EXPECT_FALSE(s.has("record")) << "the tree itself never changes";
}

// Claim: taking away what is not there is no mistake, and makes nothing.
TEST(Overrides, NothingTakesNothingAway) {
  const Settings s = parse("time: {end: 3}\n");
  EXPECT_EQ(s.overridden({{"contact.model", "~"}, {"time.step", "~"}, {"name", "null"}}).resolved_text(),
            s.resolved_text());
}

// Claim: a path makes no deeper tree than a file may, and one of very many parts is counted, not followed.
TEST(Overrides, PathsAreBounded) {
  const auto message = [](std::size_t parts) {
    std::string path = "b";
    for (std::size_t i = 1; i < parts; ++i) path += ".c";
    const std::string whole = message_of([&] { parse("a: 1").overridden({{path, "1"}}); });
    const std::size_t at = whole.find("=1: ");
    return at == std::string::npos ? whole : whole.substr(at);
  };
  EXPECT_EQ(message(63), "(accepted)");
  EXPECT_EQ(message(64), "=1: with it, values are nested deeper than 64");
  EXPECT_EQ(message(20'000), "=1: a path of 20000 parts; at most 1000");
}

// Claim: a message shows as much of a long override as fits a line.
TEST(Overrides, AreCutInMessages) {
  const std::string rows = "[" + std::string(100'000, '1') + ", x]";
  const std::string message = message_of([&] {
    parse("a: 1").overridden({{"heights", rows}}).at("heights").numbers(2);
  });
  EXPECT_EQ(message.find("--set heights=[111"), 0u);
  EXPECT_NE(message.find("must be a number"), std::string::npos) << message.substr(0, 400);
  EXPECT_LT(message.size(), 400u);
}

// Claim: what a glob, a percentage or a list with a unit needs, quotes, is said where YAML does not take them without.
TEST(Yaml, HintsAtQuotes) {
  const std::string glob = "in quotes it is a glob: ";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"link: *_FOOT", glob + "\"*_FOOT\""},
      {"link: *", glob + "\"*\""},
      {"a: {no_contact: [*_FOOT, curb.side]}", glob + "\"*_FOOT\""},
      {"joints: {*_X_1: 0.2}", glob + "\"*_X_1\""},
      {"joints:\n  *_X_1: 0.2\n  b: 1", glob + "\"*_X_1\""},
      {"joints:\n  *: 0.2", glob + "\"*\""},
      {"duty: %55", "% cannot begin a value"},
      {"liftoff: [25, 75, 0, 50] %", "needs quotes: \"[25, 75, 0, 50] %\""},
      {"x: {liftoff: [25, 75] %, b: 1}", "needs quotes: \"[25, 75] %\""},
      {"joints:\n  {LF,RH}_X_1: 0.2", glob + "\"{LF,RH}_X_1\""},
      {"joints: {{LF,RH}_X_1: 0.2}", glob + "\"{LF,RH}_X_1\""},
      {"link: {LF,RH}_FOOT", glob + "\"{LF,RH}_FOOT\""},
      {"link: [curb.{top,edge}, b]", glob + "\"curb.{top,edge}\""},
      {"link: {LF,RH}", glob + "\"{LF,RH}\""}};
  for (const auto& [text, hint] : cases) {
    const std::string message = message_of([&text = text] {
      const Settings s = parse(text);
      for (const auto& [key, value] : s.entries()) value.text();
    });
    EXPECT_NE(message.find(hint), std::string::npos) << text << ": " << message;
  }
  EXPECT_EQ(message_of([] { parse("a: [1, 2"); }).find("quotes"), std::string::npos) << "no hint where none is known";
}

std::vector<std::string> warnings_of(const std::string& text, Quantity quantity) {
  const Warnings warnings;
  for (const Settings& value : parse("x: [" + text + "]").at("x").items()) value.number(quantity);
  return warnings.texts();
}

// Claim: the likely cause of a layout that YAML does not take is said: tabs, colons, indentation.
// yaml-cpp takes a byte 0 for the beginning of an escape.
TEST(Yaml, RefusesABinaryFile) {
  const auto message = [](const std::string& text) { return message_of([&] { Settings::parse(text, "a.yaml"); }); };
  using namespace std::string_literals;
  EXPECT_EQ(message("a: 1\nname: a\0b\n"s), "a.yaml:2:8: not YAML: a byte 0, which no text has");
  EXPECT_EQ(message("\0"s), "a.yaml:1:1: not YAML: a byte 0, which no text has");
  EXPECT_EQ(
      message("\x89HDF\r\n\x1a\n\0\0"s),
      "a.yaml:1:1: not YAML: it is an HDF5 file, as archives are; a scenario belongs here (graze score a.yaml reads "
      "an archive)");
}

TEST(Yaml, HintsAtLayout) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"a: 1\nb:\n\tc: 2", "; a tab stands in front of line 3: YAML indents by spaces"},
      {"a: 1\nb: Stand: first try\n", "; a text with a colon and a space in it needs quotes: \"Stand: first try\""},
      {"a: 1\nb:\n  c: 2\n d: 3\n", "; its indentation of 1 space is that of no line above"},
      {"a: 1\nb:\n  c: x\n    d: y\n", "; it is indented below line 3, which has a value already"},
      {"a:\n  b:x\n  c: y\n", "; a space is missing behind the colon in line 2"},
      {"a: {b: x,\nc: {d: 1}\n", "; a ',' or the closing '}' is missing before this place"},
  };
  for (const auto& [text, hint] : cases) {
    EXPECT_NE(message_of([&, &yaml = text] { parse(yaml); }).find(hint), std::string::npos)
        << text << message_of([&, &yaml = text] { parse(yaml); });
  }
}

// Claim: numbers that only a forgotten unit explains are warned of, with what was probably meant; a unit that is
// written is believed, and without a listener nothing is kept.
TEST(Units, DoubtWhatIsHardlyMeant) {
  EXPECT_EQ(warnings_of("-90", Quantity::angle),
            std::vector<std::string>{"a.yaml:1:5: x[0]: -90: is 14.3 turns; did you mean -90 deg?"});
  const std::vector<std::pair<std::string, Quantity>> doubted = {
      {"6.3", Quantity::angle},    {"-90 rad", Quantity::angle},     {"180", Quantity::angular_velocity},
      {"120", Quantity::length},   {"2000", Quantity::time},         {"1500", Quantity::mass},
      {"300", Quantity::velocity}, {"9810", Quantity::acceleration}, {"27000000", Quantity::density}};
  for (const auto& [text, quantity] : doubted) EXPECT_EQ(warnings_of(text, quantity).size(), 1u) << text;
  const std::vector<std::pair<std::string, Quantity>> believed = {
      {"-90 deg", Quantity::angle},     {"6.283185307179586", Quantity::angle},
      {"720 deg", Quantity::angle},     {"100", Quantity::length},
      {"4000 mm", Quantity::length},    {"1000", Quantity::time},
      {"9.81", Quantity::acceleration}, {"7800", Quantity::density},
      {"5e5", Quantity::dimensionless}};
  for (const auto& [text, quantity] : believed) {
    EXPECT_TRUE(warnings_of(text, quantity).empty()) << text;
  }
  EXPECT_DOUBLE_EQ(parse("x: 300 mm/s").at("x").number(Quantity::velocity), 0.3);
  EXPECT_EQ(parse("x: -90").at("x").number(Quantity::angle), -90) << "and there is nobody to warn";
}

TEST(Overrides, KnowWhatTheyLeadInto) {
  const Settings s = parse("time: {end: 3}\nlist: [1, 2]\n");
  const auto told = [&](const std::string& path) { return message_of([&] { s.overridden({{path, "2"}}); }); };
  EXPECT_EQ(told("time.end.x"), "--set time.end.x=2: 'x' leads into a value that is not a map");
  EXPECT_EQ(told("list.5"), "--set list.5=2: '5': is not one of the list's indices 0 to 1");
  EXPECT_EQ(told("list.y"), "--set list.y=2: 'y': is not one of the list's indices 0 to 1; nearest right answer: 1");
  EXPECT_EQ(told("list.z"), "--set list.z=2: 'z': is not one of the list's indices 0 to 1");
  EXPECT_EQ(message_of([&] {
              s.overridden({{"time.end", "soon"}}).at("time").at("end").number(Quantity::time);
            }),
            "--set time.end=soon: time.end: soon: must be a number, with or without a unit (s, ms, us)");
}

TEST(Overrides, NameFilesFromTheWorkingDirectory) {
  const Settings s = Settings::parse("robot: {urdf: a.urdf}", "data/x.yaml");
  EXPECT_EQ(s.at("robot").at("urdf").resolve_file("a.urdf"), "data/a.urdf");
  const Settings o = s.overridden({{"robot.urdf", "b.urdf"}});
  EXPECT_EQ(o.at("robot").at("urdf").resolve_file("b.urdf"), "b.urdf");
}

TEST(Text, ParsesBackToTheSameTree) {
  const Settings s = parse(
      "a: {b: [1, 2.5 mm, \"null\", ~], c: {d: {e: {f: {g: {}}}}}}\n\"*_X\": \"a: b # c\"\nt: |\n  two\n  lines\n"
      "n:\nq: \"\\\"\\\\ \\t\"\nu: \"[1, 2] %\"\n'null': '-'\nneg: -1\nm: '- 1'\n");
  const std::string text = s.resolved_text();
  EXPECT_EQ(parse(text).resolved_text(), text);
  EXPECT_EQ(parse(text).at("q").text(), "\"\\ \t");
  EXPECT_EQ(parse(text).at("t").text(), "two\nlines\n");
  EXPECT_EQ(parse(text).at("m").text(), "- 1");
  EXPECT_TRUE(parse(text).at("n").is_null());
  EXPECT_EQ(parse(text).at("a").at("b").items()[2].text(), "null");
}

class Includes : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("settings_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "parts");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  std::filesystem::path folder_;
};

TEST_F(Includes, MergeUnderTheIncludingMap) {
  write("parts/base.yaml",
        "time: {end: 3, step: 1 ms}\nrobot: {urdf: r.urdf}\nlist: [1, 2]\nd: {normal: {std: 1}}\ngone: 1\n");
  const Settings s = Settings::load(write(
      "main.yaml", "include: parts/base.yaml\ntime: {end: 2}\nlist: [5]\nd: !replace {uniform: [1, 2]}\ngone: ~\n"));
  EXPECT_DOUBLE_EQ(s.at("time").at("end").number(), 2);
  EXPECT_DOUBLE_EQ(s.at("time").at("step").number(Quantity::time), 0.001);
  EXPECT_EQ(s.at("list").items().size(), 1u);
  EXPECT_EQ(s.at("d").single({"uniform"}).first, "uniform");
  // A file name in an included file is relative to that file, and so is every place.
  EXPECT_EQ(s.at("robot").at("urdf").resolve_file("r.urdf"), (folder_ / "parts/r.urdf").string());
  EXPECT_EQ(s.at("time").at("step").place(), (folder_ / "parts/base.yaml").string() + ":1:22");
  EXPECT_FALSE(s.has("gone"));
  EXPECT_FALSE(s.has("include"));
}

TEST_F(Includes, RefuseCyclesAndMissingFiles) {
  const std::string main = write("main.yaml", "include: main.yaml\n");
  EXPECT_EQ(message_of([&] { Settings::load(main); }),
            main + ":1:10: include: " + main + ": includes itself");  // found on the second round
  const std::string gone = write("gone.yaml", "a: {include: nothing.yaml}\n");
  EXPECT_EQ(message_of([&] { Settings::load(gone); }),
            gone + ":1:14: include: " + (folder_ / "nothing.yaml").string() + ": there is no such file");
  EXPECT_EQ(message_of([&] { Settings::load((folder_ / "no.yaml").string()); }),
            (folder_ / "no.yaml").string() + ": there is no such file");
  EXPECT_EQ(message_of([&] { Settings::load(folder_.string()); }), folder_.string() + ": not a file, but a folder");
}

// Claim: an include that is no regular file is answered with its name, and never waited for.
TEST_F(Includes, ReadRegularFilesOnly) {
  const auto message = [&](const std::string& file) {
    const std::string main = write("main.yaml", "include: " + file + "\n");
    const std::string text = message_of([&] { Settings::load(main); });
    const std::string start = main + ":1:10: include: ";
    EXPECT_EQ(text.substr(0, start.size()), start);
    return text.substr(std::min(text.size(), start.size()));
  };
  EXPECT_EQ(message("/proc/self/mem"), "/proc/self/mem: cannot be read: Input/output error");
  EXPECT_EQ(message("/dev/zero"), "/dev/zero: not a file: only regular files are read, no devices, pipes or sockets");
  const std::string a = (folder_ / "a.yaml").string(), fifo = (folder_ / "fifo").string();
  std::filesystem::create_symlink("b.yaml", a);
  std::filesystem::create_symlink("a.yaml", folder_ / "b.yaml");
  EXPECT_EQ(message("a.yaml"), a + ": symbolic links that lead in a circle; name the file itself");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(message("fifo"), fifo + ": not a file: only regular files are read, no devices, pipes or sockets");
}

// Claim: what many files include is bounded together, so that files of a legal size cannot add up.
TEST_F(Includes, BoundTheirSum) {
  std::string thousand = "a: &a [", times = "b: [";
  for (int i = 0; i < 1'000; ++i) thousand += "1,";
  for (int i = 0; i < 300; ++i) times += "*a,";
  write("big.yaml", thousand + "]\n" + times + "]\n");
  std::string list = "include: [big.yaml";
  for (int i = 0; i < 3; ++i) list += ", big.yaml";
  const std::string main = write("main.yaml", list + "]\n");
  EXPECT_EQ(message_of([&] { Settings::load(main); }),
            main + ":1:41: include: " + (folder_ / "big.yaml").string() +
                ": with it, the included files hold more than 1048576 values");
}

TEST(Hostile, BytesGiveInputErrorsOnly) {
  std::string deep(2000, '['), bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    bomb += fmt::format("a{}: &a{} [{}", i, i, fmt::format("*a{}", i - 1));
    for (int k = 1; k < 10; ++k) bomb += fmt::format(", *a{}", i - 1);
    bomb += "]\n";
  }
  for (const std::string& text :
       {deep, bomb, std::string("a: [b"), std::string("\0\xff\xfe", 3), std::string("&a [*a]"), std::string("*b"),
        std::string("? [a]\n: b"), std::string("a: 1\n---\nb: 2"), std::string("%YAML 9"), std::string("[1]: 2"),
        std::string("~: 2")}) {
    EXPECT_NE(parse_message(text), "(accepted)") << text.substr(0, 40);
  }
  EXPECT_EQ(parse_message(""), "(accepted)");
  EXPECT_TRUE(parse("").is_null());
}

// Claim: keys of a large map are told apart in time that grows with their number, not with its square (which takes
// more than 10 s of these).
TEST(Hostile, ManyKeysAreQuick) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += fmt::format("key{}: 1\n", i);
  const std::clock_t begin = std::clock();
  EXPECT_EQ(parse(text).entries().size(), 100'000u);
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 5);
  EXPECT_EQ(parse_message(text + "key7: 2\n"),
            "a.yaml:100001:1: the key 'key7' stands here for the second time; the first is at a.yaml:8:1");
}

// Claim: keys and globs that no one would write are refused, with their size and the bound.
TEST(Hostile, NamesOfAMegabyte) {
  const std::string mega(1 << 20, 'a');
  EXPECT_EQ(parse_message("? " + mega + "\n: 1\n"),
            "a.yaml:1:3: a key of 1048576 bytes; at most 1000: keys are names, paths and globs");
  const std::string text = message_of([&] { parse("g: " + mega).at("g").glob(); });
  EXPECT_EQ(text,
            "a.yaml:1:4: g: " + std::string(80, 'a') + "…: a glob of 1048576 bytes; at most 1000: use several, or *");
  const std::string braces = "{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}{a,b}";
  const std::string rule = braces + ": a glob whose braces stand for more than 1000 patterns; use several, or *";
  EXPECT_EQ(message_of([&] { parse("g: \"" + braces + "\"").at("g").glob(); }), "a.yaml:1:4: g: " + rule);
  EXPECT_EQ(message_of([&] { matches(braces, "c"); }), rule) << "once it matched nothing, silently";
  EXPECT_TRUE(matches(braces.substr(5), "bbbbbbbbb")) << "512 patterns";
}

TEST(Copies, WithAndWithout) {
  const Settings s = parse("gait: {step: 1 cm, length: 2}\nover: [7 cm]\n");
  const Settings changed = s.with("gait.step", s.at("over").items()[0]).without("over");
  EXPECT_DOUBLE_EQ(changed.at("gait").at("step").number(Quantity::length), 0.07);
  EXPECT_EQ(changed.at("gait").at("step").place(), "a.yaml:2:8");
  EXPECT_FALSE(changed.has("over"));
  EXPECT_EQ(message_of([&] { s.with("gait.step.x", s.at("over")); }),
            "a.yaml:2:7: over: 'x' leads into a value that is not a map");
  EXPECT_TRUE(s.with("giat.step", s.at("over")).at("giat").has("step")) << "the reader of the map refuses its new key";
}

// Claim: decimals come down to six digits, and everything else of the text stays.
TEST(RoundedNumbers, AreShort) {
  EXPECT_EQ(rounded_numbers("normal(mean=2700.0000035993075, std=270.00000035993077)"), "normal(mean=2700, std=270)");
  EXPECT_EQ(rounded_numbers("normal(mean=0, std=0.17453292519943295)"), "normal(mean=0, std=0.174533)");
  EXPECT_EQ(rounded_numbers("uniform(min=-0.05, max=1.23456789e-12)"), "uniform(min=-0.05, max=1.23457e-12)");
  EXPECT_EQ(rounded_numbers("empirical(n=1234567, min=-inf, max=inf)"), "empirical(n=1234567, min=-inf, max=inf)");
  EXPECT_EQ(rounded_numbers("constant(4.9406564584124654e-324)"), "constant(4.94066e-324)");
  EXPECT_EQ(rounded_numbers(""), "");
}

// A NUL ends what the system is given: no file is named by the text before it, and no message ends there.
TEST(Texts, WithNulNameNoFileAndAreShownWhole) {
  const Settings s = parse("a: \"0.2\\0 s\"\nb: \"x.urdf\\0.backup\"\n\"c\\0d\": 1\n");
  EXPECT_EQ(message_of([&] { s.at("a").number(Quantity::time); }),
            "a.yaml:1:4: a: 0.2\\0 s: the unit '\\0 s' does not fit; one of: s, ms, us");
  EXPECT_EQ(message_of([&] { s.at("b").resolve_file(s.at("b").text()); }),
            "a.yaml:2:4: b: x.urdf\\0.backup: the name of a file has no NUL character (\\0)");
  EXPECT_EQ(message_of([&] { s.at(std::string("c\0d", 3)).text_or("x", ""); }).find('\0'), std::string::npos);
  const std::string nothing("/dev/null\0.yaml", 15);
  EXPECT_EQ(message_of([&] { read_input(nothing); }),
            "/dev/null\\0.yaml: the name of a file has no NUL character (\\0)");
  EXPECT_FALSE(input_exists(std::string(__FILE__) + std::string("\0.x", 3)));
  EXPECT_EQ(
      parse_message("include: \"" + std::string(__FILE__) + "\\0.yaml\"\n"),
      "a.yaml:1:10: include: " + std::string(__FILE__) + "\\0.yaml: the name of a file has no NUL character (\\0)");
}

}  // namespace
}  // namespace graze
