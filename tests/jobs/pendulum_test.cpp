// A campaign of many short particles, as a user runs it: pendulums by the ten thousand.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/program.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::string pendulum() { return "'" + testing::data("scenarios/pendulum.yaml") + "'"; }

/// A Python that has h5py and pandas; empty if there is none.
std::string python() {
  for (const char* program : {"python3", "/usr/bin/python3"}) {
    const std::string command = std::string(program) + " -c 'import h5py, pandas' 2>/dev/null";
    if (std::system(command.c_str()) == 0) return program;
  }
  return "";
}

// Claim: 20,000 pendulums (under a sanitizer a tenth) pack to a file in which pandas finds what `score` prints, success
// and both failures occur, and status counts the same.
TEST(Pendulum, PandasOpensTwentyThousand) {
  const TemporaryFolder folder;
  const auto graze = [&](const std::string& arguments) { return testing::graze(folder.path(), arguments); };
  const int n = test::trials(20000);
  const testing::Result run = graze(fmt::format("run {} -n {} --quiet --json -o p.graze", pendulum(), n));
  ASSERT_EQ(run.code, 0) << run.err;
  const auto of = nlohmann::json::parse(run.out)["policies"][0];
  EXPECT_EQ(of["n"], n);
  for (const char* outcome : {"success", "known_failure", "unknown_failure"}) EXPECT_GT(of[outcome], n / 20) << outcome;
  ASSERT_EQ(graze("pack p.graze -o p.h5").code, 0);
  const testing::Result score = graze("score p.h5 --json");
  // The replay commands of failures name the archive; the rest is the same.
  EXPECT_EQ(nlohmann::json::parse(score.out)["policies"],
            nlohmann::json::parse(graze("score p.graze --json").out)["policies"]);
  const auto status = nlohmann::json::parse(graze("status p.graze --json").out);
  EXPECT_EQ(status["done"], n);
  if (python().empty()) GTEST_SKIP() << "no Python with h5py and pandas";
  testing::write_file(folder / "score.json", score.out);
  const testing::Result read = testing::shell(
      folder.path(), python() + " '" GRAZE_SOURCE_DIR "/tests/analysis/read_with_pandas.py' p.h5 score.json");
  EXPECT_EQ(read.code, 0) << read.out << read.err;
}

/// Largest resident set of a verb, kB.
long peak_kb(const TemporaryFolder& folder, const std::string& arguments) {
  testing::write_file(folder / "peak.py",
                      "import resource, shlex, subprocess, sys\n"
                      "subprocess.run(shlex.split(sys.argv[1]), check=True, stdout=subprocess.DEVNULL)\n"
                      "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)\n");
  const testing::Result result =
      testing::shell(folder.path(), "python3 peak.py \"'" + std::string(GRAZE_PROGRAM) + "' " + arguments + "\"");
  EXPECT_EQ(result.code, 0) << result.err;
  return std::atol(result.out.c_str());
}

// Claim: twice the particles take no more memory: a million more may cost 20 MB, a few bits each and more shards that
// are open at once, and `run` a shard that waits for the disk besides; their traces are 140 MB on disk and more than
// twice that in memory.
TEST(Pendulum, MemoryDoesNotGrowWithParticles) {
  if (!std::getenv("GRAZE_LONG")) GTEST_SKIP() << "tests/run --long runs it";
  const TemporaryFolder folder;
  const auto peaks = [&](const std::string& n) {
    const std::string p = "p" + n;
    return std::vector<long>{
        peak_kb(folder, "run " + pendulum() + " -n " + n + " --threads 1 --quiet -o " + p + ".graze"),
        peak_kb(folder, "score " + p + ".graze"), peak_kb(folder, "status " + p + ".graze"),
        peak_kb(folder, "pack " + p + ".graze"), peak_kb(folder, "score " + p + ".h5")};
  };
  const std::vector<long> small = peaks("1000000"), large = peaks("2000000");
  const char* verbs[] = {"run", "score", "status", "pack", "score of a file"};
  for (std::size_t i = 0; i < small.size(); ++i) {
    const long waiting = i == 0 ? 32'000 : 0;  // kB, a full shard
    EXPECT_LT(large[i], small[i] + 20'000 + waiting) << verbs[i] << ": " << small[i] << " kB for a million particles";
  }
}

}  // namespace
}  // namespace graze
