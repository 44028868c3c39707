// Claim: what a verb writes is never lost silently, and never takes the place of what it reads or of what was there.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::BallCampaign;
using testing::digests;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Outputs, AFullStandardOutputIsAMachineFailure) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  for (const std::string verb :
       {"score a.graze", "score a.graze --json", "score a.graze --failures", "status a.graze", "check ball.yaml",
        "replay a.graze --particle 1", "sample ball.yaml -n 3", "pack a.graze --force", "resume a.graze --quiet"}) {
    for (const char* to : {" >/dev/full", " >&-"}) {
      const testing::Result result = campaign.graze(verb + to);
      EXPECT_EQ(result.code, 3) << verb << to;
      EXPECT_THAT(result.err, AllOf(HasSubstr("standard output"), HasSubstr("cannot be written"))) << verb << to;
    }
  }
}

// Claim: a closed standard output is told in the same words by all, also by those that print their help alone.
TEST(Outputs, AClosedStandardOutputIsToldAlike) {
  const BallCampaign campaign;
  for (const std::string verb : {"check ball.yaml", "sample ball.yaml -n 3", "--version", "check --help"}) {
    const testing::Result result = campaign.graze(verb + " >&-");
    EXPECT_EQ(result.code, 3) << verb;
    EXPECT_EQ(result.err, "graze: standard output: cannot be written\n") << verb;
  }
}

// Claim: a verb whose reader has gone ends by SIGPIPE without a word, as programs in pipes do; run goes on, because
// what it is for is on the disk.
// Claim: too few descriptors are the machine's want, not the scenario's: nobody is told that a file is wrong.
TEST(Outputs, TooFewDescriptorsAreAMachineFailure) {
  if (GRAZE_SANITIZED != 0) GTEST_SKIP() << "sanitizers need descriptors of their own";
  const BallCampaign campaign;
  int done = 0, failed = 0;
  for (int most = 8; most <= 26; most += 2) {
    const testing::Result run =
        testing::shell(campaign.folder.path(), "ulimit -n " + std::to_string(most) + "; exec '" + GRAZE_PROGRAM +
                                                   "' run ball.yaml -n 4 --quiet --threads 1 -o a.graze --force");
    if (run.code == 127) continue;  // the shell, or its libraries
    EXPECT_THAT(run.code, ::testing::AnyOf(0, 3)) << most << ": " << run.err;
    if (run.code == 3) {
      EXPECT_THAT(run.err, HasSubstr("Too many open files")) << most;
    }
    ++(run.code == 0 ? done : failed);
  }
  EXPECT_GT(done, 0);
  EXPECT_GT(failed, 0);
}

TEST(Outputs, AReaderThatHasGoneIsNoFailure) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const auto piped = [&](const std::string& verb) {
    // The reader is gone before the first word.
    return testing::shell(campaign.folder.path(), "mkfifo -m 600 p; (exec 3<>p; exec 4>p; exec 3<&-; '" GRAZE_PROGRAM
                                                  "' " +
                                                      verb + " >&4); code=$?; rm p; exit $code");
  };
  for (const std::string verb : {"check ball.yaml", "sample ball.yaml -n 3", "score a.graze", "status a.graze"}) {
    const testing::Result result = piped(verb);
    EXPECT_EQ(result.code, 128 + SIGPIPE) << verb;
    EXPECT_EQ(result.err, "") << verb;
  }
  const testing::Result run = piped("run ball.yaml -n 20 --quiet -o b.graze");
  EXPECT_EQ(run.code, 0);
  EXPECT_THAT(run.err, HasSubstr("'graze score' prints it again"));
  EXPECT_EQ(campaign.graze("verify b.graze").code, 0);
}

TEST(Outputs, NothingIsWrittenOverItsSource) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  ASSERT_EQ(campaign.graze("pack a.graze").code, 0);
  const std::string scenario = testing::read_file(campaign.folder / "ball.yaml");
  for (const std::string verb :
       {"replay a.h5 --particle 1 -o a.h5 --force", "replay a.graze --particle 1 -o a.graze/campaign.h5 --force",
        "pack a.graze -o a.graze/campaign.h5 --force", "sample ball.yaml -n 3 -o ball.yaml --force"}) {
    const testing::Result result = campaign.graze(verb);
    EXPECT_EQ(result.code, 2) << verb;
    EXPECT_THAT(result.err, HasSubstr("which is only read")) << verb;
  }
  EXPECT_EQ(testing::read_file(campaign.folder / "ball.yaml"), scenario);
  EXPECT_EQ(campaign.graze("score a.h5").code, 0);
  EXPECT_EQ(campaign.graze("score a.graze").code, 0);
}

// A file is made in a directory of its name: one that is there already is somebody's campaign.
TEST(Outputs, ForceForAFileReplacesNoCampaign) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const auto before = digests(campaign.folder / "a.graze");
  for (const char* force : {"", " --force"}) {
    const testing::Result refused = campaign.graze(std::string("run ball.yaml -n 3 --quiet -o a.h5") + force);
    EXPECT_EQ(refused.code, 2);
    EXPECT_THAT(refused.err, AllOf(HasSubstr("a.graze, which is there already"), HasSubstr("graze resume a.graze")));
  }
  EXPECT_EQ(digests(campaign.folder / "a.graze"), before);
  ASSERT_EQ(campaign.graze("pack a.graze").code, 0);
  std::filesystem::remove_all(campaign.folder / "a.graze");
  EXPECT_EQ(campaign.graze("run ball.yaml -n 3 --quiet --force -o a.h5").code, 0) << "the file itself is replaced";
  EXPECT_EQ(digests(campaign.folder / "a.h5").at("still").size(), 3u);
}

TEST(Outputs, LeftoversOfAPackAreRemoved) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 4 --quiet -o a.graze").code, 0);
  const std::vector<std::string> left = {"z.h5.texts.0123456789abcdef.tmp", "z.h5.0123456789abcdef.tmp"};
  for (const std::string& name : left) testing::write_file(campaign.folder / name, "");
  ASSERT_EQ(campaign.graze("pack a.graze -o z.h5").code, 0);
  for (const std::string& name : left) EXPECT_FALSE(std::filesystem::exists(campaign.folder / name)) << name;
}

TEST(Outputs, AFolderIsNoFileToPackInto) {
  const BallCampaign campaign;
  std::filesystem::create_directory(campaign.folder / "d.h5");
  const testing::Result refused = campaign.graze("run ball.yaml -n 20 --force -o d.h5");
  EXPECT_EQ(refused.code, 2) << "before anything is simulated";
  EXPECT_THAT(refused.err, HasSubstr("d.h5: is a directory"));
  EXPECT_FALSE(std::filesystem::exists(campaign.folder / "d.graze"));
}

TEST(Outputs, SamplesAreReplacedOnlyByForce) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("sample ball.yaml -n 3 -o s.csv").code, 0);
  const testing::Result again = campaign.graze("sample ball.yaml -n 4 -o s.csv");
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, AllOf(HasSubstr("s.csv"), HasSubstr("--force")));
  EXPECT_EQ(campaign.graze("sample ball.yaml -n 4 -o s.csv --force").code, 0);
}

/// A ball whose scenario is made of files of every kind, in folders of their own.
void write_many_files(const BallCampaign& campaign) {
  const auto at = [&](const char* name) { return campaign.folder / name; };
  std::filesystem::create_directory(at("parts"));
  testing::write_file(at("parts/time.yaml"), "time: {end: 50 ms, step: 1 ms, control: 1 ms}\n");
  testing::write_file(at("parts/heights.csv"), "z\n0.01\n0.02\n0.03\n");
  testing::write_file(at("parts/block.obj"),
                      "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  std::string text = testing::ball_scenario();
  const auto replace = [&](const std::string& old, const std::string& now) {
    text.replace(text.find(old), old.size(), now);
  };
  replace("graze: 1\n", "graze: 1\ninclude: [parts/time.yaml]\n");
  replace("time: {end: 50 ms, step: 1 ms, control: 1 ms}\n", "");
  replace("{uniform: [-5 cm, 5 cm]}", "{empirical: {file: parts/heights.csv, column: z, unit: m}}");
  testing::write_file(at("ball.yaml"), text);
  std::string urdf = testing::kBallUrdf;
  const std::string sphere = "<sphere radius=\"0.1\"/>";
  urdf.replace(urdf.find(sphere), sphere.size(), "<mesh filename=\"parts/block.obj\"/>");
  testing::write_file(at("ball.urdf"), urdf);
}

// Claim: sample takes the place of no file that the scenario is read from, by whatever path it is called, --force or
// not.
TEST(Outputs, SampleSparesAllThatTheScenarioIsMadeOf) {
  const BallCampaign campaign;
  write_many_files(campaign);
  ASSERT_EQ(campaign.graze("sample ball.yaml -n 3").code, 0) << campaign.graze("sample ball.yaml -n 3").err;
  std::filesystem::create_symlink("parts", campaign.folder / "link");
  for (const std::string file : {"ball.yaml", "ball.urdf", "parts/time.yaml", "parts/heights.csv", "parts/block.obj",
                                 "link/heights.csv", "./parts/../parts/block.obj"}) {
    const std::string before = testing::read_file(campaign.folder / file);
    const testing::Result refused = campaign.graze("sample ball.yaml -n 3 --force -o " + file);
    EXPECT_EQ(refused.code, 2) << file;
    EXPECT_THAT(refused.err, HasSubstr("which is only read")) << file;
    EXPECT_EQ(testing::read_file(campaign.folder / file), before) << file;
  }
  std::filesystem::create_directory(campaign.folder / "elsewhere");
  const testing::Result far =
      testing::graze(campaign.folder / "elsewhere", "sample ../ball.yaml -n 3 --force -o ../parts/heights.csv");
  EXPECT_EQ(far.code, 2);
  EXPECT_THAT(far.err, HasSubstr("which is only read"));
}

// Claim: an output that is named as another kind of file is refused with the name that fits, before anything is done.
TEST(Outputs, EndingsThatDoNotFitAreRefused) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o a.graze").code, 0);
  const std::vector<std::array<std::string, 3>> wrong = {
      {"pack a.graze -o x.csv", "x.csv", "x.h5 or x.hdf5"},
      {"pack a.graze -o x.graze", "x.graze", "x.h5 or x.hdf5"},
      {"check ball.yaml -o foo.txt", "foo.txt", "foo.graze or foo.h5"},
      {"check ball.yaml --json -o foo.txt", "foo.txt", "foo.graze or foo.h5"},
      {"pack a.graze -o x", "x", "x.h5 or x.hdf5"},
      {"pack a.graze -o d/x", "d/x", "d/x.h5 or d/x.hdf5"},
      {"replay a.graze --particle 1 -o a.txt", "a.txt", "a.h5 or a.hdf5 or a.csv"},
      {"replay a.graze --particle 1 -o a", "a", "a.h5 or a.hdf5 or a.csv"},
      {"replay a.graze --particle 1 -o p.1", "p.1", "p.1.h5 or p.1.hdf5 or p.1.csv"},
      {"replay a.graze --particle 1 -o a.csv/", "a.csv/", "a.csv"},
      {"replay a.graze --particle 1 -o new/", "new/", "new.h5 or new.hdf5 or new.csv"},
      {"run ball.yaml -n 2 -o foo.txt", "foo.txt", "foo.graze or foo.h5"},
      {"run ball.yaml -n 2 -o foo.hdf5", "foo.hdf5", "foo.graze or foo.h5"},
      {"run ball.yaml -n 2 -o x.OBJ", "x.OBJ", "x.graze or x.h5"},
      {"run ball.yaml -n 2 -o .h5", ".h5", "campaign.graze or campaign.h5"},
      {"run ball.yaml -n 2 -o .STL", ".STL", "campaign.graze or campaign.h5"},
      {"run ball.yaml -n 2 -o a.h5/", "a.h5/", "a.h5"},
      {"pack a.graze -o a.h5/", "a.h5/", "a.h5"},
      {"pack a.graze -o new/", "new/", "new.h5 or new.hdf5"},
      {"sample ball.yaml -n 2 -o .csv", ".csv", "campaign.csv or campaign.txt"},
      {"sample ball.yaml -n 2 -o p.h5", "p.h5", "p.csv or p.txt"}};
  for (const auto& [arguments, file, right] : wrong) {
    const testing::Result refused = campaign.graze(arguments);
    EXPECT_EQ(refused.code, 2) << arguments;
    EXPECT_THAT(refused.err, AllOf(HasSubstr("--output " + file), HasSubstr("nearest right answer: " + right)));
    EXPECT_FALSE(std::filesystem::exists(campaign.folder / file)) << arguments;
  }
  EXPECT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o d.graze/").code, 0) << "a campaign is a directory";
  EXPECT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o B.H5").code, 0);
  EXPECT_TRUE(std::filesystem::is_regular_file(campaign.folder / "B.H5"));
  EXPECT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o v1.2").code, 0) << "no kind of file";
  EXPECT_EQ(campaign.graze("pack a.graze -o x.hdf5").code, 0);
}

// Claim: sample gives names as they are to files and other programs, as CSV, and escaped to a terminal.
TEST(Outputs, NamesReachNoTerminalRaw) {
  const BallCampaign campaign;
  for (const char* file : {"ball.yaml", "ball.urdf"}) {
    std::string text = testing::read_file(campaign.folder / file);
    for (std::size_t at = 0; (at = text.find("link name=\"ball\"", at)) != std::string::npos; ++at) {
      text.replace(at, 16, "link name=\"ba,l\u009bl\"");
    }
    for (std::size_t at = 0; (at = text.find("link: ball", at)) != std::string::npos; ++at) {
      text.replace(at, 10, "link: \"ba*l\"");
    }
    if (const auto at = text.find("robot.link.ball.density"); at != std::string::npos)
      text.replace(at, 23, "robot.link.*.density");
    testing::write_file(campaign.folder / file, text);
  }
  const testing::Result piped = campaign.graze("sample ball.yaml -n 1");
  ASSERT_EQ(piped.code, 0) << piped.err;
  EXPECT_THAT(piped.out, HasSubstr("\"robot.link.ba,l\u009bl.density\""));
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0) GTEST_SKIP() << "no terminals here";
  const std::string name = ptsname(terminal);
  const int held = open(name.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);  // so that it stays until it is read
  ASSERT_EQ(campaign.graze("sample ball.yaml -n 1 >" + name).code, 0);
  ASSERT_EQ(testing::shell(campaign.folder.path(), "'" GRAZE_PROGRAM "' sample ball.yaml -n 1 -o " + name).code, 0);
  std::string seen(4096, '\0');
  seen.resize(static_cast<std::size_t>(std::max<ssize_t>(read(terminal, seen.data(), seen.size()), 0)));
  close(held);
  close(terminal);
  EXPECT_THAT(seen, AllOf(HasSubstr("ba,l\\u009bl"), Not(HasSubstr("\u009b"))));
}

// Claim: what a replay exports as sensed is of the robot: a movable object has no column of zeros.
TEST(Outputs, ObjectsFeelNoForces) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign
                .graze("run ball.yaml -n 1 --quiet -o a.graze --set 'environment.crate={box: [1, 1, 0.1], position: "
                       "[3, 0, 0.05], movable: true, mass: 1}'")
                .code,
            0);
  ASSERT_EQ(campaign.graze("replay a.graze --particle 0 -o a.csv").code, 0);
  const std::string text = testing::read_file(campaign.folder / "a.csv");
  const std::string head = text.substr(0, text.find('\n')), next = text.substr(head.size() + 1);
  EXPECT_THAT(
      head, AllOf(HasSubstr("sensed.link_force.ball [N]"), HasSubstr("q.crate.x"), Not(HasSubstr("link_force.crate"))));
  EXPECT_EQ(std::count(next.begin(), next.begin() + static_cast<std::ptrdiff_t>(next.find('\n')), ','),
            std::count(head.begin(), head.end(), ','));
}

// Claim: where nothing is left to do progress says so, rather than that 0 of 0 are done.
TEST(Outputs, NothingLeftIsNotZeroOfZero) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o a.graze").code, 0);
  EXPECT_THAT(campaign.graze("resume a.graze").err, Not(HasSubstr("0/0")));
}

// Claim: a particle that is asked for twice is one particle.
TEST(Outputs, ParticlesAreSampledOnce) {
  const BallCampaign campaign;
  const std::string once = campaign.graze("sample ball.yaml -n 9 --particle 4 --particle 2").out;
  EXPECT_EQ(campaign.graze("sample ball.yaml -n 9 --particle 4 --particle 2 --particle 4").out, once);
  EXPECT_EQ(std::count(once.begin(), once.end(), '\n'), 3);
}

// Claim: one part alone is no whole campaign, whoever looks at it, and packing what is not whole is told.
TEST(Outputs, APartIsNotTheWhole) {
  const BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --part 1/2 --quiet -o one.graze").code, 0);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 20 --part 2/2 --quiet -o two.graze").code, 0);
  EXPECT_THAT(campaign.graze("score one.graze").out, HasSubstr("ONE PART: particles 0 to 9 of 20"));
  EXPECT_THAT(campaign.graze("status two.graze").out, HasSubstr("one part: particles 10 to 19 of 20"));
  const testing::Result alone = campaign.graze("pack one.graze -o p.h5");
  EXPECT_EQ(alone.code, 0);
  EXPECT_THAT(alone.err, HasSubstr("holds 10 of 20 traces"));
  EXPECT_THAT(campaign.graze("score p.h5").out, HasSubstr("INCOMPLETE"));
  EXPECT_THAT(campaign.graze("status p.h5").out, AllOf(HasSubstr("this file cannot"), Not(HasSubstr("graze resume"))));
  EXPECT_THAT(campaign.graze("resume p.h5").err, HasSubstr("packed files cannot go on"));
  const testing::Result both = campaign.graze("pack one.graze two.graze -o p.h5 --force");
  EXPECT_EQ(both.err, "");
  EXPECT_THAT(campaign.graze("status p.h5").out, HasSubstr("complete\n"));
}

// Claim: what a run into a file leaves that was killed before its campaign was described is in no other run's way.
TEST(Outputs, ACampaignThatWasNeverDescribedIsBegunAnew) {
  const BallCampaign campaign;
  testing::fs::create_directories(campaign.folder / "a.graze" / "shards");
  testing::write_file(campaign.folder / "a.graze" / "lock", "");
  testing::write_file(campaign.folder / "a.graze" / "campaign.h5.tmp", "half");
  const testing::Result result = campaign.graze("run ball.yaml -n 8 --quiet -o a.h5");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(campaign.graze("status a.h5").out, HasSubstr("8 of 8 traces"));
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "a.graze"));
}

// Claim: a pipe that nobody reads is refused instead of waited for; one that is read gets the particles.
TEST(Outputs, APipeNeedsAReader) {
  const BallCampaign campaign;
  const testing::Result none = testing::shell(
      campaign.folder.path(), "mkfifo pipe; timeout 20 '" GRAZE_PROGRAM "' sample ball.yaml -n 3 -o pipe");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("pipe: is a pipe that nobody reads; start its reader first"));
  const testing::Result read =
      testing::shell(campaign.folder.path(),
                     "exec 3<>pipe; '" GRAZE_PROGRAM "' sample ball.yaml -n 3 -o pipe && timeout 5 head -4 <&3");
  EXPECT_EQ(read.code, 0) << read.err;
  EXPECT_EQ(std::count(read.out.begin(), read.out.end(), '\n'), 4);
}

// Claim: names of any bytes are printed as JSON that can be read.
TEST(Outputs, JsonIsReadableWhateverNamesAreMadeOf) {
  const BallCampaign campaign;
  std::string text = testing::read_file(campaign.folder / "ball.yaml");
  text.replace(text.find("name: Ball"), 10, "name: \"B\xE9ll\"");
  testing::write_file(campaign.folder / "b\xE9.yaml", text);
  const testing::Result result = campaign.graze("check --json 'b\xE9.yaml'");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_TRUE(nlohmann::json::accept(result.out));
}

}  // namespace
}  // namespace graze
