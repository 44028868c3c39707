// Claim: whatever a controller in a shared object does, the campaign ends, the particle that it does it in is invalid
// and says so, and every other particle has the bits that it has without it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/controllers/swing.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using testing::Outcomes;
using testing::outcomes;
using testing::Result;
using testing::Swing;

struct Torture {
  const char* does;
  const char* reason;  // what the trace says
  const char* told;    // what is printed beside it
};

class TortureTest : public ::testing::TestWithParam<Torture> {};

TEST_P(TortureTest, CostsItsParticleAlone) {
  const Torture& torture = GetParam();
  const std::string does = torture.does;
  if (GRAZE_SANITIZED && (does == "segfault" || does == "leak")) GTEST_SKIP() << "the sanitizer is there first";
  const Swing swing;
  swing.odd("nothing");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -o well.graze").code, 0);
  const Outcomes well = outcomes(swing.folder / "well.graze");
  ASSERT_EQ(well.digest.size(), 24u);
  ASSERT_GT(well.high.size(), 0u);
  swing.odd(torture.does);
  const Result run = swing.graze("run swing.yaml --trust --quiet --threads 2 -o ill.graze");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr(torture.told));
  const Outcomes ill = outcomes(swing.folder / "ill.graze");
  EXPECT_EQ(ill.invalid.size(), well.high.size());
  for (const auto& [id, reason] : ill.invalid) {
    EXPECT_TRUE(well.high.count(id)) << id;
    EXPECT_THAT(reason, HasSubstr(torture.reason));
    EXPECT_THAT(reason, HasSubstr("act() at 0.01 s"));
    EXPECT_THAT(run.err, ::testing::ContainsRegex("(particle |particles |, )" + std::to_string(id) + "(:|,|\\))"));
  }
  for (const auto& [id, digest] : ill.digest) EXPECT_EQ(digest, well.digest.at(id)) << id;
  EXPECT_EQ(ill.digest.size() + ill.invalid.size(), 24u);
}

INSTANTIATE_TEST_SUITE_P(
    Of, TortureTest,
    ::testing::Values(Torture{"segfault", "crashed (SIGSEGV)", "SIGSEGV"},
                      Torture{"print", "crashed (SIGABRT)", "it printed: my gripper is on fire"},
                      Torture{"leak", "crashed (SIGABRT)", "SIGABRT"}, Torture{"exit", "exit code 3", "exit code 3"},
                      Torture{"exit_alike", "exit code 77", "exit code 77"},
                      Torture{"fork", "exit code 5", "exit code 5"},
                      Torture{"rounding", "changed the floating-point environment", "floating-point"},
                      Torture{"nan", "asks joint hinge for a torque of nan", "hinge"},
                      Torture{"behind", "writes targets.torque of joint 1, behind its end", "1 driven joint"},
                      Torture{"error", "returned error 7: the gripper has no fingers", "no fingers"}),
    [](const auto& info) { return std::string(info.param.does); });

// A fault that throws nothing but an error is as well contained in the program itself.
TEST(Torture, InTheProgramItself) {
  const Swing swing;
  for (const char* does : {"rounding", "nan", "error"}) {
    swing.odd(does);
    ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet --force -o apart.graze").code, 0);
    swing.odd(does, ", isolation: none");
    ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet --force -o here.graze").code, 0);
    const Outcomes apart = outcomes(swing.folder / "apart.graze"), here = outcomes(swing.folder / "here.graze");
    EXPECT_EQ(apart.digest, here.digest) << does;
    EXPECT_EQ(apart.invalid, here.invalid) << does;
    EXPECT_EQ(apart.invalid.size(), apart.high.size());
  }
}

// What takes long to begin is waited for.
TEST(Torture, SlowStart) {
  const Swing swing;
  swing.odd("sleep_create", ", timeout: 0.2 s");
  const Result run = swing.graze("run swing.yaml --trust --quiet -n 8 --threads 1 -o slow.graze");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(outcomes(swing.folder / "slow.graze").digest.size(), 8u);
}

}  // namespace
}  // namespace graze
