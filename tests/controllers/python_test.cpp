// Claim: a controller in Python runs only if the user says so and is the one that was meant; it gives the bits of the
// same law of ours, for any number of threads, in a replay and after a resume; whatever it does, the campaign ends, the
// particle that it does it in is invalid and says so, and every other particle has the bits that it has without it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "engine/library/library_use.h"
#include "jobs/campaign/archived_scenario.h"
#include "simulation/simulation.h"
#include "tests/controllers/python_swing.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using testing::kInterpreter;
using ::testing::MatchesRegex;
using ::testing::Not;
using testing::Outcomes;
using testing::outcomes;
using testing::PythonSwing;
using testing::Result;

namespace fs = std::filesystem;

// Neither the controller nor a program that the scenario calls an interpreter.
TEST(Python, RunsNothingUnlessTrusted) {
  const PythonSwing swing;
  testing::write_file(swing.folder / "evil", "#!/bin/sh\ntouch '" + (swing.folder / "ran").string() + "'\n");
  fs::permissions(swing.folder / "evil", fs::perms::owner_all);
  swing.write("file: odd.py, class: Odd, settings: {does: nothing}", "./evil");
  EXPECT_EQ(swing.graze("check swing.yaml").code, 0);
  for (const char* verb : {"run swing.yaml", "check swing.yaml --determinism", "check swing.yaml --probe"}) {
    const Result refused = swing.graze(verb);
    EXPECT_GE(refused.code, 2) << verb;
    EXPECT_THAT(refused.err, HasSubstr("--trust")) << verb;
  }
  EXPECT_FALSE(fs::exists(swing.folder / "ran"));
  EXPECT_EQ(swing.graze("run swing.yaml --trust").code, 2);
  EXPECT_TRUE(fs::exists(swing.folder / "ran"));
}

TEST(Python, RefusesWhatCannotBeMade) {
  const PythonSwing swing;
  int asked_before = 0;
  const auto refused = [&](const std::string& python, const std::string& text,
                           const std::string& interpreter = kInterpreter) {
    swing.write(python, interpreter);
    const char* verb = ++asked_before % 3 == 1 ? "run" : "check";  // which makes it as well
    const Result asked = swing.graze(std::string(verb) + " swing.yaml --trust");
    EXPECT_EQ(asked.code, 2) << verb << python << asked.err;
    EXPECT_THAT(asked.err, HasSubstr("swing.yaml:13:")) << python;
    EXPECT_THAT(asked.err, HasSubstr(text));
    EXPECT_FALSE(fs::exists(swing.folder / "swing.graze")) << python;
  };
  testing::write_file(swing.folder / "broken.py", "def act(:\n");
  refused("file: od.py", "there is no such file that can be read; did you mean '");
  refused("file: .", "not a file, but a folder");
  refused("file: odd.py, class: Od",
          "odd.py has no class 'Od'; did you mean Odd? there are: Odd, Idle, Misreads, Forgetful, Unmade, Lonely, "
          "Seedless");
  refused("file: odd.py, class: Idle", "class Idle has no method act(self, observation, targets)");
  refused("file: odd.py, class: Forgetful",
          "class Forgetful has act(self, observation), and act(self, observation, targets) is wanted");
  refused("file: odd.py, class: Lonely",
          "class Lonely has __init__(self, robot), and __init__(self, robot, settings) is wanted");
  refused("file: odd.py, class: Seedless",
          "class Seedless has reset(self, lanes), and reset(self, lanes, seeds) is wanted");
  refused("file: odd.py, class: Misreads", "reads: there is no 'joint_positions'; did you mean joint_position?");
  refused("file: odd.py, class: Odd, settings: {does: refuse}",
          "odd.py: __init__() raised ValueError: refused, as it was told (odd.py:");
  refused("file: odd.py, class: Odd, files: [od.npz]", "od.npz: there is no such file that can be read");
  refused("file: broken.py", "broken.py: loading it raised SyntaxError: invalid syntax (broken.py:1)");
  testing::write_file(swing.folder / "lost.py", "\nimport no_such_module_anywhere\n");
  refused("file: lost.py",
          "lost.py: loading it raised ModuleNotFoundError: No module named 'no_such_module_anywhere' (lost.py:2)");
  const std::pair<const char*, const char*> asked[] = {
      {"settings['kpp']", "KeyError: the settings have no 'kpp'; did you mean kp? there are: kp"},
      {"robot.joints", "AttributeError: the robot has no 'joints'; did you mean joint_names?"},
      {"robot.joint_names.index('hing')",
       "ValueError: the robot has no driven joint 'hing'; did you mean hinge? there are: hinge"}};
  for (const auto& [what, text] : asked) {
    testing::write_file(swing.folder / "asks.py",
                        std::string("class Asks:\n  def __init__(self, robot, settings):\n    ") + what +
                            "\n  def act(self, seen, targets):\n    pass\n");
    refused("file: asks.py, class: Asks, settings: {kp: 1}", std::string("__init__() raised ") + text);
  }
  refused("file: odd.py, class: Odd, settings: [1, 2]", "settings: must be a map");
  refused("file: odd.py, class: Odd, settings: 3", "settings: must be a map");
  refused("file: odd.py, class: Odd", "interpreter 'pyton3' cannot be started: No such file or directory", "pyton3");
}

// Where it stands in the scenario; and what loads is no mistake.
TEST(Python, CheckPointsAtWhatIsWrong) {
  const PythonSwing swing;
  const auto refused_at = [&](const std::string& value, const std::string& python, const std::string& interpreter) {
    swing.write(python, interpreter);
    EXPECT_EQ(swing.graze("check swing.yaml").code, 0) << "nothing is loaded";
    const Result check = swing.graze("check swing.yaml --trust");
    EXPECT_EQ(check.code, 2) << python;
    const std::string text = testing::read_file(swing.folder / "swing.yaml");
    const std::size_t at = text.find(value);
    EXPECT_THAT(check.err, HasSubstr(fmt::format("swing.yaml:13:{}:", at - text.rfind('\n', at)))) << check.err;
  };
  refused_at("Clas,", "file: odd.py, class: Clas", kInterpreter);
  refused_at("pyton3", "file: odd.py, class: Odd", "pyton3");
  refused_at("odd.py", "file: odd.py", kInterpreter);  // has no class Controller
  refused_at("odd.py", "file: odd.py, class: Odd, settings: {does: refuse}", kInterpreter);
  swing.odd("nothing");
  EXPECT_EQ(swing.graze("check swing.yaml --trust").code, 0);
}

TEST(Python, SameBitsForAnyThreadsAndEitherIsolation) {
  const PythonSwing swing;
  swing.odd("dice");
  const Outcomes one = swing.run("one", "--threads 1 -n 16");
  EXPECT_EQ(one.digest.size(), 16u);
  EXPECT_EQ(one.digest, swing.run("two", "--threads 2 -n 16").digest);
  EXPECT_NE(one.digest, swing.run("other", "--seed 2 -n 16").digest);
  EXPECT_EQ(swing.graze("check swing.yaml --determinism --trust").code, 0);
  swing.odd("dice", ", isolation: none");
  EXPECT_EQ(one.digest, swing.run("here", "-n 16").digest);
  swing.odd("remember");
  const Result broken = swing.graze("check swing.yaml --determinism --trust");
  EXPECT_EQ(broken.code, 1);
  EXPECT_THAT(broken.out, HasSubstr("ANOTHER WAY"));
}

TEST(Python, EachFaultCostsItsParticleAlone) {
  const PythonSwing swing;
  swing.odd("nothing");
  const Outcomes well = swing.run("well");
  ASSERT_EQ(well.digest.size(), 8u);
  swing.odd("strata", ", timeout: 3 s");  // a busy machine takes its time
  const Result run = swing.graze("run swing.yaml --trust --quiet --threads 1 -o ill.graze");
  EXPECT_EQ(run.code, 3) << "who hangs is left unfinished: " << run.err;
  EXPECT_THAT(run.err, HasSubstr("odd.py: the controller's act() at 0.01 s did not come back within 3 s"));
  EXPECT_EQ(swing.graze("score ill.graze --require 'ci < 0.001'").code, 3) << "the missing one may answer it";
  const Outcomes ill = outcomes(swing.folder / "ill.graze");
  EXPECT_EQ(ill.digest.size(), 2u);
  for (const auto& [id, digest] : ill.digest) EXPECT_EQ(digest, well.digest.at(id)) << id;
  std::vector<std::string> reasons;
  for (const auto& [id, reason] : ill.invalid) {
    reasons.push_back(reason);
    EXPECT_THAT(run.err, HasSubstr("particle " + std::to_string(id) + ": odd.py: "));
  }
  EXPECT_THAT(reasons,
              ::testing::UnorderedElementsAre(
                  MatchesRegex("odd.py: act\\(\\) at 0.01 s raised RuntimeError: no fingers left \\(odd.py:[0-9]+\\)"),
                  MatchesRegex("odd.py: act\\(\\) at 0.01 s raised SystemExit: 3 .*"),
                  "odd.py: the controller ended its process with exit code 5 in act() at 0.01 s",
                  "odd.py: the controller crashed (SIGSEGV) in act() at 0.01 s",
                  "odd.py: act() at 0.01 s asks joint hinge for a velocity of nan, which is no finite number"));
  // Printed beside: what it said itself, and where it raised, crashed or hung.
  for (const char* text : {"it printed:\n  my gripper is on fire\n  Traceback", "in err\n    raise RuntimeError",
                           "Fatal Python error: Segmentation fault", "odd.py\", line"}) {
    EXPECT_THAT(run.err, HasSubstr(text));
  }
}

// What fails in each trace is found before a campaign is.
TEST(Python, CheckSimulatesOneTrace) {
  const PythonSwing swing;
  const auto expect = [&](const char* does, int code, const char* text) {
    swing.odd(does);
    const Result check = swing.graze("check swing.yaml --trust -n 4");
    EXPECT_EQ(check.code, code) << does << check.err;
    EXPECT_THAT(check.err, HasSubstr(text)) << does;
    EXPECT_THAT(check.out, HasSubstr("archive")) << does;
  };
  expect("nothing", 0, "");
  expect("nothing", 0, "policy still, particle 0: unknown failure: the objective is missed, its margin is -");
  expect("limp", 0, "policy still, particle 0: all torques are 0 from beginning to end: the robot is limp");
  expect("raise", 1, "policy still, particle 0: odd.py: act() at 0.01 s raised RuntimeError");
  expect("killed", 3, "its trace would be left unfinished");
  std::string weak = testing::kSwingUrdf;
  weak.replace(weak.find("</joint>"), 0, "<limit effort=\"0.001\" velocity=\"100\"/>");
  testing::write_file(swing.folder / "swing.urdf", weak);
  expect("nothing", 0, "policy still, particle 0: the torque of a joint (hinge) is at its limit nearly all the time");
}

TEST(Python, SettingsThatStandNowhereInTheFileAreDoubted) {
  const PythonSwing swing;
  swing.odd("nothing");
  const std::string check = "check swing.yaml --set policies.still.python.settings.";
  EXPECT_THAT(swing.graze(check + "dos=limp").err,
              AllOf(HasSubstr("dos is none of the settings that stand there (does, at swing.yaml:13:"),
                    HasSubstr("did you mean does?")));
  EXPECT_EQ(swing.graze(check + "does=limp").err, "");
  EXPECT_THAT(swing
                  .graze("sweep swing.yaml --trust --quiet -n 1 -o a.sweep --over "
                         "policies.still.python.settings.dos=limp,nothing")
                  .err,
              HasSubstr("--over policies.still.python.settings.dos: dos is none of the settings that stand there"));
}

TEST(Python, ChangedRoundingCostsItsParticleAlone) {
  const PythonSwing swing;
  swing.odd("rounding");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -n 2 -o ill.graze").code, 0);
  const Outcomes ill = outcomes(swing.folder / "ill.graze");
  EXPECT_EQ(ill.invalid.size(), 2u);
  for (const auto& [id, why] : ill.invalid) EXPECT_THAT(why, HasSubstr("changed the floating-point environment")) << id;
}

// Somebody has ended it, or the system had no memory: nobody says that it happens again.
TEST(Python, KilledInterpreterLeavesItsParticleUnfinished) {
  const PythonSwing swing;
  swing.odd("killed");
  const Result run = swing.graze("run swing.yaml --trust --quiet -n 1 -o ill.graze");
  EXPECT_EQ(run.code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("odd.py: the controller was killed (SIGKILL), by somebody"));
  EXPECT_TRUE(outcomes(swing.folder / "ill.graze").invalid.empty());
}

// What a command prints to be pasted is accepted as it stands.
TEST(Python, PrintedCommandsSayThatTheControllerIsTrusted) {
  const PythonSwing swing;
  swing.odd("raise");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -n 2 -o a.graze").code, 0);
  const std::string text = swing.graze("score a.graze --failures --junit a.xml").out;
  std::size_t commands = 0;
  for (std::size_t at = text.find("graze replay "); at != std::string::npos; at = text.find("graze replay ", at + 1)) {
    const std::string command = text.substr(at + 6, text.find('\n', at) - at - 6);
    EXPECT_THAT(command, ::testing::EndsWith(" --trust"));
    if (++commands == 1) {
      EXPECT_EQ(swing.graze(command).code, 0) << command;
    }
  }
  EXPECT_EQ(commands, 2u) << text;  // of each trace
  EXPECT_THAT(testing::read_file(swing.folder / "a.xml"), HasSubstr(" --trust"));
  EXPECT_THAT(swing.graze("score a.graze --json").out, HasSubstr(" --trust\""));
}

// A policy that has never worked has passed nothing, and nothing of it was compared.
TEST(Python, NothingValidIsNoSuccess) {
  const PythonSwing swing;
  swing.odd("raise");
  const Result check = swing.graze("check swing.yaml --determinism --trust -n 2");
  EXPECT_EQ(check.code, 1);
  EXPECT_THAT(check.out, AllOf(HasSubstr("NOTHING was compared"), Not(HasSubstr("the same bits"))));
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -n 2 -o a.graze").code, 0);
  const Result gate = swing.graze("score a.graze --require 'p >= 0.5' --junit a.xml");
  EXPECT_NE(gate.code, 0);
  EXPECT_THAT(gate.out, HasSubstr("NOT KNOWN: policy still has no valid trace, all 2 are invalid"));
  EXPECT_THAT(testing::read_file(swing.folder / "a.xml"),
              AllOf(HasSubstr("policy still has no valid trace"), HasSubstr("errors=\"1\""),
                    Not(HasSubstr("name=\"objective\""))));
}

// The robots are simulated again one by one, then each in the first lane, and come out well.
TEST(Python, FaultsOfALaneAreToldThoughNoRobotFails) {
  const PythonSwing swing;
  struct Case {
    const char *does, *what;
    std::size_t particles;  // an interpreter starts for each; the third lane of a block is the one
    const char* blocks;
  };
  for (const auto& [does, what, particles, blocks] :
       {Case{"lane", "raised RuntimeError: this lane is not liked", 11, "2 blocks of robots"},
        Case{"lane_nan", "asks joint hinge for a velocity of nan", 3, "a block of robots"}}) {
    swing.odd(does);
    const Result run = swing.graze(fmt::format("run swing.yaml --trust --quiet -n {} -o {}.graze", particles, does));
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(run.err,
                AllOf(HasSubstr(fmt::format("policy still: {} beside each other failed (odd.py: act() at ", blocks)),
                      HasSubstr(what), HasSubstr("graze check SCENARIO --determinism")));
    EXPECT_EQ(outcomes(swing.folder / (std::string(does) + ".graze")).digest.size(), particles);
    const Result check = swing.graze("check swing.yaml --determinism --trust -n 3");
    EXPECT_EQ(check.code, 1);
    EXPECT_THAT(check.out, AllOf(HasSubstr("FAILED although its robots do not"), HasSubstr(what)));
  }
  swing.odd("raise");  // each robot's own
  EXPECT_THAT(swing.graze("run swing.yaml --trust --quiet -n 2 -o own.graze").err,
              Not(HasSubstr("beside each other failed")));
}

// What is not sensed is no NaN that a controller would reckon with.
TEST(Python, MistakesWithArraysSayWhatIsWanted) {
  const PythonSwing swing;
  const auto reason = [&](const std::string& does) {
    swing.odd(does);
    const Outcomes ill = swing.run(does, "-n 1");
    return ill.invalid.empty() ? "" : ill.invalid.begin()->second;
  };
  EXPECT_THAT(reason("look"),
              HasSubstr("observation.base_rpy is not sensed, since the class's reads = ('joint_position', "
                        "'base_position') does not name it; add 'base_rpy' to reads"));
  EXPECT_THAT(reason("shape"),
              AllOf(HasSubstr("into shape (1,8)"), HasSubstr("[quantity, lane]"), HasSubstr("shape (3,)")));
  for (const char* does : {"complex", "complex_in_place", "text", "none"}) {
    EXPECT_THAT(reason(does),
                AnyOf(HasSubstr("TypeError: targets.position takes real numbers, and this is an array of shape"),
                      HasSubstr("ComplexWarning: Casting complex values")))
        << does;
  }
}

// The other interpreter that has what is missing is named.
TEST(Python, InterpreterWithoutNumPyIsToldFrom) {
  const PythonSwing swing;
  std::filesystem::create_directories(swing.folder / "bare/bin");
  testing::write_file(swing.folder / "bare/bin/python3", "#!/bin/bash\nexec -a \"$0\" /usr/bin/python3 -S \"$@\"\n");
  ASSERT_EQ(testing::shell(swing.folder.path(), "chmod +x bare/bin/python3").code, 0);
  swing.write("file: odd.py, class: Odd, settings: {does: nothing}", "python3");
  const Result check = testing::shell(
      swing.folder.path(), fmt::format("PATH=\"$PWD/bare/bin:$PATH\" '{}' check swing.yaml --trust", GRAZE_PROGRAM));
  EXPECT_EQ(check.code, 2);
  EXPECT_THAT(check.err,
              AllOf(HasSubstr("bare/bin/python3) has no NumPy"), HasSubstr("interpreter: /usr/bin/python3")));
}

// A copy that returns from the call would answer in the controller's place.
TEST(Python, CopiesAndStrangersDoNotAnswer) {
  const PythonSwing swing;
  swing.odd("nothing");
  const Outcomes well = swing.run("well");
  swing.odd("copy");
  EXPECT_EQ(swing.run("copies", "--threads 1").digest, well.digest);
  for (const auto& [does, text] : {std::pair{"answer",
                                             "odd.py: act() at 0.01 s wrote into the socket that Graze "
                                             "listens to"},
                                   std::pair{"return",
                                             "odd.py: act() at 0 s raised TypeError: act() returned an array of shape "
                                             "(8,); it returns nothing, and fills targets.position, targets.velocity "
                                             "or targets.torque instead"},
                                   std::pair{"library", "raised numpy.linalg.LinAlgError: Singular matrix (odd.py:"},
                                   std::pair{"umlaut", "raised ValueError: Gelenk über Grenze (odd.py:"}}) {
    swing.odd(does);
    const Outcomes ill = swing.run(does, "--threads 1 -n 2");
    EXPECT_EQ(ill.invalid.size(), 2u);
    for (const auto& [id, reason] : ill.invalid) EXPECT_THAT(reason, HasSubstr(text)) << id;
  }
}

// Whoever starts the program may ignore SIGCHLD, and children then vanish when they end.
TEST(Python, IgnoredSignalsOfChildrenHideNothing) {
  const PythonSwing swing;
  const auto run = [&](const std::string& name) {
    return testing::shell(
        swing.folder.path(),
        fmt::format("trap '' CHLD; exec '{}' run swing.yaml --trust --quiet -n 2 -o {}.graze", GRAZE_PROGRAM, name));
  };
  swing.odd("nothing");
  const Result well = run("well");
  EXPECT_EQ(well.code, 0);
  EXPECT_EQ(well.err, "") << "they end in order";
  for (const char* isolation : {"process", "none"}) {
    swing.odd("segfault", std::string(", isolation: ") + isolation);
    EXPECT_EQ(run(isolation).code, 0);
    const Outcomes ill = outcomes(swing.folder / (std::string(isolation) + ".graze"));
    EXPECT_EQ(ill.invalid.size(), 2u);
    for (const auto& [id, reason] : ill.invalid) {
      EXPECT_EQ(reason, "odd.py: the controller crashed (SIGSEGV) in act() at 0.01 s") << id;
    }
  }
}

// A helper that a controller starts is ended by SIGTERM, as anywhere.
TEST(Python, HelpersOfControllersCanBeEnded) {
  const PythonSwing swing;
  swing.odd("terminate");
  EXPECT_TRUE(swing.run("terminate", "-n 1").invalid.empty());
}

// The same in a program that calls the simulator itself: what a controller starts is its own matter.
TEST(Python, ChildrenOfControllersEndAsTheyEnd) {
  const PythonSwing swing;
  swing.odd("child");
  allow_libraries(LibraryLoading::all);
  brief_libraries(testing::kSwingUrdf);
  struct sigaction ignored {
  }, before{};
  ignored.sa_handler = SIG_IGN;
  ASSERT_EQ(sigaction(SIGCHLD, &ignored, &before), 0);
  const Simulation simulation(load_scenario((swing.folder / "swing.yaml").string()));
  const std::vector<TraceRecord> traces = Simulator(simulation, "still").run(0, 1);
  sigaction(SIGCHLD, &before, nullptr);
  allow_libraries(LibraryLoading::refused);
  EXPECT_EQ(traces.front().invalid_reason, "");
  EXPECT_NE(traces.front().outcome, Outcome::invalid);
}

// Its traceback stands once among the messages, however many robots it fails.
TEST(Python, TellsEqualFaultsOnce) {
  const PythonSwing swing;
  swing.odd("raise");
  const Result run = swing.graze("run swing.yaml --trust --quiet -o ill.graze");
  const auto count = [&](const std::string& text) {
    int n = 0;
    for (std::size_t at = run.err.find(text); at != std::string::npos; at = run.err.find(text, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(outcomes(swing.folder / "ill.graze").invalid.size(), 8u);
  EXPECT_EQ(count("Traceback"), 1) << run.err;
  EXPECT_EQ(count("the same in 7 more traces (particles "), 1) << run.err;
}

// What stands in the folder that one happens to be in is not imported in place of Python's own.
TEST(Python, ImportsNothingFromTheFolderItIsStartedIn) {
  const PythonSwing swing;
  swing.odd("nothing");
  for (const char* name : {"json.py", "numpy.py", "signal.py", "platform.py"}) {
    testing::write_file(swing.folder / name, "raise RuntimeError('not me')\n");
  }
  EXPECT_EQ(swing.run("well").digest.size(), 8u);
}

TEST(Python, FewDescriptorsAreTheMachinesMatter) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "sanitizers have descriptors of their own";
  const PythonSwing swing;
  swing.odd("nothing");
  for (const int most : {9, 12, 14, 16, 20, 24, 32}) {
    const Result run = testing::shell(
        swing.folder.path(), fmt::format("ulimit -n {}; exec '{}' run swing.yaml --trust --quiet -n 2 -o {}.graze",
                                         most, GRAZE_PROGRAM, most));
    EXPECT_TRUE(run.code == 0 || run.code == 3) << most << ": " << run.code << run.err;
    EXPECT_THAT(run.err, ::testing::Not(HasSubstr("exit code 1"))) << most;
    if (run.code != 3) continue;
    EXPECT_THAT(run.err, HasSubstr("oo many open files")) << most;
  }
}

TEST(Python, ReplaysAndResumesTheSameFilesAlone) {
  const PythonSwing swing;
  testing::write_file(swing.folder / "weights.npz", "1 2 3");
  swing.odd("dice", ", files: [weights.npz]");
  const Outcomes whole = swing.run("whole", "-n 16 --set sampling.design=random");
  swing.run("part", "-n 8 --set sampling.design=random");
  EXPECT_EQ(swing.graze("resume part.graze -n 16").code, 2);  // trusts nobody
  ASSERT_EQ(swing.graze("resume part.graze -n 16 --trust --quiet").code, 0);
  EXPECT_EQ(whole.digest, outcomes(swing.folder / "part.graze").digest);
  for (const char* more : {"", " -o one.csv"}) {  // in a process of its own, and in the program
    const Result again = swing.graze("replay whole.graze --particle 3 --trust" + std::string(more));
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(again.err, "");
  }
  {
    const std::string path = (swing.folder / "whole.graze").string();
    const ArchivedScenario archived(path, Archive(path).info(), "");
    const auto use = library_use(archived.scenario().policies.front().settings);
    EXPECT_THAT(use.value().environment, MatchesRegex("Python 3\\.[0-9.]+, NumPy [0-9.]+"));
  }
  testing::write_file(swing.folder / "weights.npz", "1 2 4");
  const Result other = swing.graze("replay whole.graze --particle 3 --trust");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("weights.npz: is another file than the one that was meant: SHA-256"));
  testing::write_file(swing.folder / "weights.npz", "1 2 3");
  const std::string text = testing::read_file(swing.folder / "odd.py");
  testing::write_file(swing.folder / "odd.py", text + "\n");
  for (const char* verb : {"replay whole.graze --particle 3", "resume part.graze -n 24"}) {
    const Result refused = swing.graze(std::string(verb) + " --trust");
    EXPECT_EQ(refused.code, 2) << verb;
    EXPECT_THAT(refused.err, HasSubstr("is another controller than the one that was meant: SHA-256"));
  }
}

// The template's law is `hold` with a joint_pd that is computed at the control steps: bit for bit.
TEST(Python, TemplateWorksAndEqualsTheNativeLaw) {
  const testing::TemporaryFolder folder;
  ASSERT_EQ(testing::graze(folder.path(), "new policy-python mine").code, 0);
  EXPECT_EQ(testing::graze(folder.path(), "new policy-python mine").code, 2);  // is there already
  EXPECT_THAT(testing::graze(folder.path(), "new policy-pyton other").err, HasSubstr("did you mean policy-python?"));
  const fs::path mine = folder / "mine";
  std::string text = testing::read_file(mine / "scenario.yaml");
  const std::string file = "file: my_controller.py, settings: {kp: 20, kd: 0.1}}\n    control: {torque: {}}";
  ASSERT_NE(text.find(file), std::string::npos);
  const std::string policy = "python: {" + file;
  testing::write_file(mine / "scenario.yaml",
                      std::string(text).replace(text.find(file), 4, "interpreter: " + kInterpreter + ", file"));
  testing::write_file(mine / "native.yaml",
                      text.replace(text.find(policy), policy.size(),
                                   "hold: {}\n    control: {joint_pd: {kp: 20, kd: 0.1, implicit: false}}"));
  const Result run = testing::graze(mine, "run scenario.yaml --trust -n 12 --quiet --set time.end='0.5 s'");
  ASSERT_EQ(run.code, 0) << run.err;
  ASSERT_EQ(testing::graze(mine, "run native.yaml -n 12 --quiet --set time.end='0.5 s'").code, 0);
  EXPECT_EQ(testing::digests(mine / "scenario.graze").at("mine").size(), 12u);
  EXPECT_EQ(testing::digests(mine / "scenario.graze"), testing::digests(mine / "native.graze"));
}

}  // namespace
}  // namespace graze
