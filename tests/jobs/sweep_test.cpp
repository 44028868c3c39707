// Claim: `graze sweep` is as many campaigns as it has values, on the same particles, whatever interrupts it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "jobs/campaign/sweep_axis.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

class SweepVerb : public ::testing::Test, public testing::BallCampaign {
 protected:
  /// How low the ball must have fallen from 15 to 25 cm in 50 ms: so that none, some and all succeed.
  static constexpr const char* kBound = "task.objective.low.height.below='13:25:3 cm'";

  nlohmann::json run(const std::string& arguments) const {
    const testing::Result result = graze("sweep " + arguments + " --json --quiet");
    EXPECT_EQ(result.code, 0) << result.err;
    return nlohmann::json::parse(result.out);
  }
};

// Each value is the campaign that `graze run` makes of it, bit for bit, and a ball that is low enough for one bound is
// low enough for all higher ones.
TEST_F(SweepVerb, RunsEachValueOnTheSameParticles) {
  const nlohmann::json found = run(std::string("ball.yaml -n 40 -o a.sweep --over ") + kBound);
  ASSERT_EQ(found["rates"].size(), 5u);
  EXPECT_EQ(found["rates"][1]["values"]["task.objective.low.height.below"], "16 cm");
  EXPECT_EQ(found["rates"][0]["success"], 0);
  EXPECT_EQ(found["rates"][4]["success"], 40);
  for (const nlohmann::json& change : found["changes"]) EXPECT_EQ(change["broke"], 0);
  ASSERT_EQ(graze("run ball.yaml -n 40 --quiet -o b.graze --set task.objective.low.height.below='19 cm'").code, 0);
  EXPECT_EQ(testing::digests(folder / "a.sweep/002.graze"), testing::digests(folder / "b.graze"));
  const testing::Result score = graze("score a.sweep/002.graze --json");
  EXPECT_EQ(nlohmann::json::parse(score.out)["policies"][0]["success"], found["rates"][2]["success"]);
}

// When requirements were violated: never by balls that stay above 10 cm, at once by those that begin below 40 cm, and
// of the bound between by as many as the campaign's known failures.
TEST_F(SweepVerb, TellsWhenRequirementsWereViolated) {
  const nlohmann::json found =
      run("ball.yaml -n 40 -o c.sweep --over 'task.requirements.high.height.above=10 cm,19 cm,40 cm'")["rates"];
  const auto time = [&](int i) { return found[i]["time_to_violation"]; };
  EXPECT_EQ(time(0)["violated"], 0);
  EXPECT_NEAR(time(0)["mean"], 0.05, 1e-12);
  EXPECT_TRUE(time(0)["interval"][0].is_null());
  EXPECT_EQ(time(1)["violated"], found[1]["known_failure"]);
  EXPECT_GT(time(1)["violated"], 0);
  EXPECT_LT(time(1)["violated"], 40);
  EXPECT_LT(time(1)["interval"][0], time(1)["mean"]);
  EXPECT_EQ(time(2)["violated"], 40);
  EXPECT_EQ(time(2)["mean"], 0);
  EXPECT_THAT(graze("sweep c.sweep --plot-times c.pdf").err, HasSubstr("nearest right answer: c.svg or c.png"));
}

// Whatever the number of threads, and whatever of it was lost on the way, a sweep comes out the same; a whole one
// simulates nothing.
TEST_F(SweepVerb, IsTheSameForAnyThreadsAndAfterARestart) {
  const std::string over = std::string(" --adaptive -n 512 --over ") + kBound;
  const nlohmann::json one = run("ball.yaml --threads 1 -o one.sweep" + over);
  EXPECT_EQ(run("ball.yaml --threads 3 -o two.sweep" + over), one);
  const fs::path shard = fs::directory_iterator(folder / "two.sweep/002.graze/shards")->path();
  fs::remove(shard);
  fs::remove_all(folder / "two.sweep/003.graze/shards");
  EXPECT_EQ(run("two.sweep"), one);
  for (const char* campaign : {"002.graze", "003.graze"}) {
    EXPECT_EQ(testing::digests(folder / "two.sweep" / campaign), testing::digests(folder / "one.sweep" / campaign));
  }
  fs::remove(folder / "ball.yaml");  // the campaigns keep what they were read from
  const testing::Result again = graze("sweep two.sweep");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.err, ::testing::Not(HasSubstr("particles"))) << "nothing is simulated anew";
}

// A sweep that was killed goes on where it was.
TEST_F(SweepVerb, GoesOnAfterAKill) {
  const nlohmann::json whole = run(std::string("ball.yaml -n 2000 -o whole.sweep --over ") + kBound);
  testing::shell(folder.path(), std::string("'") + GRAZE_PROGRAM + "' sweep ball.yaml -n 2000 -o cut.sweep --over " +
                                    kBound +
                                    " --quiet & pid=$!; while [ ! -e cut.sweep/001.graze/shards/000001.h5 ] && kill -0 "
                                    "$pid; do sleep 0.01; done; kill -9 $pid; wait");
  ASSERT_TRUE(fs::exists(folder / "cut.sweep/sweep.json"));
  EXPECT_EQ(run("cut.sweep"), whole);
}

// Flat ends of the curve get the least, its slope more; all readers know why the number is what it is.
TEST_F(SweepVerb, SpendsParticlesOnTheSlope) {
  const nlohmann::json found =
      run("ball.yaml --adaptive -n 1024 -o a.sweep --over task.objective.low.height.below='3:35:4 cm'");
  EXPECT_EQ(found["rates"][0]["n"], 64);
  EXPECT_EQ(found["rates"][8]["n"], 64);
  EXPECT_GE(found["rates"][4]["n"], 512) << "half of the balls are below 19 cm";
  EXPECT_EQ(found["interval"], "95 % confidence sequence");
  const nlohmann::json score = nlohmann::json::parse(graze("score a.sweep/004.graze --json").out);
  EXPECT_EQ(score["policies"][0]["interval"], found["rates"][4]["interval"]);
}

// What matters to nothing is told, from the archives, too.
TEST_F(SweepVerb, TellsWhatHasNoEffect) {
  const std::string told = "name has no effect here";
  EXPECT_THAT(graze("sweep ball.yaml -n 8 --over name=a,b -o names.sweep").out, HasSubstr(told));
  EXPECT_THAT(graze("sweep names.sweep").out, HasSubstr(told));
  EXPECT_EQ(run("names.sweep")["axes"][0]["has_effect"], false);
  EXPECT_EQ(run(std::string("ball.yaml -n 64 -o bound.sweep --over ") + kBound)["axes"][0]["has_effect"], true);
}

TEST_F(SweepVerb, GoesOverTwoValuesAndDraws) {
  const testing::Result result = graze(
      "sweep ball.yaml -n 8 --over contact.friction=0.5,1 --over 'physics=lanes,bullet' -o two.sweep --plot two.svg");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("success against contact.friction and physics"), HasSubstr("0.5 -> 1 at")));
  EXPECT_THAT(testing::read_file(folder / "two.svg"), AllOf(HasSubstr("physics: bullet"), HasSubstr("Success rate")));
  EXPECT_THAT(graze("sweep two.sweep --csv").out, HasSubstr("\n1,bullet,still,8,"));
}

// What particles draw for themselves is not what its nominal value is.
TEST_F(SweepVerb, DoubtsWhatIsUncertain) {
  const std::string set = " -n 2 --quiet --set 'uncertain.contact.friction={uniform: [0.5, 1]}' --over ";
  EXPECT_THAT(graze("sweep ball.yaml -o a.sweep" + set + "contact.friction=0.5,1").err,
              HasSubstr("did you mean --over uncertain.contact.friction=…"));
  EXPECT_EQ(graze("sweep ball.yaml -o b.sweep" + set + "uncertain.contact.friction=0.5,1").err, "");
}

// sweep.json is as it was written, and each campaign stands at its value, or nothing is shown.
TEST_F(SweepVerb, IsSealed) {
  ASSERT_EQ(graze("sweep ball.yaml -n 2 --quiet -o s.sweep --over contact.friction=0.3,0.9").code, 0);
  const std::string whole = testing::read_file(folder / "s.sweep/sweep.json");
  std::string changed = whole;
  changed.replace(changed.find("\"0.9\""), 5, "\"0.8\"");
  testing::write_file(folder / "s.sweep/sweep.json", changed);
  const testing::Result damaged = graze("sweep s.sweep");
  EXPECT_EQ(damaged.code, 2);
  EXPECT_THAT(damaged.err, HasSubstr("is damaged: it is not as it was written"));
  testing::write_file(folder / "s.sweep/sweep.json", whole);
  fs::rename(folder / "s.sweep/000.graze", folder / "x");
  fs::rename(folder / "s.sweep/001.graze", folder / "s.sweep/000.graze");
  fs::rename(folder / "x", folder / "s.sweep/001.graze");
  const testing::Result exchanged = graze("sweep s.sweep");
  EXPECT_EQ(exchanged.code, 2);
  EXPECT_THAT(exchanged.err, HasSubstr("000.graze: its scenario is not that of this value"));
}

// What cannot be drawn is refused before anything is simulated.
TEST_F(SweepVerb, RefusesPicturesThatCannotBe) {
  const std::string over = "sweep ball.yaml -n 2 --quiet -o p.sweep --over contact.friction=0.3,0.9 ";
  EXPECT_THAT(graze(over + "--plot x.svg --plot-times ./x.svg").err, HasSubstr("is the file of --plot, too"));
  EXPECT_THAT(graze(over + "--plot-times x.svg --adaptive").err, HasSubstr("intervals of times are too narrow"));
  EXPECT_THAT(graze(over + "--plot-times x.svg --set task=~").err, HasSubstr("its task has no requirements"));
  EXPECT_FALSE(fs::exists(folder / "p.sweep"));
  EXPECT_FALSE(fs::exists(folder / "x.svg"));
}

// The table is printed whatever becomes of the picture.
TEST_F(SweepVerb, KeepsTheTableWhereThePictureFails) {
  const testing::Result run = graze("sweep ball.yaml -n 2 --quiet --over contact.friction=0.3,0.9 --plot /proc/x.svg");
  EXPECT_NE(run.code, 0);
  EXPECT_THAT(run.err, HasSubstr("x.svg"));
  EXPECT_THAT(run.out, AllOf(HasSubstr("0.3"), HasSubstr("0.9"), HasSubstr("still")));
  for (const fs::directory_entry& one : fs::directory_iterator(folder.path())) {
    EXPECT_NE(one.path().extension(), ".tmp") << "what is begun takes its name, or goes";
  }
}

// What is doubtful at some values is told with the value; what is doubtful at all of them, once.
TEST_F(SweepVerb, TellsWarningsOfItsValues) {
  const std::string told =
      graze("sweep ball.yaml -n 2 --quiet --set 'uncertain.contact.friction=0.5' --over control.lag='5 ms,180'").err;
  EXPECT_THAT(told, HasSubstr("control.lag=180: "));
  EXPECT_THAT(told, HasSubstr("no command of a policy ever arrives"));
  EXPECT_THAT(told, ::testing::Not(HasSubstr("control.lag=5 ms: ")));
}

// A value that the policies' own `over` replaces would make a flat curve.
TEST_F(SweepVerb, RefusesWhatThePoliciesReplace) {
  const std::string set =
      " --set 'policies=!replace {push: {torque: {constant: 0}, control: {torque: {}}, over: {torque.constant: [0, "
      "1]}}}'";
  const testing::Result swept = graze("sweep ball.yaml -n 2 --quiet --over policies.push.torque.constant=0,1" + set);
  EXPECT_EQ(swept.code, 2);
  EXPECT_THAT(swept.err, AllOf(HasSubstr("--over policies.push.torque.constant=0: 'over' ("),
                               HasSubstr("--set policies.push.over=~")));
}

TEST_F(SweepVerb, RefusesWhatCannotBe) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"ball.yaml", "no --over"},
      {"ball.yaml --over environment.grund.friction=0:1:0.5", "did you mean --over environment.ground.friction=…?"},
      {"ball.yaml --over time.ende=1,2", "did you mean 'end'?"},
      {"ball.yaml --over time.end=1kg,2kg", "the unit 'kg' does not fit; one of: s, ms, us"},
      {"ball.yaml --over contact.friction=1:0:0.1", "nearest right answer: --over contact.friction=1:0:-0.1"},
      {"ball.yaml --over contact.friction=0:1:0", "a step of 0 never comes to the last value"},
      {"ball.yaml --over contact.friction=1:1:1", "is one value; a sweep has two or more"},
      {"ball.yaml --over contact.friction=1", "is one value; a sweep has two or more"},
      {"ball.yaml --over contact.friction=0:1:1e-6", "1e+06 values; at most 1000"},
      {"ball.yaml --over contact.friction=0:1:0.002 --over time.end='20:400:1 ms'", "at most 10000"},
      {"ball.yaml --over contact.friction=1,,2", "an empty value"},
      {"ball.yaml --over contact.friction=0.5,0.50", "the same value twice, in other words"},
      {"ball.yaml --over contact.friction=0.5:0.5000000000009:2e-13", "that twelve digits do not tell from none"},
      {"ball.yaml --over gravity=-1e308:1e308:1e307", "wider than a number holds"},
      {"ball.yaml --over contact.friction=1,2 --adaptive --width 1e-9", "narrower than any number of particles"},
      {"ball.yaml --over contact.friction=1,2 --adaptive --width 0", "nearest right answer: '0.1'"},
      {"ball.yaml --over time.end=0.1,0.2 --over 'time={end: 1},{end: 2}'", "time.end: lies within --over time,"},
      {"ball.yaml --over sampling.seed=1,2", "a sweep compares the same ones"},
      {"ball.yaml --over sampling.particles=8,16", "a sweep compares the same ones"},
      {"ball.yaml --over contact.friction=1,2,1", "the same value twice; nearest right answer: --over "},
      {"ball.yaml --over contact.friction=0:1", "a range is FIRST:LAST:STEP"},
      {"ball.yaml --over 'time.end=1 s:2 kg:1 s'", "one quantity; nearest right answer: --over time.end=1 s:2 s:1 s"},
      {"ball.yaml --over contact.friction=1,2 --width 5%", "--width: is for --adaptive"},
      {"ball.yaml --over contact.friction=1,2 --adaptive --width 2", "--width"},
      {"ball.yaml --over contact.friction=1,2 --adaptive --set sampling.design=latin_hypercube", "Latin hypercube"},
      {"ball.yaml --over contact.friction=1,2 -o x.graze", "nearest right answer: x.sweep"},
      {"ball.yaml --over contact.friction=1,2 --plot x.pdf", "x.pdf: ends in .pdf, but a picture is one SVG or PNG"},
      {"- --over contact.friction=1,2", "give a file instead of -"},
      {".", "holds no sweep"}};
  for (const auto& [arguments, message] : cases) {
    const testing::Result result = graze("sweep " + arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_THAT(result.err, HasSubstr(message)) << arguments;
  }
  EXPECT_FALSE(fs::exists(folder / "ball.sweep")) << "nothing is left of what was refused";
  ASSERT_EQ(graze("sweep ball.yaml -n 2 --quiet --over contact.friction=1,2").code, 0);
  EXPECT_THAT(graze("sweep ball.yaml -n 2 --over contact.friction=1,2").err, HasSubstr("graze sweep ball.sweep"));
  EXPECT_THAT(graze("sweep ball.sweep -n 3").err, HasSubstr("-n: ball.sweep says itself what is swept"));
  testing::write_file(folder / "ball.sweep/sweep.json", "{\"format\": \"graze sweep\"}");
  EXPECT_THAT(graze("sweep ball.sweep").err, HasSubstr("is damaged, or no description of a sweep"));
}

// A range across 0 has 0 in it, and values are the numbers that are simulated.
TEST(SweepAxis, IsWhatItSays) {
  const SweepAxis across = parse_sweep_axis("a.b=-0.3:0.3:0.1 rad");
  EXPECT_EQ(across.texts[3], "0 rad");
  EXPECT_EQ(across.values[3], 0);
  const SweepAxis up = parse_sweep_axis("a.b=0.4:1.4:0.05 N s");
  EXPECT_EQ(up.texts[14], "1.1 N s");
  EXPECT_EQ(up.values[14], 1.1);
  EXPECT_EQ(parse_sweep_axis("a.b=1e-12:1:0.5").values[0], 1e-12) << "the first value is the one that is written";
}

// Values of a range are written without the rounding of their sum; units may stand behind each number or behind the
// last.
TEST(SweepAxis, ReadsRangesAndLists) {
  const SweepAxis plain = parse_sweep_axis("a.b=0.1:0.5:0.1");
  EXPECT_THAT(plain.texts, ElementsAre("0.1", "0.2", "0.3", "0.4", "0.5"));
  EXPECT_THAT(parse_sweep_axis("a=1:4:1 cm").texts, ElementsAre("1 cm", "2 cm", "3 cm", "4 cm"));
  const SweepAxis mixed = parse_sweep_axis("a=5 mm:2 cm:5 mm");
  EXPECT_EQ(mixed.unit, "m");
  EXPECT_THAT(mixed.texts, ElementsAre("0.005 m", "0.01 m", "0.015 m", "0.02 m"));
  EXPECT_THAT(parse_sweep_axis("a=1:0:-0.4").values, ElementsAre(1, 0.6, ::testing::DoubleNear(0.2, 1e-15)));
  const SweepAxis words = parse_sweep_axis("contact.model=complementarity, compliant");
  EXPECT_FALSE(words.numeric);
  EXPECT_THAT(words.texts, ElementsAre("complementarity", "compliant"));
  EXPECT_THAT(parse_sweep_axis("robot.initial.position=[0, 0, 1],[0, 0, 2]").texts,
              ElementsAre("[0, 0, 1]", "[0, 0, 2]"));
  EXPECT_THAT(parse_sweep_axis("a=1 cm,25 mm").values, ElementsAre(0.01, 0.025));
}

}  // namespace
}  // namespace graze
