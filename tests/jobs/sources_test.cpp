// Claim: `graze sources` switches each source of uncertainty on alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::HasSubstr;

/// Balls that are dropped from 15 to 25 cm: where they begin decides, and their density, in free fall, nothing.
struct Sources : ::testing::Test, testing::BallCampaign {
  nlohmann::json study(const std::string& options) const {
    const testing::Result run = graze("sources ball.yaml --json " + options);
    EXPECT_EQ(run.code, 0) << run.err;
    return nlohmann::json::parse(run.out)["sources"];
  }
};

TEST_F(Sources, TellThemApart) {
  const nlohmann::json rows = study("-n 200");
  std::map<std::string, nlohmann::json> by;
  for (const nlohmann::json& row : rows) by[row["source"]] = row;
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(by["none"]["n"], 1);
  EXPECT_NEAR(by["fabrication"]["place"], 0, 1e-12);
  EXPECT_EQ(by["fabrication"]["success"], 200) << "the nominal ball falls from 20 cm and ends below";
  // Uniform over 10 cm: a standard deviation of 10 / sqrt(12) = 2.89 cm, of 200 to 5 % (three standard errors 4 sigma).
  EXPECT_NEAR(by["initial state"]["place"], 0.1 / std::sqrt(12), 0.1 * 0.0289);
  EXPECT_NEAR(by["all"]["place"], by["initial state"]["place"], 1e-9) << "the same particles";
  EXPECT_EQ(by["all"]["success"], by["initial state"]["success"]);
  // The whole is the campaign that `graze run` makes.
  const testing::Result run = graze("run ball.yaml -n 200 --json --quiet -o all.graze");
  EXPECT_EQ(nlohmann::json::parse(run.out)["policies"][0]["success"], by["all"]["success"]);
}

TEST_F(Sources, AreTheSameForAnyThreads) { EXPECT_EQ(study("-n 100 --threads 1"), study("-n 100 --threads 3")); }

TEST_F(Sources, PrintATable) {
  const testing::Result run = graze("sources ball.yaml -n 8");
  EXPECT_EQ(run.code, 0) << run.err;
  for (const char* word : {"each source of uncertainty alone, 8 particles", "place mm", "initial state"}) {
    EXPECT_THAT(run.out, HasSubstr(word));
  }
  EXPECT_THAT(graze("sources ball.yaml --policy stil").err, HasSubstr("nearest: still"));
}

}  // namespace
}  // namespace graze
