// The program as a newcomer meets it: right and wrong arguments, exit codes, one clear message each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <nlohmann/json.hpp>

#include "archive/archive.h"
#include "tests/jobs/program.h"

namespace graze::testing {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

/// Exit code `code`, and one message that says all of `parts`.
void expect_refused(const Result& run, int code, const std::vector<std::string>& parts) {
  EXPECT_EQ(run.code, code) << run.err;
  for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part));
  EXPECT_LE(std::count(run.err.begin(), run.err.end(), '\n'), 2) << "more than one message: " << run.err;
}

class CommandLine : public ::testing::Test {
 protected:
  TemporaryFolder folder;
  void SetUp() override { write_ball(folder); }
  Result run(const std::string& arguments) { return graze(folder.path(), arguments); }
};

TEST_F(CommandLine, HelpNamesEveryVerbAndEachHelpHasExamples) {
  const Result help = run("--help");
  EXPECT_EQ(help.code, 0);
  for (const std::string verb : {"check", "sample", "run", "score", "pack"}) {
    EXPECT_THAT(help.out, HasSubstr(verb));
    EXPECT_THAT(run(verb + " --help").out, HasSubstr("graze " + verb)) << verb;
  }
  EXPECT_THAT(help.out, ContainsRegex("Documentation:[ \n]+/.*docs\\."));  // where they are on this machine
  EXPECT_THAT(run("--version").out, ContainsRegex("graze [0-9]+\\.[0-9]+\\.[0-9]+ .*bullet"));
}

TEST_F(CommandLine, WrongVerbsAndOptionsExitWith2) {
  expect_refused(run("scoer x.h5"), 2, {"'scoer' is not a verb", "did you mean 'score'"});
  EXPECT_EQ(run("").code, 2);
  EXPECT_EQ(run("run").code, 2);
  EXPECT_EQ(run("run ball.yaml -n 0").code, 2);
  EXPECT_EQ(run("run ball.yaml -n many").code, 2);
  EXPECT_EQ(run("run ball.yaml --treads 2").code, 2);
  expect_refused(run("run ball.yaml --set time.end"), 2, {"--set time.end", "PATH=VALUE"});
  expect_refused(run("run ball.yaml --set time.ende=1"), 2, {"ende", "end"});
  expect_refused(run("run ball.yaml --policy stil"), 2, {"stil", "still"});
  expect_refused(run("score x.h5 --require 'q > 1'"), 2, {"nearest right answer: 'p >= 0.95'"});
}

// Claim: `-` is a scenario on standard input, with paths from the working directory; what ran from it is resumed and
// replayed like any other.
TEST_F(CommandLine, ReadsAScenarioFromStandardInput) {
  const std::string input = "cat ball.yaml | '" + std::string(GRAZE_PROGRAM) + "' ";
  const auto piped = [&](const std::string& arguments) { return shell(folder.path(), input + arguments); };
  const Result checked = piped("check -");
  EXPECT_EQ(checked.code, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("Ball"));
  EXPECT_EQ(piped("sample - -n 3").out, run("sample ball.yaml -n 3").out);
  EXPECT_EQ(piped("run - -n 4 --quiet --telemetry all").code, 0);
  EXPECT_TRUE(fs::exists(folder / "scenario.graze/campaign.h5"));
  EXPECT_EQ(run("resume scenario.graze -n 8 --quiet").code, 0);
  EXPECT_EQ(run("replay scenario.graze --particle 7").code, 0);
  expect_refused(piped("check - --set robot.urdf=bal.urdf"), 2,
                 {"--set robot.urdf=bal.urdf: ", "did you mean 'ball.urdf'"});
  expect_refused(shell(folder.path(), "echo 'graze: 2' | '" + std::string(GRAZE_PROGRAM) + "' check -"), 2,
                 {"graze: standard input:1:8: graze: 2: this program reads format 1"});
  expect_refused(piped("submit - --time 9 --dry-run"), 2, {"submit: -: ", "give a file"});
}

TEST_F(CommandLine, OverridesMakeWhatIsMissing) {
  EXPECT_EQ(run("check ball.yaml --set record.telemetry=all --set contact.model=~").code, 0);
  expect_refused(run("check ball.yaml --set tiem.end=2"), 2,
                 {"--set tiem.end=2: tiem: unknown key; did you mean 'time'?"});
}

TEST_F(CommandLine, MissingFilesAreNamed) {
  expect_refused(run("check nowhere.yaml"), 2, {"nowhere.yaml"});
  expect_refused(run("score nowhere.h5"), 2, {"nowhere.h5"});
  expect_refused(run("pack nowhere.graze"), 2, {"nowhere.graze"});
  expect_refused(run("check ball.yaml --set robot.urdf=no.urdf"), 2, {"no.urdf"});
}

TEST_F(CommandLine, CheckPrintsTheParametersAndJson) {
  const Result text = run("check ball.yaml");
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("robot.link.ball.density"));
  const auto json = nlohmann::json::parse(run("check ball.yaml --json").out);
  EXPECT_EQ(json["count"]["persistent"], 2);
  EXPECT_FALSE(fs::exists(folder / "ball.graze"));
}

// Claim: check, its JSON and the particles themselves agree about how many scalars there are; one of a thing is not
// many.
TEST_F(CommandLine, CountsOfParametersAgree) {
  const std::string curb = "'" + data("scenarios/quadruped_curb.yaml") + "'";
  const auto json = nlohmann::json::parse(run("check --json " + curb).out);
  EXPECT_EQ(json["count"]["total"], 176);
  EXPECT_EQ(json["count"]["scalars"], json["parameters"].size());
  EXPECT_THAT(run("check " + curb).out,
              HasSubstr("; " + std::to_string(json["parameters"].size()) + " scalars (12 conical errors"));
  const Result sampled = run("sample -n 1 " + curb);
  const std::string head = sampled.out.substr(0, sampled.out.find('\n'));
  EXPECT_EQ(static_cast<std::size_t>(std::count(head.begin(), head.end(), ',')), json["parameters"].size());
  EXPECT_THAT(run("check ball.yaml -n 1").out,
              AllOf(HasSubstr("ball: 1 link, 0 driven joints"), HasSubstr("1 object; "),
                    HasSubstr("uncertain    2 parameters: ")));
}

TEST_F(CommandLine, SampleWritesTheParticlesAndIsRepeatable) {
  const Result a = run("sample ball.yaml -n 3 --seed 5");
  EXPECT_EQ(a.code, 0) << a.err;
  EXPECT_THAT(a.out, ::testing::StartsWith("particle,"));
  EXPECT_EQ(std::count(a.out.begin(), a.out.end(), '\n'), 4);
  EXPECT_EQ(run("sample ball.yaml -n 3 --seed 5 -o p.csv").code, 0);
  EXPECT_EQ(read_file(folder / "p.csv"), a.out);
  EXPECT_NE(run("sample ball.yaml -n 3 --seed 6").out, a.out);
  write_file(folder / "plain", "a file");
  expect_refused(run("sample ball.yaml -o plain/folder/p.csv"), 3, {"plain/folder", "cannot be written"});
}

/// A score without the replay commands, which name the archive.
nlohmann::json score_of(const std::string& text) {
  nlohmann::json score = nlohmann::json::parse(text);
  for (auto& failure : score["failures"]) failure.erase("replay");
  return score;
}

TEST_F(CommandLine, RunScoreAndPackAgree) {
  const Result first = run("run ball.yaml -n 20 --threads 2 --json");
  ASSERT_EQ(first.code, 0) << first.err;
  const auto table = score_of(first.out);
  EXPECT_EQ(score_of(run("score ball.graze --json").out), table);
  ASSERT_EQ(run("pack ball.graze").code, 0);
  EXPECT_EQ(score_of(run("score ball.h5 --json").out), table);
  ASSERT_EQ(run("run ball.yaml -n 20 --threads 1 -o direct.h5 --quiet").code, 0);
  EXPECT_EQ(score_of(run("score direct.h5 --json").out), table);
  EXPECT_FALSE(fs::exists(folder / "direct.graze"));
}

TEST_F(CommandLine, NothingIsOverwrittenWithoutForce) {
  ASSERT_EQ(run("run ball.yaml -n 4").code, 0);
  const std::string before = run("score ball.graze --json").out;
  expect_refused(run("run ball.yaml -n 8"), 2, {"ball.graze", "--force"});
  EXPECT_EQ(run("score ball.graze --json").out, before);
  ASSERT_EQ(run("pack ball.graze").code, 0);
  expect_refused(run("pack ball.graze"), 2, {"ball.h5", "--force"});
  expect_refused(run("run ball.yaml -n 8 -o ball.h5"), 2, {"ball.h5", "--force"});
  EXPECT_EQ(run("run ball.yaml -n 8 --force").code, 0);
  EXPECT_NE(run("score ball.graze --json").out, before);
  // A foreign folder is not Graze's to remove, force or not.
  fs::create_directory(folder / "precious");
  write_file(folder / "precious/thesis.txt", "years");
  EXPECT_EQ(run("run ball.yaml -n 2 -o precious --force").code, 2);
  EXPECT_EQ(read_file(folder / "precious/thesis.txt"), "years");
}

TEST_F(CommandLine, AFolderThatCannotBeWrittenIsAMachineFailure) {
  write_file(folder / "file", "");
  expect_refused(run("run ball.yaml -n 2 -o file/out.graze"), 3, {"file/out.graze"});
  expect_refused(run("run ball.yaml -n 2 -o /proc/out.graze"), 3, {"/proc/out.graze"});
}

TEST_F(CommandLine, AnArchiveThatIsNoneOrCutShortIsRefused) {
  expect_refused(run("score ball.yaml"), 2, {"ball.yaml"});
  ASSERT_EQ(run("run ball.yaml -n 4 -o a.h5").code, 0);
  const std::string whole = read_file(folder / "a.h5");
  write_file(folder / "short.h5", whole.substr(0, whole.size() / 2));
  expect_refused(run("score short.h5"), 2, {"short.h5"});
  expect_refused(run("score ."), 2, {"graze: .: ", "campaign"});
}

TEST_F(CommandLine, AFullDiskLosesNothingThatWasWritten) {
  const fs::path disk = folder / "disk";
  fs::create_directory(disk);
  if (mount("none", disk.c_str(), "tmpfs", 0, "size=256k") != 0) GTEST_SKIP() << "cannot mount a small disk here";
  const Result small = graze(disk, "run ../ball.yaml -n 4 -o small.graze");
  const std::string score = graze(folder.path(), "score disk/small.graze --json").out;
  const std::string too_large = "run ball.yaml -n 20000 -o disk/large.graze --quiet";
  const Result refused = graze(folder.path(), too_large);
  const bool begun = fs::exists(disk / "large.graze");
  const Result large = graze(folder.path(), too_large + " --ignore-space");
  const std::string after = graze(folder.path(), "score disk/small.graze --json").out;
  umount(disk.c_str());
  EXPECT_EQ(small.code, 0) << small.err;
  expect_refused(refused, 3, {"large.graze: will not fit", "are free", "--ignore-space"});
  EXPECT_FALSE(begun);
  expect_refused(large, 3, {"large.graze", "No space left on device"});
  EXPECT_FALSE(score.empty());
  EXPECT_EQ(score, after);
}

TEST_F(CommandLine, GatesAnswerWithTheExitCode) {
  ASSERT_EQ(run("run ball.yaml -n 40 -o all.graze --set task.objective.low.height.below=1").code, 0);
  EXPECT_EQ(run("score all.graze --require 'p >= 0.8'").code, 0);
  EXPECT_EQ(run("score all.graze --require 'p >= 0.99'").code, 4);
  ASSERT_EQ(run("run ball.yaml -n 40 -o none.graze --set task.objective.low.height.below=0").code, 0);
  EXPECT_EQ(run("score none.graze --require 'p >= 0.8'").code, 1);
  expect_refused(run("score none.graze --require 'p >= 0.8' --policy stll"), 2, {"stll", "still"});
}

// Claim: the command that an archive records can be pasted into a shell.
TEST_F(CommandLine, IsRecordedAsAShellReadsIt) {
  ASSERT_EQ(run("run ball.yaml -n 8 --quiet --policy 'st*' -o 'my ball.graze'").code, 0);
  EXPECT_EQ(Archive(folder / "my ball.graze").info().command_line,
            "graze run ball.yaml -n 8 --quiet --policy 'st*' -o 'my ball.graze'");
}

TEST_F(CommandLine, AStoppedRunKeepsWhatWasFinishedAndSaysSo) {
  // A second after it has begun, however long that took. The shell becomes the program: one in the background would
  // ignore SIGINT.
  const Result stopped = shell(
      folder.path(), std::string("exec sh -c '(until [ -e ball.graze/campaign.h5 ]; do sleep 0.05; done; sleep 1; "
                                 "kill -INT $$) & exec \"") +
                         GRAZE_PROGRAM + "\" run ball.yaml -n 4000000 --threads 1 --quiet'");
  EXPECT_THAT(stopped.err, HasSubstr("stopped by SIGINT before the campaign was complete"));
  const Result score = run("score ball.graze --json");
  EXPECT_EQ(score.code, 3);
  const auto table = nlohmann::json::parse(score.out);
  EXPECT_FALSE(table["complete"]);
  EXPECT_GT(table["policies"][0]["n"], 0);
}

TEST_F(CommandLine, MemoryDoesNotGrowWithTheNumberOfParticles) {
  // An address sanitizer would hold on to 256 MB of freed memory.
  setenv("ASAN_OPTIONS", "quarantine_size_mb=4", 0);
  // Peak memory of children only ever grows: the small campaign goes first.
  const Result few = run("run ball.yaml -n 200 --quiet -o few.graze --set time.end='5 ms'");
  const Result many = run("run ball.yaml -n 10000 --quiet -o many.graze --set time.end='5 ms'");
  ASSERT_EQ(few.code, 0) << few.err;
  ASSERT_EQ(many.code, 0) << many.err;
  // What may grow is the table of traces that the score reads: 10,000 rows of about 200 bytes.
  EXPECT_LT(many.peak_kb - few.peak_kb, 40 * 1024);
}

}  // namespace
}  // namespace graze::testing
