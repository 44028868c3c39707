// Claim: a vector of joints that lacks its [:, None] is an error on every robot, also on one with as many joints as a
// block has lanes; an interpreter that somebody kills before it is ready is started again, and one that does not listen
// is not waited for.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "engine/lanes/block.h"
#include "tests/controllers/python_swing.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using testing::Outcomes;
using testing::outcomes;
using testing::PythonSwing;
using testing::Result;

/// The ball with this many rods, and a controller whose act() has this body.
void write_rods(const PythonSwing& swing, int rods, const std::string& act, const std::string& before = "") {
  std::string urdf = R"(<robot name="swing"><link name="ball"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>)";
  for (int i = 0; i < rods; ++i) {
    urdf += fmt::format(R"(<link name="rod{0}"><inertial><mass value="0.1"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
      <joint name="hinge{0}" type="continuous"><parent link="ball"/><child link="rod{0}"/><axis xyz="0 1 0"/></joint>)",
                        i);
  }
  testing::write_file(swing.folder / "swing.urdf", urdf + "</robot>");
  testing::write_file(swing.folder / "mine.py", before +
                                                    "import numpy\n"
                                                    "class Mine:\n"
                                                    "  def __init__(self, robot, settings):\n"
                                                    "    self.robot = robot\n"
                                                    "    self.gains = numpy.arange(len(robot.joint_names)) / 100\n"
                                                    "  def act(self, observation, targets):\n"
                                                    "    " +
                                                    act + "\n");
  swing.write("file: mine.py, class: Mine");
}

// What Python says of them is of no use: "source code string cannot contain null bytes".
TEST(PythonStart, OtherControllersAreToldWhereTheyBelong) {
  const PythonSwing swing;
  for (const auto& [file, what] : {std::pair("a.so", "a shared object is policy `library: {file: …}`"),
                                   std::pair("a.c", "build it, and name the .so under `library: {file: …}`"),
                                   std::pair("a.onnx", "a network is policy `network: {file: …}`")}) {
    testing::write_file(swing.folder / file, "\x7f");
    swing.write(std::string("file: ") + file);
    const Result check = swing.graze("check swing.yaml");
    EXPECT_EQ(check.code, 2) << file;
    EXPECT_THAT(check.err, HasSubstr(std::string(file) + ": is no Python file; " + what));
  }
}

constexpr const char* kRight = "targets.torque = self.gains[:, None] * (1 - observation.joint_position)";

// With eight lanes NumPy would give each robot the gain that is meant for a joint.
TEST(PythonStart, ForgottenAxesAreErrorsOnEveryRobot) {
  const PythonSwing swing;
  for (const int rods : {kLanes - 1, kLanes, kLanes + 1}) {
    for (const char* act : {"targets.torque = self.gains * (1 - observation.joint_position)",
                            "targets.torque = self.gains", "targets.torque[:] = self.gains"}) {
      write_rods(swing, rods, act);
      const Result check = swing.graze("check swing.yaml --trust");
      EXPECT_EQ(check.code, 1) << rods << " joints: " << act << check.err;
      EXPECT_THAT(check.err, HasSubstr("[:, None] behind it")) << rods << " joints: " << act;
    }
  }
}

// The lane more is nobody's: particles are those of a robot that has it not, and act() sees that it does not act.
TEST(PythonStart, EightJointsActAsTheyAre) {
  const PythonSwing swing;
  write_rods(swing, kLanes,
             std::string("assert self.robot.lanes == 9 == observation.time.size; ") +
                 "assert not observation.active[8]; " + kRight);
  const Outcomes whole = swing.run("whole");
  EXPECT_TRUE(whole.invalid.empty());
  write_rods(swing, kLanes,
             "for lane in range(8): targets.torque[:, lane] = self.gains * (1 - observation.joint_position[:, lane])");
  EXPECT_EQ(swing.run("each").digest, whole.digest);
  const Result promise = swing.graze("check swing.yaml --trust --determinism");
  EXPECT_EQ(promise.code, 0) << promise.err;
}

TEST(PythonStart, InterpretersThatAreKilledWhileTheyLoadAreStartedAgain) {
  const PythonSwing swing;
  const auto killed = [](int times) {
    return fmt::format(
        "import os, signal\n"
        "told = os.path.join(os.path.dirname(__file__), 'starts')\n"
        "open(told, 'a').write('x')\n"
        "if os.path.getsize(told) <= {}: os.kill(os.getpid(), signal.SIGKILL)\n",
        times);
  };
  write_rods(swing, 1, kRight, killed(2));
  const Result again = swing.graze("check swing.yaml --trust");
  EXPECT_EQ(again.code, 0) << again.err;
  std::filesystem::remove(swing.folder / "starts");
  write_rods(swing, 1, kRight, killed(1000));
  const Result never = swing.graze("check swing.yaml --trust");
  EXPECT_EQ(never.code, 2);
  EXPECT_THAT(never.err, HasSubstr("the controller was killed (SIGKILL)"));
  EXPECT_EQ(std::filesystem::file_size(swing.folder / "starts"), 3u);
}

TEST(PythonStart, AClassNeedsNothingButAct) {
  const PythonSwing swing;
  swing.write("file: odd.py, class: Unmade");
  const Result check = swing.graze("check swing.yaml --trust");
  EXPECT_EQ(check.code, 0) << check.err;
}

// What an interpreter is told may be longer than a socket holds. One that does not listen is waited for as long as any
// that is loading, a minute more than `timeout`; one that does not even tell its version, no longer than that.
TEST(PythonStart, InterpreterThatDoesNotListenIsNotWaitedFor) {
  if (std::getenv("GRAZE_LONG") == nullptr) GTEST_SKIP() << "two minutes; tests/run --long";
  const PythonSwing swing;
  testing::write_file(swing.folder / "deaf",
                      "#!/bin/sh\ncase \"$2\" in *platform*) exec python3 \"$@\";; esac\nexec sleep 1000\n");
  testing::write_file(swing.folder / "silent", "#!/bin/sh\nexec sleep 1000\n");
  ASSERT_EQ(testing::shell(swing.folder.path(), "chmod +x deaf silent").code, 0);
  std::string numbers = "0";
  for (int i = 0; i < 300'000; ++i) numbers += ", 0";
  swing.write("file: odd.py, class: Odd, timeout: 1 s, settings: {does: nothing, n: [" + numbers + "]}", "./deaf");
  const Result deaf = swing.graze("check swing.yaml --trust");
  EXPECT_EQ(deaf.code, 2);
  EXPECT_THAT(deaf.err, HasSubstr("did not come back within 61 s"));
  swing.write("file: odd.py, class: Odd, settings: {does: nothing}", "./silent");
  const Result silent = swing.graze("check swing.yaml --trust");
  EXPECT_EQ(silent.code, 2);
  EXPECT_THAT(silent.err, HasSubstr("/silent' did not tell its version within 60 s"));
}

}  // namespace
}  // namespace graze
