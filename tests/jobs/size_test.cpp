// How large an archive will be, told before anything is simulated.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/program.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Bytes of the shards of a campaign.
double shard_bytes(const testing::TemporaryFolder& folder, const std::string& campaign) {
  double bytes = 0;
  for (const auto& shard : std::filesystem::directory_iterator(folder / campaign / "shards")) {
    bytes += static_cast<double>(shard.file_size());
  }
  return bytes;
}

nlohmann::json estimate(const testing::TemporaryFolder& folder, const std::string& options) {
  const testing::Result check = testing::graze(folder.path(), "check ball.yaml --json " + options);
  EXPECT_EQ(check.code, 0) << check.err;
  return nlohmann::json::parse(check.out)["archive"];
}

// Claim: what --probe tells is within 15 % of the shards that a campaign of 4000 particles writes, without and with
// telemetry (the probe is of 8 particles, whose traces are not quite like all); the guess without it is no less than
// a quarter and no more than four times that.
TEST(Size, IsToldBeforehand) {
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  for (const std::string record : {"--telemetry none", "--telemetry all --every 2"}) {
    const std::string options = record + " -n 4000 ";
    ASSERT_EQ(testing::graze(folder.path(), "run ball.yaml --quiet --force -o a.graze " + options).code, 0);
    const double wanted = shard_bytes(folder, "a.graze");
    const auto probed = estimate(folder, options + "--probe"), guessed = estimate(folder, options);
    EXPECT_NEAR(probed["bytes"].get<double>(), wanted, 0.15 * wanted) << record;
    EXPECT_EQ(probed["probed_traces"], 8);
    EXPECT_GT(probed["processor_seconds"].get<double>(), 0);
    // What was read is kept twice, and counts.
    const auto read =
        std::filesystem::file_size(folder / "ball.yaml") + std::filesystem::file_size(folder / "ball.urdf");
    EXPECT_EQ(guessed["inputs"].get<double>(), 2.0 * static_cast<double>(read));
    EXPECT_GT(guessed["bytes"].get<double>(), wanted / 4) << record;
    EXPECT_LT(guessed["bytes"].get<double>(), wanted * 4) << record;
  }
}

// Claim: the text tells the total, its parts and what is free.
TEST(Size, IsPrintedByCheck) {
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  const testing::Result check = testing::graze(folder.path(), "check ball.yaml -n 1000000 -o elsewhere/big.graze");
  EXPECT_THAT(check.out, AllOf(HasSubstr("archive      about "), HasSubstr("for 1000000 particles x 1 policy"),
                               HasSubstr("are free")));
  const testing::Result huge = testing::graze(folder.path(), "check ball.yaml -n 4000000000 --telemetry all --every 1");
  EXPECT_THAT(huge.err, HasSubstr("would not fit"));
  EXPECT_EQ(huge.code, 0);
}

// Claim: a part of a campaign needs the disk for its own particles only, whatever the whole campaign takes; submit says
// so as run does.
TEST(Size, OfAPartIsThePartsOwn) {
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  if (std::filesystem::space(folder.path()).available > 600e9) GTEST_SKIP() << "2^32 particles fit on this disk";
  for (const std::string run : {"run ball.yaml", "submit ball.yaml --time 10 --dry-run"}) {
    SCOPED_TRACE(run);
    const std::string line = run + " -n 4294967295 --quiet -o part ";
    const testing::Result whole = testing::graze(folder.path(), line);
    EXPECT_EQ(whole.code, 3);
    EXPECT_THAT(whole.err, HasSubstr("will not fit"));
    const testing::Result part = testing::graze(folder.path(), line + "--part 7/40000000");
    EXPECT_EQ(part.code, 0) << part.err;
    EXPECT_EQ(part.err, "");
    std::filesystem::remove_all(folder / "part");
  }
}

}  // namespace
}  // namespace graze
