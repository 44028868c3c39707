// Claim: a controller that throws dice gives a particle the same bits for any number of ranks and of their threads, in
// C and in Python.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/controllers/python_swing.h"
#include "tests/jobs/mpirun.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

void expect_same_dice(const fs::path& folder, const std::string& particles) {
  const auto run = [&](int ranks, int threads) {
    const std::string name = std::to_string(ranks) + "x" + std::to_string(threads) + ".graze";
    const testing::Result result =
        testing::shell(folder, testing::mpirun(ranks) + "run swing.yaml --trust --quiet -n " + particles +
                                   " --threads " + std::to_string(threads) + " -o " + name);
    EXPECT_EQ(result.code, 0) << name << ": " << result.err;
    return testing::outcomes(folder / name).digest;
  };
  const auto alone = run(1, 1);
  EXPECT_EQ(alone.size(), std::stoul(particles));
  EXPECT_EQ(alone, run(2, 2));
}

TEST(ControllersUnderRanks, ThrowTheSameDiceInC) {
  if (!testing::kHaveMpi) GTEST_SKIP() << "built without MPI";
  const testing::Swing swing;
  swing.odd("dice");
  expect_same_dice(swing.folder.path(), "64");
}

TEST(ControllersUnderRanks, ThrowTheSameDiceInPython) {
  if (!testing::kHaveMpi) GTEST_SKIP() << "built without MPI";
  const testing::PythonSwing swing;
  swing.odd("dice", "");
  expect_same_dice(swing.folder.path(), "16");
}

}  // namespace
}  // namespace graze
