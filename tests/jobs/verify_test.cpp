// Claim: `graze verify` foretells what `graze resume` does, by its exit code, to people and to scripts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class VerifyVerb : public ::testing::Test, public testing::BallCampaign {
 protected:
  nlohmann::json json(int code) const {
    const testing::Result run = graze("verify --json a.graze");
    EXPECT_EQ(run.code, code) << run.out << run.err;
    return nlohmann::json::parse(run.out);
  }
};

TEST_F(VerifyVerb, ForetellsWhatResumeDoes) {
  ASSERT_EQ(graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  const testing::Digests before = testing::digests(folder / "a.graze");
  const testing::Result whole = graze("verify a.graze");
  EXPECT_EQ(whole.code, 0) << whole.err;
  EXPECT_THAT(whole.out, AllOf(HasSubstr("a.graze: whole"), HasSubstr("20 of 20 traces")));
  testing::write_file(folder / "a.graze/shards/000001.h5", "no archive at all");
  const testing::Result damaged = graze("verify a.graze");
  EXPECT_EQ(damaged.code, 3);
  EXPECT_THAT(damaged.out,
              AllOf(HasSubstr("'graze resume a.graze' mends it and simulates 20 traces"),
                    HasSubstr("of which damaged or missing shards held 20"), HasSubstr("shards/000001.h5")));
  EXPECT_EQ(json(3)["left"], 20);
  ASSERT_EQ(graze("resume a.graze --quiet").code, 0);
  EXPECT_EQ(json(0)["verdict"], "whole");
  EXPECT_EQ(testing::digests(folder / "a.graze"), before);
}

TEST_F(VerifyVerb, TellsWhatCannotBeMended) {
  ASSERT_EQ(graze("run ball.yaml -n 20 --quiet -o a.h5").code, 0);
  EXPECT_EQ(graze("verify a.h5").code, 0);
  std::string bytes = testing::read_file(folder / "a.h5");
  testing::write_file(folder / "a.h5", bytes.substr(0, bytes.size() / 2));
  const testing::Result run = graze("verify a.h5");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.out, AllOf(HasSubstr("a.h5: damaged"), HasSubstr("closing checksum is missing")));
  EXPECT_THAT(graze("verify nothing.h5").err, HasSubstr("nothing.h5: is not there"));
}

// Claim: intact files of other kinds are not called damaged: it is said what they are.
TEST_F(VerifyVerb, TellsOtherKindsOfFiles) {
  ASSERT_EQ(graze("run ball.yaml -n 20 --quiet -o a.graze").code, 0);
  ASSERT_EQ(graze("replay a.graze --particle 1 -o p.h5").code, 0);
  for (const auto& [file, what] : {std::pair("a.graze/shards/000001.h5", "is one shard of a campaign"),
                                   {"p.h5", "is what graze replay has exported"},
                                   {"a.graze/campaign.h5", "give the directory that it lies in"}}) {
    const testing::Result run = graze(std::string("verify ") + file);
    EXPECT_EQ(run.code, 2) << file;
    EXPECT_EQ(run.out, "") << file;
    EXPECT_THAT(run.err, AllOf(HasSubstr("has an intact seal"), HasSubstr(what))) << file;
  }
  EXPECT_THAT(graze("score p.h5").err, HasSubstr("is what graze replay has exported"));
  EXPECT_THAT(graze("pack ball.yaml").err, HasSubstr("ball.yaml: is a file; pack takes campaign directories"));
}

}  // namespace
}  // namespace graze
