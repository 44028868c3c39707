// graze report and graze view: what they write, what they refuse, and what they say of traces that cannot be had again.
// What the page does in a browser: report_page.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/replay_campaign.h"

namespace graze {
namespace {

using PlainJson = nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Balls that are dropped: about three quarters end low.
class Report : public ::testing::Test {
 protected:
  testing::BallCampaign campaign;

  void SetUp() override {
    const testing::Result run = campaign.graze("run ball.yaml -n 20 --quiet -o a.graze");
    ASSERT_EQ(run.code, 0) << run.err;
  }
  testing::Result graze(const std::string& arguments) const { return campaign.graze(arguments); }
  std::string page(const std::string& name) const { return testing::read_file(campaign.folder / name); }
  void refused(const std::string& arguments, const std::vector<std::string>& parts) const {
    const testing::Result run = graze(arguments);
    EXPECT_EQ(run.code, 2) << arguments << run.err;
    for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part)) << arguments;
  }
};

// Claim: the page is one whole HTML file named after the archive, holds the data and asks no network for anything.
TEST_F(Report, IsOneFile) {
  const testing::Result run = graze("report a.graze/");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("a.html: "));
  const std::string text = page("a.html");
  EXPECT_THAT(text.substr(0, 15), HasSubstr("<!doctype html>"));
  EXPECT_THAT(text, AllOf(HasSubstr("default-src 'none'"), HasSubstr("\"kind\":\"report\""), HasSubstr("</html>")));
  EXPECT_THAT(text, AllOf(Not(HasSubstr("src=\"http")), Not(HasSubstr("@DATA@")), Not(HasSubstr("@SCRIPT@"))));
}

// Claim: sections on survival and causes come before those on events; of so few traces causes are asked of all, and are
// those of `explain --json`.
TEST_F(Report, ExplainsLikeExplain) {
  const PlainJson sections =
      PlainJson::parse(graze("report a.graze --json --replays 0 --trajectories 0").out)["sections"];
  ASSERT_GE(sections.size(), 2u);
  EXPECT_EQ(sections[0]["id"], "survival");
  EXPECT_EQ(sections[1]["id"], "causes");
  const PlainJson explanation = PlainJson::parse(graze("explain a.graze --json").out);
  const PlainJson& questions = sections[1]["widgets"][0]["rows"];
  std::size_t row = 0;
  for (const PlainJson& policy : explanation["policies"]) {
    for (const PlainJson& causes : policy["causes"]) {
      ASSERT_LT(row, questions.size());
      EXPECT_EQ(questions[row][1], causes["target"]);
      EXPECT_EQ(questions[row++][3], causes["verdict"]);
    }
  }
  EXPECT_EQ(row, questions.size());
  EXPECT_GT(row, 0u);
}

// Claim: --json has the numbers of `score --json`, and of traces the bits that the archive knows: all are identical.
TEST_F(Report, JsonHasTheNumbersOfTheScore) {
  const PlainJson data = PlainJson::parse(graze("report a.graze --json --replays 3 --trajectories 7").out);
  EXPECT_EQ(data["score"], PlainJson::parse(graze("score a.graze --json").out));
  ASSERT_EQ(data["trajectories"].size(), 7u);
  std::size_t bodies = 0;
  for (const PlainJson& trace : data["trajectories"]) {
    EXPECT_EQ(trace["identical"], true);
    EXPECT_EQ(trace["rows"].size(), data["channels"].size());
    for (const PlainJson& row : trace["rows"]) EXPECT_EQ(row.size(), trace["time"].size());
    EXPECT_EQ(trace["time"].back(), trace["end"]);
    bodies += trace.contains("bodies");
  }
  EXPECT_EQ(bodies, 3u);
  EXPECT_EQ(data["scene"]["colliders"].size(), 2u);
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "a.html"));
  const std::string packed = (graze("pack a.graze"), graze("report a.h5 --json --replays 3 --trajectories 7").out);
  EXPECT_EQ(PlainJson::parse(packed)["trajectories"][0]["rows"], data["trajectories"][0]["rows"]);
}

// Claim: a page takes no other file's place without --force, is no other kind of file, and lies in no archive.
TEST_F(Report, OutputsAreGuarded) {
  testing::write_file(campaign.folder / "a.html", "mine");
  refused("report a.graze", {"a.html", "--force"});
  EXPECT_EQ(page("a.html"), "mine");
  EXPECT_EQ(graze("report a.graze --force").code, 0);
  EXPECT_NE(page("a.html"), "mine");
  for (const std::string verb : {"report a.graze", "view a.graze --particle 1"}) {
    refused(verb + " -o a.csv", {"a.csv", ".html"});
    refused(verb + " -o a", {".html"});
    refused(verb + " -o a.graze/x.html", {"a.graze"});
    EXPECT_EQ(graze(verb + " -o new/" + verb.substr(0, 4) + "/x.html").code, 0);
  }
  refused("report nowhere.graze -o x.html", {"nowhere.graze"});
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "x.html"));
  refused("report a.graze --json -o x.html", {"--json", "--output"});
  refused("report a.graze --policy stil --force", {"nearest: still"});
}

// Claim: a view has each particle under each policy; what the archive does not hold is refused.
TEST_F(Report, ViewShowsWhatIsAskedFor) {
  ASSERT_EQ(graze("view a.graze --particle 3 --particle 5 -o v.html").code, 0);
  EXPECT_THAT(page("v.html"),
              AllOf(HasSubstr("\"kind\":\"view\""), HasSubstr("\"particle\":3"), HasSubstr("\"particle\":5")));
  EXPECT_THAT(graze("view a.graze --particle 3,5").err,
              HasSubstr("--particle 3,5: takes one particle; nearest right answer: --particle 3 --particle 5"));
  EXPECT_EQ(graze("view a.graze --particle 3").code, 0);
  EXPECT_TRUE(testing::fs::exists(campaign.folder / "a.p3.html"));
  refused("view a.graze --particle 20 -o w.html", {"--particle 20", "a.graze has particles 0 to 19"});
  refused("view a.graze --particle x -o w.html", {"--particle", "x"});
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "w.html"));
}

// Claim: `replay --view` writes and names the page that `view` writes of that trace, beside what else is exported; it
// takes no other file's place without --force, and refuses before anything is written.
TEST_F(Report, ReplayWritesTheSamePage) {
  ASSERT_EQ(graze("view a.graze --particle 3 --policy still -o v.html").code, 0);
  const testing::Result run = graze("replay a.graze --particle 3 --policy still --view -o p3.h5");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("written: a.p3.html, p3.h5\n"));
  EXPECT_EQ(page("a.p3.html"), page("v.html"));
  const testing::Result json = graze("replay a.graze --particle 3 --view --force --json");
  EXPECT_EQ(PlainJson::parse(json.out)["exported"], PlainJson::array({"a.p3.html"})) << json.err;
  testing::write_file(campaign.folder / "a.p4.html", "mine");
  refused("replay a.graze --particle 4 --view -o p4.h5", {"a.p4.html", "--force"});
  EXPECT_EQ(page("a.p4.html"), "mine");
  refused("replay a.graze --particle 25 --unverified --view -o p25.h5",
          {"--view", "a.graze holds no trace of particle 25"});
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "p25.h5"));
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "a.p25.html"));
}

// Claim: of ground that is drawn, replays show each particle's own, the same under every policy.
TEST(ReportOfDrawnGround, ShowsEachParticlesOwn) {
  const testing::TemporaryFolder folder;
  const std::string scenario = testing::data("scenarios/quadruped_rough.yaml");
  const testing::Result run =
      testing::graze(folder.path(), "run '" + scenario + "' -n 2 --quiet --set time.end='10 ms' -o a.graze");
  ASSERT_EQ(run.code, 0) << run.err;
  const PlainJson report = PlainJson::parse(testing::graze(folder.path(), "report a.graze --json").out);
  std::map<int, std::set<std::string>> grounds;
  for (const PlainJson& trace : report["trajectories"]) {
    if (!trace.contains("bodies")) continue;
    ASSERT_EQ(trace["bodies"]["grounds"].size(), 1u);
    grounds[trace["particle"].get<int>()].insert(trace["bodies"]["grounds"].begin()->dump());
  }
  ASSERT_EQ(grounds.size(), 2u);
  EXPECT_EQ(grounds[0].size(), 1u);
  EXPECT_EQ(grounds[1].size(), 1u);
  EXPECT_NE(*grounds[0].begin(), *grounds[1].begin());
}

// Claim: an archive of another results version has a report without what is simulated, which the page and the terminal
// say; it cannot be viewed.
TEST(ReportOfAnother, ResultsVersionHasNoReplays) {
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  const Scenario scenario = load_scenario((folder / "ball.yaml").string());
  testing::write_campaign(folder / "old.graze", scenario, 4,
                          [](CampaignInfo& info) { info.results_version = "0.0.9+abc"; });
  const testing::Result run = testing::graze(folder.path(), "report old.graze --json");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("no trajectories and no replays"), HasSubstr("0.0.9+abc")));
  const PlainJson data = PlainJson::parse(run.out);
  EXPECT_FALSE(data.contains("scene"));
  ASSERT_EQ(data["notes"].size(), 1u);
  EXPECT_THAT(data["notes"][0].get<std::string>(), HasSubstr("0.0.9+abc"));
  EXPECT_GT(data["trajectories"].size(), 0u);
  EXPECT_EQ(testing::graze(folder.path(), "report old.graze").code, 0);
  EXPECT_EQ(testing::graze(folder.path(), "view old.graze --particle 0").code, 2);
  EXPECT_EQ(testing::graze(folder.path(), "replay old.graze --particle 0 --any-version --view").code, 2);
}

// Claim: a trace that is not the archive's is shown with a note, and `view` ends with 1.
TEST(ReportOfAnother, TraceIsNotHidden) {
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  const Scenario scenario = load_scenario((folder / "ball.yaml").string());
  testing::write_campaign(
      folder / "a.graze", scenario, 4, [](CampaignInfo&) {},
      [](TraceRecord& trace) { trace.digest ^= trace.particle == 2; });
  const testing::Result run = testing::graze(folder.path(), "report a.graze --json");
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("particle 2 under policy 'still' went ANOTHER WAY"), Not(HasSubstr("particle 1 "))));
  EXPECT_EQ(PlainJson::parse(run.out)["notes"].size(), 1u);
  EXPECT_EQ(testing::graze(folder.path(), "view a.graze --particle 2").code, 1);
  EXPECT_EQ(testing::graze(folder.path(), "view a.graze --particle 1").code, 0);
}

}  // namespace
}  // namespace graze
