// Claim: recorded commands come back as they were written, bit for bit, hold from row to row for all robots alike, and
// are refused with file:line:column where they are wrong.
#include "engine/control/command_file.h"

#include <gtest/gtest.h>

#include "engine/control/base_command.h"
#include "engine/settings/inputs.h"
#include "tests/message_of.h"

namespace graze {
namespace {

std::string refusal(const std::string& text) {
  return testing::message_of([&] { parse_commands(text, "drive.csv"); });
}

TEST(CommandFile, ComesBackAsItWasWritten) {
  std::vector<CommandRow> rows = {{0, 0.1 + 0.2, -1e-17, 1.0 / 3, "walk"}, {0.001 * 1234, 0, 0, -0.0, "trot"}};
  const std::vector<CommandRow> read = parse_commands(commands_text(rows), "drive.csv");
  ASSERT_EQ(read.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read[i].time, rows[i].time);
    EXPECT_EQ(read[i].forward, rows[i].forward);
    EXPECT_EQ(read[i].strafe, rows[i].strafe);
    EXPECT_EQ(read[i].turn, rows[i].turn);
    EXPECT_EQ(read[i].policy, rows[i].policy);
  }
  EXPECT_EQ(read[1].line, 3);
}

TEST(CommandFile, SaysWhereItIsWrong) {
  const std::string head = "time,forward,strafe,turn\n";
  EXPECT_EQ(refusal(head + "0,0.2,fast,0\n"),
            "drive.csv:2:7: 'fast' is no number; s, m/s, m/s and rad/s stand here, without units");
  EXPECT_EQ(refusal(head + "0,0.2" + std::string(1, '\0') + ",0,0\n"),
            "drive.csv:2:3: '0.2\\0' is no number; s, m/s, m/s and rad/s stand here, without units");
  EXPECT_LT(refusal(head + "0," + std::string(1'000'000, '7') + ",0,0\n").size(), 200u);
  EXPECT_EQ(refusal(head + "0,0,0,0\n\n1, 0,0\n"), "drive.csv:4:7: 3 values; the header has 4 columns");
  EXPECT_EQ(refusal(head + "0,0,0,0\n 0,1,0,0\n"),
            "drive.csv:3:2: time 0 does not lie after the row before; times must grow");
  EXPECT_EQ(refusal(head + "-1,0,0,0\n"), "drive.csv:2:1: time -1 is negative; it must be >= 0");
  EXPECT_EQ(refusal("time,forward,turn\n"),
            "drive.csv:1:14: 'turn': the header must be time,forward,strafe,turn, and ,policy may follow");
  EXPECT_EQ(parse_commands("\xEF\xBB\xBF" + head + "0,1,0,0\n", "drive.csv").size(), 1u) << "a byte order mark";
  EXPECT_EQ(refusal(head), "drive.csv:1:1: has no rows; one at least must stand below the header, as 0,0.2,0,0");
  EXPECT_EQ(refusal("time,forward,strafe,turn,policy\n0,0,0,0,\n"),
            "drive.csv:2:9: no policy stands here; its name must");
  EXPECT_NE(refusal(head + "0,inf,0,0\n").find("'inf' is no number"), std::string::npos);
}

TEST(CommandFile, IsAFile) {
  const std::string told = testing::message_of([] { read_steering(Settings::parse("commands: .", "/x.yaml"), true); });
  EXPECT_NE(told.find("'/': not a file, but a folder"), std::string::npos) << told;
}

TEST(CommandFile, HoldsFromRowToRow) {
  const InputReplay files({{"/way/drive.csv", "time,forward,strafe,turn\n0.5,0.2,0,0\n1,0.1,-0.1,0.4\n"}}, "/way");
  const auto way = read_steering(Settings::parse("commands: drive.csv", "/way/x.yaml"), true);
  Observation observation;
  for (int lane = 0; lane < kLanes; ++lane) observation.time[static_cast<std::size_t>(lane)] = 0.499;
  // A sum of steps may lie a rounding before the row's time.
  observation.time[1] = 0.5 - 1e-13;
  observation.time[2] = 1;
  observation.time[3] = 1e6;
  BlockArray command(kCommandRows);
  way->steer(observation, LaneMask::first(4), command);
  EXPECT_TRUE(command.column(0).isZero(0));
  EXPECT_EQ(command(0, 1), 0.2);
  for (int lane = 2; lane < 4; ++lane) {
    EXPECT_EQ(command(0, lane), 0.1);
    EXPECT_EQ(command(1, lane), -0.1);
    EXPECT_EQ(command(5, lane), 0.4);
  }
}

TEST(CommandFile, IsForOnePolicy) {
  const InputReplay files({{"/way/drive.csv", "time,forward,strafe,turn,policy\n0,0,0,0,walk\n1,0,0,0,trot\n"}},
                          "/way");
  const std::string told =
      testing::message_of([] { load_commands(Settings::parse("commands: drive.csv", "/way/x.yaml").at("commands")); });
  EXPECT_NE(told.find("drive.csv:3:1: goes on under trot after walk"), std::string::npos) << told;
}

}  // namespace
}  // namespace graze
