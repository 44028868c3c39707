// Claim: a controller in a shared object runs only if the user says so and is the one that was meant; it gives the bits
// of the same law of ours, for any number of threads, in a replay and after a resume; what cannot be loaded is refused
// with its name before anything is simulated.
#include <elf.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <tuple>

#include "tests/controllers/swing.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::outcomes;
using testing::Result;
using testing::Swing;

namespace fs = std::filesystem;

TEST(Library, RunsNothingUnlessTrusted) {
  const Swing swing;
  swing.odd("nothing");
  const fs::path trace = swing.folder / "loaded";
  setenv("ODD_TRACE", trace.c_str(), 1);
  for (const std::string isolation : {"process", "none"}) {
    swing.odd("nothing", ", isolation: " + isolation);
    EXPECT_EQ(swing.graze("check swing.yaml").code, 0);
    for (const char* verb : {"run swing.yaml", "check swing.yaml --determinism", "check swing.yaml --probe",
                             "steps swing.yaml", "sources swing.yaml"}) {
      const Result refused = swing.graze(verb);
      EXPECT_EQ(refused.code, 2) << verb << refused.err;
      EXPECT_THAT(refused.err, HasSubstr("--trust")) << verb;
      EXPECT_FALSE(fs::exists(trace)) << verb;
    }
  }
  EXPECT_THAT(swing.graze("run swing.yaml").err, HasSubstr("swing.yaml:13:"));
  for (const char* verb : {"check swing.yaml --trust", "run swing.yaml --trust -n 1 --quiet"}) {
    EXPECT_EQ(swing.graze(verb).code, 0) << verb;
    EXPECT_TRUE(fs::remove(trace)) << verb;
  }
  unsetenv("ODD_TRACE");
}

TEST(Library, RefusesWhatCannotBeLoaded) {
  const Swing swing;
  const auto refused = [&](const std::string& library, const std::string& text) {
    for (const std::string isolation : {"", ", isolation: none"}) {
      swing.write(library + isolation);
      const Result run = swing.graze("run swing.yaml --trust");
      EXPECT_EQ(run.code, 2) << library << run.err;
      EXPECT_THAT(run.err, HasSubstr(text));
      EXPECT_FALSE(fs::exists(swing.folder / "swing.graze")) << library;
      const Result check = swing.graze("check swing.yaml --trust");
      EXPECT_EQ(check.code, 2) << library << check.err;
      EXPECT_THAT(check.err, HasSubstr(text));
    }
  };
  swing.build("no_symbol.so", "-DNO_SYMBOL");
  swing.build("other_version.so", "-DOTHER_VERSION");
  swing.build("lacks_act.so", "-DLACKS_ACT");
  testing::write_file(swing.folder / "text.so", "int main");
  refused("file: od.so", "there is no such file");
  fs::create_directories(swing.folder / "folder.so");
  fs::create_symlink("gone.so", swing.folder / "dangling.so");
  ASSERT_EQ(mkfifo((swing.folder / "fifo.so").c_str(), 0600), 0);
  refused("file: folder.so", "folder.so: not a file, but a folder");
  refused("file: fifo.so", "fifo.so: not a file, but a named pipe");
  refused("file: dangling.so", "dangling.so: is a symbolic link to 'gone.so', where nothing is");
  refused("file: no_symbol.so", "has no function graze_policy()");
  refused("file: other_version.so", "is made for version 99 of graze/policy.h, and this program has version 1");
  refused("file: lacks_act.so", "its table lacks: act");
  refused("file: text.so", "cannot be loaded");
  testing::write_file(swing.folder / "walk.py", "class Controller: pass\n");
  testing::write_file(swing.folder / "walk.c", "int main(void) { return 0; }\n");
#if defined(__x86_64__)
  std::string foreign = testing::read_file(swing.folder / "odd.so");
  foreign.at(18) = static_cast<char>(EM_AARCH64);
  testing::write_file(swing.folder / "foreign.so", foreign);
  refused("file: foreign.so", "foreign.so: cannot be loaded: it is made for 64-bit ARM, and this program for x86-64");
#endif
  refused("file: walk.py", "a controller in Python is python: {file: …} instead of library");
  refused("file: walk.c",
          "it is the source: compile it into a shared object, cc -O2 -ffp-contract=off -fPIC -shared -I FOLDER -o "
          "walk.so walk.c,");
  testing::write_file(swing.folder / "odd.c", "");  // newer
  fs::last_write_time(swing.folder / "odd.so", fs::last_write_time(swing.folder / "odd.c") - std::chrono::seconds(5));
  swing.odd("nothing");
  EXPECT_THAT(swing.graze("check swing.yaml").err, HasSubstr("odd.so is older than odd.c, of which it was built"));
  refused("file: odd.so, settings: {does: refuse}", "create() gave no controller: refused, as it was told");
  refused("file: odd.so, tmeout: 3 s", "timeout");
  refused("file: odd.so, timeout: 1e-300 s", "1e-300 s: must be from 0.001 s to 1e+07 s");
  swing.odd("crash_create");
  if (!GRAZE_SANITIZED) {  // which would be there first
    EXPECT_THAT(swing.graze("run swing.yaml --trust").err, HasSubstr("crashed (SIGSEGV) in create()"));
    swing.odd("refuse_and_crash");  // the call that asks for the reason is a call into it, too
    EXPECT_THAT(swing.graze("run swing.yaml --trust").err, HasSubstr("crashed (SIGSEGV) in create()"));
  }
  swing.write("file: odd.so", "operational_pd: {kp: 1, kd: 1}");
  EXPECT_THAT(swing.graze("run swing.yaml --trust").err, HasSubstr("use control: {joint_pd"));
}

// The dice are the particle's and the policy's, and nobody else's.
TEST(Library, SameBitsForAnyThreadsAndEitherIsolation) {
  const Swing swing;
  swing.odd("dice");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet --threads 1 -o one.graze").code, 0);
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet --threads 2 -o two.graze").code, 0);
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet --seed 2 -o other.graze").code, 0);
  ASSERT_EQ(swing.graze("check swing.yaml --determinism --trust").code, 0);
  swing.odd("dice", ", isolation: none");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet --threads 2 -o here.graze").code, 0);
  const auto one = outcomes(swing.folder / "one.graze");
  EXPECT_EQ(one.digest.size(), 24u);
  EXPECT_EQ(one.digest, outcomes(swing.folder / "two.graze").digest);
  EXPECT_EQ(one.digest, outcomes(swing.folder / "here.graze").digest);
  EXPECT_NE(one.digest, outcomes(swing.folder / "other.graze").digest);
  swing.odd("nothing");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -o still.graze").code, 0);
  EXPECT_NE(one.digest, outcomes(swing.folder / "still.graze").digest);
}

TEST(Library, ReplaysAndResumesTheSameLibraryAlone) {
  const Swing swing;
  swing.odd("exit");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -o whole.graze").code, 0);
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -n 8 -o part.graze").code, 0);
  EXPECT_EQ(swing.graze("resume part.graze -n 24").code, 2);  // trusts nobody
  ASSERT_EQ(swing.graze("resume part.graze -n 24 --trust --quiet").code, 0);
  const auto whole = outcomes(swing.folder / "whole.graze"), grown = outcomes(swing.folder / "part.graze");
  EXPECT_EQ(whole.digest, grown.digest);
  EXPECT_EQ(whole.invalid, grown.invalid);
  fs::copy(swing.folder / "part.graze", swing.folder / "less.graze", fs::copy_options::recursive);
  fs::remove(fs::directory_iterator(swing.folder / "less.graze" / "shards")->path());
  EXPECT_THAT(swing.graze("verify less.graze").out, HasSubstr("'graze resume less.graze --trust' mends it"));
  const std::string well = std::to_string(whole.digest.begin()->first),
                    ill = std::to_string(whole.invalid.begin()->first);
  for (const std::string& replay : {well + " --trust", ill + " --trust", well + " --trust -o well.csv"}) {
    const Result again = swing.graze("replay whole.graze --particle " + replay);
    EXPECT_EQ(again.code, 0) << replay << again.err;
  }
  EXPECT_THAT(swing.graze("replay whole.graze --particle " + well).err, HasSubstr("--trust"));
  // Pages run it with --trust alone, and then it is the same trace.
  const std::string page = " whole.graze --particle " + well + " --force -o page.html";
  ASSERT_EQ(swing.graze("view" + page).code, 0);
  EXPECT_THAT(testing::read_file(swing.folder / "page.html"), HasSubstr("runs for this page with --trust alone"));
  ASSERT_EQ(swing.graze("view --trust" + page).code, 0);
  EXPECT_THAT(testing::read_file(swing.folder / "page.html"), HasSubstr("\"identical\":true"));
  EXPECT_EQ(swing.graze("report whole.graze --trust -o report.html").code, 0);  // which has crashed traces
  swing.build("odd.so", "-DANOTHER -O0");
  for (const std::string& verb : {"replay whole.graze --particle " + well, std::string("resume part.graze -n 30")}) {
    const Result refused = swing.graze(verb + " --trust");
    EXPECT_EQ(refused.code, 2) << verb;
    EXPECT_THAT(refused.err, HasSubstr("is another library than the one that was meant: SHA-256"));
  }
}

// A misspelt key would make policies that do not differ, under names that say they do.
// Whatever has become of another policy's library, and without trust in it.
TEST(Library, OtherPoliciesAreReplayedWithoutIt) {
  const Swing swing;
  swing.odd("nothing");
  std::string text = testing::read_file(swing.folder / "swing.yaml");
  text.replace(text.find("policies:\n"), 10, "policies:\n  native: {hold: {}, control: {torque: {}}}\n");
  testing::write_file(swing.folder / "swing.yaml", text);
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -n 2 -o both.graze").code, 0);
  EXPECT_EQ(swing.graze("replay both.graze --particle 0 --policy native").code, 0);
  EXPECT_EQ(swing.graze("replay both.graze --particle 0 --policy still").code, 2);
  testing::write_file(swing.folder / "odd.so", testing::read_file(swing.folder / "odd.so") + "another");
  EXPECT_EQ(swing.graze("replay both.graze --particle 0 --policy native").code, 0);
  EXPECT_EQ(swing.graze("replay both.graze --particle 0 --policy still --trust").code, 2);
}

TEST(Library, WarnsOfValuesOverASettingThatIsNotThere) {
  const Swing swing;
  swing.write("file: odd.so, settings: {does: nothing, above: 0.22}",
              "torque: {}}, over: {library.settings.abov: [0.1, 0.2]");
  const Result check = swing.graze("check swing.yaml");
  EXPECT_EQ(check.code, 0) << check.err;
  EXPECT_THAT(check.out + check.err,
              AllOf(HasSubstr("abov is none of the settings that stand there (does, above, at swing.yaml:13:"),
                    HasSubstr("; did you mean above?; the controller gets it beside them")));
}

// Particles that cannot be made are made nowhere.
TEST(Library, ParticlesThatCannotBeFabricated) {
  const Swing swing;
  for (const char* isolation : {"process", "none"}) {
    swing.odd("dice", std::string(", isolation: ") + isolation);
    std::string text = testing::read_file(swing.folder / "swing.yaml");
    text.replace(text.find("{normal: {std: 2%}}"), 19, "{choice: [200, 1e-323]}");  // some balls have no mass
    testing::write_file(swing.folder / "swing.yaml", text);
    const std::string archive = std::string(isolation) + ".graze";
    ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -o " + archive).code, 0);
  }
  const auto apart = outcomes(swing.folder / "process.graze"), here = outcomes(swing.folder / "none.graze");
  EXPECT_GT(here.invalid.size(), 0u);
  EXPECT_GT(here.digest.size(), 0u);
  EXPECT_EQ(apart.invalid, here.invalid);
  EXPECT_EQ(apart.digest, here.digest);
}

TEST(Library, CheckFindsControllersThatBreakTheirPromise) {
  const Swing swing;
  for (const char* does : {"remember", "lane"}) {
    swing.odd(does);
    const Result check = swing.graze("check swing.yaml --determinism --trust");
    EXPECT_EQ(check.code, 1) << does;
    EXPECT_THAT(check.out, HasSubstr("ANOTHER WAY")) << does;
  }
  swing.odd("nothing");
  EXPECT_THAT(swing.graze("check swing.yaml --determinism --trust").out, HasSubstr("the same bits in any company"));
}

// Wrong indices, and what is not sensed, are told by the wrapper for C++.
TEST(Library, WrongIndicesInCppAreTold) {
  const testing::TemporaryFolder folder;
  ASSERT_EQ(testing::graze(folder.path(), "new policy-cpp walk").code, 0);
  const fs::path source = folder / "walk" / "my_controller.cpp";
  const std::string right = testing::read_file(source);
  for (const auto& [now, instead, told] :
       {std::tuple{"want_position(k, ", "want_position(k + 1, ", "want_position(12): there are 12 driven joints"},
        std::tuple{"robot.time()", "robot.base_rpy(3)", "base_rpy(3): there are 3 axes, counted from 0"},
        std::tuple{"robot.time()", "robot.velocity(0)", "not sensed; add GRAZE_READS_JOINT_VELOCITY to `reads`"}}) {
    std::string text = right;
    ASSERT_NE(text.find(now), std::string::npos) << now;
    text.replace(text.find(now), std::string(now).size(), instead);
    testing::write_file(source, text);
    ASSERT_EQ(testing::shell(folder / "walk", "make").code, 0);
    const Result check = testing::graze(folder / "walk", "check scenario.yaml --trust");
    EXPECT_EQ(check.code, 1) << instead;
    EXPECT_THAT(check.err, HasSubstr(told));
  }
}

// The template's law is `hold` with a joint_pd that is computed at the control steps: bit for bit.
TEST(Library, TemplatesWorkAndEqualTheNativeLaw) {
  const testing::TemporaryFolder folder;
  for (const std::string name : {"policy-c", "policy-cpp"}) {
    ASSERT_EQ(testing::graze(folder.path(), "new " + name + " " + name).code, 0);
    EXPECT_EQ(testing::graze(folder.path(), "new " + name + " " + name).code, 2);  // is there already
    EXPECT_THAT(testing::graze(folder / name, "check scenario.yaml").err,
                HasSubstr(std::string("make in ") + (folder / name).string() + " builds it from my_controller.c"));
    EXPECT_THAT(testing::graze(folder.path(), "check " + name).err,
                HasSubstr("not a file, but a folder; did you mean '" + name + "/scenario.yaml'?"));
    const Result made = testing::shell(folder / name, "make");
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_EQ(made.err, "");
    const Result run = testing::graze(folder / name, "run scenario.yaml --trust -n 8 --quiet");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(testing::digests(folder / name / "scenario.graze").at("mine").size(), 8u);
    EXPECT_EQ(testing::graze(folder / name, "check scenario.yaml --trust --determinism").code, 0);
    const Result misspelt =
        testing::graze(folder / name, "check scenario.yaml --trust --set policies.mine.library.settings.kpp=3");
    EXPECT_EQ(misspelt.code, 2) << misspelt.out;
    EXPECT_THAT(misspelt.err, HasSubstr("unknown setting 'kpp'; there are: "));
  }
  EXPECT_THAT(testing::graze(folder.path(), "new policy-c").err, HasSubstr("graze new policy-c my_controller"));
  EXPECT_THAT(testing::graze(folder.path(), "new my.yaml").err, HasSubstr("robot is required"));
  const fs::path native = folder / "policy-c" / "native.yaml";
  std::string text = testing::read_file(folder / "policy-c" / "scenario.yaml");
  const std::string mine = "library: {file: my_controller.so, settings: {kp: 20, kd: 0.1}}\n    control: {torque: {}}";
  ASSERT_NE(text.find(mine), std::string::npos);
  text.replace(text.find(mine), mine.size(), "hold: {}\n    control: {joint_pd: {kp: 20, kd: 0.1, implicit: false}}");
  testing::write_file(native, text);
  ASSERT_EQ(testing::graze(folder / "policy-c", "run native.yaml -n 8 --quiet").code, 0);
  EXPECT_EQ(testing::digests(folder / "policy-c" / "scenario.graze"),
            testing::digests(folder / "policy-c" / "native.graze"));
}

}  // namespace
}  // namespace graze
