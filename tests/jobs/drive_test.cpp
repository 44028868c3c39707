// Claim: `graze drive` does what keys say; the commands that it writes make the same trace again, bit for bit, by
// itself and in a campaign; a gait that particles fall by is refused; the terminal is put back whatever ends the drive.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <cstdlib>

#include "jobs/cli/drive_keys.h"
#include "tests/jobs/process.h"
#include "tests/jobs/traces.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DriveKeys, AreDecodedAsTheyCome) {
  std::string bytes = "w\x1b[A\x1bOD\x1b[1;5C x1\x1b";
  EXPECT_THAT(decode_keys(bytes), ElementsAre("up", "up", "left", "right", "space", "1"));
  EXPECT_EQ(bytes, "\x1b") << "the rest of an arrow may be on its way";
  bytes += "[B";
  EXPECT_THAT(decode_keys(bytes), ElementsAre("down"));
}

TEST(DriveKeys, SteerAsACarDoes) {
  DriveWheel wheel;
  for (const char* key : {"up", "up", "up", "left", ","}) EXPECT_TRUE(wheel.press(key));
  EXPECT_EQ(wheel.forward(), 0.15);
  EXPECT_EQ(wheel.strafe(), 0.05);
  EXPECT_EQ(wheel.turn(), 0.1);
  for (const char* key : {"c", "left"}) wheel.press(key);
  EXPECT_FALSE(wheel.press(",")) << "a car does not strafe";
  EXPECT_EQ(wheel.strafe(), 0);
  EXPECT_EQ(wheel.turn(), 0.5 * 0.15) << "0.5/m of curvature";
  wheel.press("down");
  EXPECT_EQ(wheel.turn(), 0.5 * 0.1);
  wheel.press("space");
  EXPECT_EQ(wheel.turn(), 0) << "a car that stands does not turn";
}

struct Drive : ::testing::Test {
  Drive() : scenario("'" + testing::data("scenarios/quadruped_drive.yaml") + "'") {}
  testing::Result drive(const std::string& options) const {
    return testing::graze(folder.path(), "drive " + scenario + " " + options);
  }
  /// "digest 0123456789abcdef"
  static std::string digest(const std::string& out) {
    const std::size_t at = out.find("digest ");
    return at == std::string::npos ? "none in: " + out : out.substr(at, 23);
  }
  testing::TemporaryFolder folder;
  const std::string scenario;
};

// Before the drive, not behind it.
TEST_F(Drive, RefusesFirstWhereNothingCanBeRecorded) {
  testing::write_file(folder / "keys",
                      "\xEF\xBB\xBF"
                      "0 up\n0.1 q\n");
  testing::write_file(folder / "no-folder", "");
  const testing::Result none = drive("--keys keys --record no-folder/way.csv --trial 0");
  EXPECT_EQ(none.code, 3);
  EXPECT_THAT(none.err, HasSubstr("no-folder"));
  EXPECT_EQ(none.out, "");
  testing::write_file(folder / "way.csv", "mine");
  const testing::Result taken = drive("--keys keys --record way.csv --trial 0");
  EXPECT_EQ(taken.code, 2);
  EXPECT_THAT(taken.err, ::testing::Not(HasSubstr("--output")));
  EXPECT_EQ(testing::read_file(folder / "way.csv"), "mine");
}

// Under particle 3, whose sensors err.
TEST_F(Drive, IsTheSameAgain) {
  testing::write_file(folder / "keys", "0 up\n0 up # 10 cm/s\n0.4 left\n0.9 space\n1 q\n");
  const testing::Result first =
      drive("--particle 3 --keys keys --record new/way.csv --set policies.holonomic=~ --trial 0");
  EXPECT_EQ(first.code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("1 s under walk"));
  const std::string commands = testing::read_file(folder / "new/way.csv");
  EXPECT_THAT(commands, HasSubstr("time,forward,strafe,turn,policy\n0,0.1,0,0,walk\n0.4,0.1,0,0.1,walk\n"));
  const testing::Result again = drive("--particle 3 --replay new/way.csv --set policies.holonomic=~ --set time.end=1");
  EXPECT_EQ(digest(first.out), digest(again.out)) << again.err;
}

TEST_F(Drive, PrintsTheCommandThatDoesItAgain) {
  testing::write_file(folder / "keys", "0 up\n0.1 q\n");
  const testing::Result first = drive(
      "--seed 7 --particle 2 --keys keys --record way.csv --trial 0 --set contact.model=compliant --set "
      "'policies.walk.gait.step_height=5 cm' --set time.end='3 s'");
  ASSERT_EQ(first.code, 0) << first.err;
  const std::string options =
      " --set contact.model=compliant --set 'policies.walk.gait.step_height=5 cm' --set time.end=0.1 --seed 7";
  EXPECT_THAT(first.out, HasSubstr("--replay way.csv" + options + " --particle 2\n"));
  EXPECT_THAT(first.out, HasSubstr("quadruped_drive.yaml" + options + " --set 'policies.walk"));
  EXPECT_THAT(first.out, HasSubstr("commands=way.csv --policy walk; then"));
  const testing::Result again = drive("--replay way.csv --particle 2" + options);
  EXPECT_EQ(digest(first.out), digest(again.out)) << again.err;
}

// What a file asks for after the end of the drive is told; that it may drive longer, if it did not end by a violation.
TEST_F(Drive, TellsOfWhatComesAfterTheEnd) {
  testing::write_file(folder / "keys", "0 up\n0.3 left\n0.4 q\n");
  const testing::Result run = drive("--keys keys --trial 0 --set time.end=0.1");
  EXPECT_EQ(run.code, 0);
  EXPECT_THAT(run.err, HasSubstr("keys:2:5: is at 0.3 s, and the drive ended at 0.1 s, with 1 more behind it; --set "));
  testing::write_file(folder / "keys", "0 up\n0.9 q\n");
  const testing::Result fallen =
      drive("--keys keys --trial 0 --set 'task.requirements={low: {height: {link: BODY0, below: 1 cm}}}'");
  EXPECT_THAT(fallen.err, AllOf(HasSubstr("keys:1:3: is at 0 s, and the drive ended at 0 s, with 1 more"),
                                Not(HasSubstr("longer"))));
  testing::write_file(folder / "way.csv", "time,forward,strafe,turn,policy\n0,0.1,0,0,walk\n0.2,0,0,0,walk\n");
  EXPECT_THAT(drive("--replay way.csv --set time.end=0.1").err,
              HasSubstr("way.csv:3: is at 0.2 s, and the drive ended at 0.1 s; --set time.end"));
  EXPECT_THAT(drive("--replay way.csv --set time.end=0.3").err, Not(HasSubstr("ended")));
}

TEST_F(Drive, RecordsOverNothingThatItReads) {
  const std::string keys = "0 up\n0.1 q\n", way = "time,forward,strafe,turn,policy\n0,0.1,0,0,walk\n";
  testing::write_file(folder / "keys", keys);
  testing::write_file(folder / "way.csv", way);
  const std::string yaml = testing::read_file(testing::data("scenarios/quadruped_drive.yaml"));
  testing::write_file(folder / "my.csv", yaml);
  for (const char* options : {"--keys keys --record keys", "--replay way.csv --record way.csv"}) {
    const testing::Result run = drive(std::string(options) + " --force --set time.end=0.1");
    EXPECT_EQ(run.code, 2) << options;
    EXPECT_THAT(run.err, HasSubstr("which is only read")) << options;
  }
  const testing::Result over =
      testing::graze(folder.path(), "drive my.csv --keys keys --record my.csv --force --set robot.urdf='" +
                                        testing::data("robots/links.urdf") + "'");
  EXPECT_EQ(over.code, 2);
  EXPECT_EQ(testing::read_file(folder / "keys"), keys);
  EXPECT_EQ(testing::read_file(folder / "way.csv"), way);
  EXPECT_EQ(testing::read_file(folder / "my.csv"), yaml);
}

TEST_F(Drive, IsTheSameInACampaign) {
  const testing::Result first =
      testing::shell(folder.path(), "printf '0 up\\n0.15 up\\n0.3 right\\n0.5 q\\n' | '" GRAZE_PROGRAM "' drive " +
                                        scenario + " --particle 1 --record way.csv");
  ASSERT_EQ(first.code, 0) << first.err;
  ScenarioOptions options;
  options.overrides = {{"time.end", "0.5"},
                       {"policies.walk.gait.waypoints", "~"},
                       {"policies.walk.gait.commands", (folder / "way.csv").string()}};
  const Scenario all = load_scenario(testing::data("scenarios/quadruped_drive.yaml"), options);
  testing::Traces traces = testing::simulate(all, 2, all.seed, 1);
  EXPECT_EQ(fmt::format("digest {:016x}", traces.at({"walk", 1}).digest), digest(first.out));
}

// Switching gaits goes on from the very state, and the trial tells what would come of it.
TEST_F(Drive, TriesAGaitBeforeTheSwitch) {
  testing::write_file(folder / "keys", "0 up\n0.2 2\n1 q\n");
  const testing::Result run = drive("--keys keys --record way.csv --trial 8 --horizon 0.4s");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("0.500 s: trot accepted: 100 % of 8 particles keep all requirements for 0.4 s"));
  EXPECT_THAT(run.out, HasSubstr("1 s under walk, trot: "));
  EXPECT_THAT(testing::read_file(folder / "way.csv"), HasSubstr("0.5,0.05,0,0,trot\n"));
  const testing::Result again = drive("--replay way.csv --set time.end=1");
  EXPECT_EQ(digest(run.out), digest(again.out)) << again.err;
  // A trot on no feet at all: it falls onto its body.
  const testing::Result refused = drive(
      "--keys keys --trial 8 --horizon 0.4s --set policies.trot.gait.duty=1% --set "
      "policies.trot.gait.step_height=9cm");
  EXPECT_THAT(refused.out, HasSubstr("trot refused: ")) << refused.err;
  EXPECT_THAT(refused.out, HasSubstr("1 s under walk: "));
}

TEST_F(Drive, SaysWhatIsWrong) {
  testing::write_file(folder / "keys", "0 up\n0.5 jump\n");
  EXPECT_THAT(drive("--keys keys").err, HasSubstr("keys:2:5: 'jump' is no key"));
  testing::write_file(folder / "keys", std::string("0 \0\n", 4));
  EXPECT_THAT(drive("--keys keys").err, HasSubstr("keys:1:3: '\\u0000' is no key"));
  testing::write_file(folder / "keys", "0 w\n0.5 +\n");
  EXPECT_THAT(drive("--keys keys").err, HasSubstr("keys:2:5: '+' zooms the screen, and a script has none"));
  testing::write_file(folder / "keys", "0 up\n0.5  3\n");
  EXPECT_THAT(drive("--keys keys").err,
              HasSubstr("keys:2:6: '3' chooses policy 3 of 2; nearest right answer: 2, which"));
  EXPECT_THAT(drive("--keys keys --horizon 0").err, HasSubstr("--horizon 0: in no time nothing is tried"));
  testing::write_file(folder / "way.csv", "time,forward,strafe,turn,policy\n0,0,0,0,wolk\n");
  EXPECT_THAT(drive("--replay way.csv").err, HasSubstr("way.csv:2:9: 'wolk' is no policy that can be driven"));
  EXPECT_EQ(drive("--replay way.csv").code, 2);
  EXPECT_THAT(testing::graze(folder.path(), "drive pendulum --replay way.csv").err,
              HasSubstr("no policy that can be driven"));
}

/// A terminal of which the test is the other end.
struct Terminal {
  Terminal() : master(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) return;
    name = ptsname(master);
    slave = open(name.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  }
  ~Terminal() {
    close(slave);
    close(master);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  termios state() const {
    termios out{};
    tcgetattr(slave, &out);
    return out;
  }
  /// What is shown until `text` is, or nothing more comes for 20 s.
  std::string shown_until(const std::string& text) const {
    std::string out;
    pollfd wait = {master, POLLIN, 0};
    while (out.find(text) == std::string::npos && poll(&wait, 1, 20'000) > 0) {
      std::array<char, 4096> bytes;
      const ssize_t size = read(master, bytes.data(), bytes.size());
      if (size <= 0) break;
      out.append(bytes.data(), static_cast<std::size_t>(size));
    }
    return out;
  }
  int master, slave = -1;
  std::string name;
};

// The key ends it, a signal does, and so does a crash.
TEST_F(Drive, PutsTheTerminalBack) {
  for (const int signal : {0, SIGTERM, SIGABRT}) {
    const Terminal terminal;
    ASSERT_GE(terminal.slave, 0);
    const termios before = terminal.state();
    testing::Process process(
        folder.path(),
        "drive " + testing::data("scenarios/quadruped_drive.yaml") + " --record " + std::to_string(signal) + ".csv",
        [&] {
          setsid();
          const int own = open(terminal.name.c_str(), O_RDWR);
          ioctl(own, TIOCSCTTY, 0);
          dup2(own, STDIN_FILENO);
          dup2(own, STDOUT_FILENO);
        });
    EXPECT_THAT(terminal.shown_until("q ends"), HasSubstr("\x1b[?1049h"));
    EXPECT_EQ(terminal.state().c_lflag & (ICANON | ECHO), 0u);
    ASSERT_EQ(write(terminal.master, "w", 1), 1);
    EXPECT_THAT(terminal.shown_until("forward +0.05"), HasSubstr("forward +0.05"));
    if (signal == 0) {
      ASSERT_EQ(write(terminal.master, "q", 1), 1);
    } else {
      process.send(signal);
    }
    EXPECT_THAT(terminal.shown_until("\x1b[?1049l"), HasSubstr("\x1b[?1049l"));
    process.wait();
    const termios after = terminal.state();
    EXPECT_EQ(after.c_lflag, before.c_lflag) << signal;
    EXPECT_EQ(after.c_iflag, before.c_iflag) << signal;
    EXPECT_EQ(testing::fs::exists(folder / (std::to_string(signal) + ".csv")), signal != SIGABRT);
  }
}

}  // namespace
}  // namespace graze
