// Paths on the command line: folders that outputs need, and inputs that are not there.
#include "engine/settings/paths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "archive/files/parent_folders.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Claim: folders that were made go again, unless something was kept there; others stay.
TEST(ParentFolders, GoAgainIfNothingWasKept) {
  const testing::TemporaryFolder folder;
  fs::create_directory(folder / "a");
  { const ParentFolders empty(folder / "a/b/c/out.graze/"); }
  EXPECT_TRUE(fs::exists(folder / "a"));
  EXPECT_FALSE(fs::exists(folder / "a/b"));
  {
    const ParentFolders used(folder / "a/b/c/out.graze");
    fs::create_directory(folder / "a/b/c/out.graze");
  }
  EXPECT_TRUE(fs::exists(folder / "a/b/c/out.graze"));
}

// Claim: it is known beforehand where nothing can be made.
TEST(ParentFolders, SayWhereTheyCannotBeMade) {
  const testing::TemporaryFolder folder;
  testing::write_file(folder / "file", "");
  EXPECT_EQ(cannot_make(folder / "a/b/out.graze"), "");
  EXPECT_EQ(cannot_make("out.graze"), "");
  EXPECT_THAT(cannot_make(folder / "file/a/out.graze"), HasSubstr("file is no folder"));
}

// Claim: the nearest entry of the deepest folder that is there is suggested, and nothing that is far away.
TEST(PathSuggestion, IsTheNearestEntry) {
  const testing::TemporaryFolder folder;
  const std::string root = folder.path().string() + "/";
  fs::create_directories(folder / "scenes/curb.graze");
  testing::write_file(folder / "pendulum.yaml", "");
  EXPECT_EQ(path_suggestion(root + "pendulm.yaml"), "; did you mean '" + root + "pendulum.yaml'?");
  EXPECT_EQ(path_suggestion(root + "scenes/curb.grze"), "; did you mean '" + root + "scenes/curb.graze'?");
  EXPECT_EQ(path_suggestion(root + "scnes/curb.graze"), "; did you mean '" + root + "scenes/curb.graze'?");
  EXPECT_EQ(path_suggestion(root + "elephant/x"), "; there is no folder '" + root + "elephant'");
  EXPECT_EQ(path_suggestion(root + "elephant"), "");
  EXPECT_EQ(path_suggestion(root + "pendulm.yml"), "; did you mean '" + root + "pendulum.yaml'?");
  testing::write_file(folder / "pendulum.html", "");
  EXPECT_EQ(path_suggestion(root + "pendulum.yml"), "; did you mean '" + root + "pendulum.yaml'?");
  EXPECT_EQ(path_suggestion(root + "pendulum.yaml/x/y"), "; there is no folder '" + root + "pendulum.yaml/x'");
}

// Claim: a file of another kind is not suggested; what ends alike comes first, and then what the verb reads.
TEST(PathSuggestion, IsOfTheSameKind) {
  const testing::TemporaryFolder folder;
  const std::string root = folder.path().string() + "/";
  fs::create_directories(folder / "husky.graze");
  EXPECT_EQ(path_suggestion(root + "husky.urdf"), "");
  EXPECT_EQ(path_suggestion(root + "spirit", {".yaml", ".yml"}), "");
  for (const char* name : {"spirit.h5", "spirit.yaml", "husky_a.urdf"}) testing::write_file(folder / name, "");
  EXPECT_EQ(path_suggestion(root + "husky.urdf"), "; did you mean '" + root + "husky_a.urdf'?");
  EXPECT_EQ(path_suggestion(root + "spirit", {".yaml", ".yml"}), "; did you mean '" + root + "spirit.yaml'?");
  EXPECT_EQ(path_suggestion(root + "sprit", {".graze", ".h5"}), "; did you mean '" + root + "spirit.h5'?");
  EXPECT_EQ(path_suggestion(root + "husky.h5", {".graze", ".h5"}), "; did you mean '" + root + "husky.graze'?");
}

class Paths : public ::testing::Test {
 protected:
  testing::BallCampaign campaign;
  bool exists(const std::string& path) const { return fs::exists(campaign.folder / path); }
};

// Claim: every verb that writes makes the folders on the way, and leaves none if it wrote nothing.
TEST_F(Paths, ParentsOfOutputsAreMade) {
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o a/b/first.graze").code, 0);
  EXPECT_TRUE(exists("a/b/first.graze/campaign.h5"));
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o c/d/first.h5").code, 0);
  EXPECT_TRUE(exists("c/d/first.h5"));
  EXPECT_EQ(campaign.graze("pack a/b/first.graze -o e/f.h5").code, 0);
  EXPECT_EQ(campaign.graze("replay a/b/first.graze --particle 1 -o g/h/p.csv").code, 0);
  EXPECT_EQ(campaign.graze("sample ball.yaml -n 2 -o i/p.csv").code, 0);
  for (const char* file : {"e/f.h5", "g/h/p.csv", "g/h/p.trace.csv", "i/p.csv"}) EXPECT_TRUE(exists(file)) << file;
  EXPECT_EQ(campaign.graze("run ball.yaml -n 2 --policy nope -o x/y/z.graze").code, 2);
  EXPECT_EQ(campaign.graze("replay a/b/first.graze --particle 7 -o x/y/p.csv").code, 2);
  EXPECT_EQ(campaign.graze("pack nothing.graze -o x/y/p.h5").code, 2);
  EXPECT_FALSE(exists("x"));
  const testing::Result in_the_way = campaign.graze("run ball.yaml -n 2 -o ball.yaml/a/b.graze");
  EXPECT_EQ(in_the_way.code, 3);
  EXPECT_THAT(in_the_way.err, HasSubstr("ball.yaml/a: cannot be written"));
}

// Claim: a link that waits under an output's name leads nowhere, and a pipe among inputs is not waited for.
TEST_F(Paths, LinksAndPipesLeadNowhere) {
  for (const char* name : {"p.csv", "ball.sbatch"}) {
    fs::create_symlink(campaign.folder / "elsewhere", campaign.folder / name);
  }
  EXPECT_EQ(campaign.graze("sample ball.yaml -n 2 -o p.csv").code, 2);
  EXPECT_TRUE(fs::is_symlink(campaign.folder / "p.csv"));
  EXPECT_EQ(campaign.graze("sample ball.yaml -n 2 -o p.csv --force").code, 0);
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(campaign.folder / "p.csv")));
  campaign.graze("submit ball.yaml --time 9 -o ball --force");  // there need not be an sbatch
  EXPECT_FALSE(exists("elsewhere"));
  ASSERT_EQ(mkfifo((campaign.folder / "pipe").c_str(), 0600), 0);
  testing::write_file(campaign.folder / "piped.yaml", "include: pipe\n");
  for (const std::string words :
       {"check pipe", "check piped.yaml", "check ball.yaml --set robot.urdf=pipe", "score pipe", "status pipe",
        "pack pipe", "resume pipe", "replay pipe --particle 1"}) {
    const testing::Result refused = campaign.graze(words);
    EXPECT_EQ(refused.code, 2) << words;
    EXPECT_THAT(refused.err, HasSubstr("pipe")) << words;
  }
}

// Claim: inputs that are not there are refused with the nearest entry of their folder.
TEST_F(Paths, MissingInputsNameTheNearest) {
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o ball.graze").code, 0);
  for (const std::string verb : {"score", "status", "resume", "pack", "replay --particle 1"}) {
    const testing::Result run = campaign.graze(verb + " ball.grze");
    EXPECT_EQ(run.code, 2) << verb;
    EXPECT_THAT(run.err, HasSubstr("did you mean 'ball.graze'?")) << verb;
  }
  for (const std::string verb : {"check", "run", "sample", "submit --time 9"}) {
    const testing::Result run = campaign.graze(verb + " bal.yaml");
    EXPECT_EQ(run.code, 2) << verb;
    EXPECT_THAT(run.err, HasSubstr("did you mean 'ball.yaml'?")) << verb;
  }
}

// Claim: a scenario or an archive whose ending was forgotten is suggested with it.
TEST_F(Paths, ForgottenEndingsAreSuggested) {
  ASSERT_EQ(campaign.graze("run ball.yaml -n 2 --quiet -o ball.graze").code, 0);
  EXPECT_THAT(campaign.graze("check ball").err, HasSubstr("did you mean 'ball.yaml'?"));
  EXPECT_THAT(campaign.graze("score ball").err, HasSubstr("did you mean 'ball.graze'?"));
}

// Claim: check -o tells what run would find there.
TEST_F(Paths, CheckLooksAtTheOutput) {
  EXPECT_EQ(campaign.graze("check ball.yaml -o new.graze").err, "");
  EXPECT_THAT(campaign.graze("check ball.yaml -o no/new.graze").err, HasSubstr("no: is not there yet"));
  EXPECT_THAT(campaign.graze("check ball.yaml -o ball.yaml/x").err, HasSubstr("ball.yaml is no folder"));
  testing::write_file(campaign.folder / "there", "");
  EXPECT_THAT(campaign.graze("check ball.yaml -o there").err, HasSubstr("there: exists already"));
  EXPECT_FALSE(exists("no"));
}

}  // namespace
}  // namespace graze
