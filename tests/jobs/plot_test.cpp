// graze plot: what it writes, what it refuses, and that names of archives are never commands of gnuplot's.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/replay_campaign.h"

namespace graze {
namespace {

using PlainJson = nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

bool no_gnuplot() { return std::system("command -v gnuplot >/dev/null 2>&1") != 0; }

/// Balls that are dropped, and touch the ground.
class Plot : public ::testing::Test {
 protected:
  testing::BallCampaign campaign;

  void SetUp() override {
    if (no_gnuplot()) GTEST_SKIP() << "gnuplot is not installed";
    const testing::Result run = campaign.graze("run ball.yaml -n 20 --set time.end='0.3 s' --quiet -o a.graze");
    ASSERT_EQ(run.code, 0) << run.err;
  }
  testing::Result graze(const std::string& arguments) const { return campaign.graze(arguments); }
  std::string file(const std::string& name) const { return testing::read_file(campaign.folder / name); }
  void refused(const std::string& arguments, const std::vector<std::string>& parts, int code = 2) const {
    const testing::Result run = graze(arguments);
    EXPECT_EQ(run.code, code) << arguments << run.err;
    for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part)) << arguments;
  }
};

/// What an SVG file holds: its texts, a line each, and how often its plots stand in it.
struct Svg {
  std::string texts;
  int plots = 0;

  explicit Svg(const std::string& bytes) {
    tinyxml2::XMLDocument document;
    EXPECT_EQ(document.Parse(bytes.c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
    if (document.RootElement() != nullptr) walk(*document.RootElement());
  }

 private:
  void walk(const tinyxml2::XMLElement& element) {
    const std::string name = element.Name();
    const char* id = element.Attribute("id");
    plots += name == "g" && id != nullptr && std::string(id).starts_with("graze_plot_");
    if (name == "text") texts += text_of(element) + "\n";
    for (const auto* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
      walk(*child);
    }
  }
  static std::string text_of(const tinyxml2::XMLElement& element) {
    std::string out;
    for (const auto* node = element.FirstChild(); node != nullptr; node = node->NextSibling()) {
      if (node->ToText() != nullptr) out += node->Value();
      if (node->ToElement() != nullptr) out += text_of(*node->ToElement());
    }
    return out;
  }
};

// Claim: each picture is one whole SVG file named after archive and picture, with its words; the same bytes twice.
TEST_F(Plot, WritesEachPicture) {
  const std::vector<std::pair<std::string, std::string>> words = {{"success", "still"},
                                                                  {"failures", "of 20 failed"},
                                                                  {"margins", "high"},
                                                                  {"plan", "x [m]"},
                                                                  {"side", "z [m]"},
                                                                  {"isometric", "Path of the base"},
                                                                  {"lapse", "every 1 s"},
                                                                  {"channel", "Time [s]"},
                                                                  {"parameters", "initial.base.z"},
                                                                  {"survival", "of 20 violated"},
                                                                  {"tree", "no contact could be tested"},
                                                                  {"causes", "significant"}};
  for (const auto& [picture, word] : words) {
    const testing::Result run = graze("plot a.graze " + picture);
    ASSERT_EQ(run.code, 0) << picture << run.err;
    EXPECT_THAT(run.out, HasSubstr("a." + picture + ".svg: "));
    EXPECT_EQ(run.err, "") << picture;
    const std::string once = file("a." + picture + ".svg");
    const Svg svg(once);
    EXPECT_THAT(svg.texts, AllOf(HasSubstr(word), HasSubstr("Ball, 20 particles"))) << picture;
    ASSERT_EQ(graze("plot a.graze --force " + picture).code, 0);
    EXPECT_EQ(file("a." + picture + ".svg"), once) << picture;
  }
}

// Claim: `all` fills a folder, PNG and dark paper are had, and a picture has the size that was asked for.
TEST_F(Plot, WritesAllIntoAFolder) {
  const testing::Result run = graze("plot a.graze all --format png --theme dark --size 640x480 -o new/pictures");
  ASSERT_EQ(run.code, 0) << run.err;
  int count = 0;
  for (const auto& entry : testing::fs::directory_iterator(campaign.folder / "new/pictures")) {
    const std::string bytes = testing::read_file(entry.path());
    EXPECT_EQ(bytes.substr(1, 3), "PNG");
    EXPECT_EQ(bytes.substr(16, 8), std::string("\0\0\2\x80\0\0\1\xe0", 8)) << "640 x 480";
    ++count;
  }
  EXPECT_EQ(count, 12);
  ASSERT_EQ(graze("plot a.graze failures success").code, 0);
  EXPECT_TRUE(testing::fs::exists(campaign.folder / "a_plots/success.svg"));
  ASSERT_EQ(graze("plot a.graze survival -o one.png").code, 0);
  EXPECT_EQ(file("one.png").substr(1, 3), "PNG");
}

// Claim: numbers are those of the report: a bar with the score's rate for each policy.
TEST(PlotOfFamilies, HasAsManyBarsAsPolicies) {
  if (no_gnuplot()) GTEST_SKIP() << "gnuplot is not installed";
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  std::string text = testing::read_file(folder / "ball.yaml");
  const std::string one = "  still: {hold: {}, control: {torque: {}}}\n";
  text.replace(text.find(one), one.size(), one + "  idle: {hold: {}, control: {torque: {}}}\n");
  testing::write_file(folder / "ball.yaml", text);
  ASSERT_EQ(testing::graze(folder.path(), "run ball.yaml -n 8 --quiet -o a.graze").code, 0);
  ASSERT_EQ(testing::graze(folder.path(), "plot a.graze success survival -o .").code, 0);
  const Svg success(testing::read_file(folder / "success.svg"));
  EXPECT_EQ(success.plots, 1 + 2) << "the page, and a bar for each policy";
  EXPECT_THAT(success.texts, AllOf(HasSubstr("still\n"), HasSubstr("idle\n")));
  const Svg survival(testing::read_file(folder / "survival.svg"));
  EXPECT_EQ(survival.plots, 1 + 2 * 2) << "the page, and a band and a line for each policy";
}

// Claim: no picture, unknown ones, sizes, names and options that fit nothing are refused with what there is.
TEST_F(Plot, RefusesWhatItCannotDraw) {
  refused("plot a.graze", {"no PICTURE", "success, failures, margins", "or all"});
  refused("plot a.graze sucess", {"sucess", "nearest: success"});
  refused("plot success a.graze", {"the archive stands first: graze plot a.graze success"});
  refused("plot a.graze success --size 640", {"--size 640", "WIDTHxHEIGHT"});
  refused("plot a.graze success --size 1x640", {"--size"});
  refused("plot a.graze success --theme blue", {"--theme", "light"});
  refused("plot a.graze success --channel base.z", {"--channel", "channel", "not asked for"});
  refused("plot a.graze channel --channel base.zz", {"base.zz", "nearest: base."});
  refused("plot a.graze margins --requirement hight", {"hight", "nearest: high"});
  refused("plot a.graze survival --requirement hight", {"hight", "nearest: high"});
  refused("plot a.graze success --policy stil", {"nearest: still"});
  refused("plot nowhere.graze success -o x.svg", {"nowhere.graze"});
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "x.svg"));
}

// Claim: a picture takes no other file's place without --force, is no other kind of file, and lies in no archive.
TEST_F(Plot, OutputsAreGuarded) {
  testing::write_file(campaign.folder / "a.success.svg", "mine");
  refused("plot a.graze success", {"a.success.svg", "--force"});
  EXPECT_EQ(file("a.success.svg"), "mine");
  EXPECT_EQ(graze("plot a.graze success --force").code, 0);
  EXPECT_NE(file("a.success.svg"), "mine");
  refused("plot a.graze success -o a.pdf", {"a.pdf", ".svg"});
  refused("plot a.graze success failures -o b.svg", {"b.svg", "-o b"});
  refused("plot a.graze success -o b.svg --format png", {"--format png", "b.svg"});
  refused("plot a.graze success -o a.graze/x.svg", {"a.graze"});
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "b.svg"));
}

// Claim: without gnuplot, with one that fails or with one that stops half-way there is a message that names Debian's
// package, exit code 3, and no file.
TEST_F(Plot, SaysWhenThereIsNoGnuplot) {
  const auto with_path = [&](const std::string& path) {
    return testing::shell(campaign.folder.path(),
                          "PATH=" + path + " '" + GRAZE_PROGRAM + "' plot a.graze success -o new/none.svg");
  };
  testing::fs::create_directory(campaign.folder / "bin");
  const testing::Result none = with_path("bin");
  EXPECT_EQ(none.code, 3);
  EXPECT_THAT(none.err, AllOf(HasSubstr("gnuplot: is not there"), HasSubstr("gnuplot-nox")));
  for (const std::string body :
       {"echo 'line 3: unknown terminal' >&2; exit 1", "echo '<svg>'", "exit 0", "kill -9 $$"}) {
    testing::write_file(campaign.folder / "bin/gnuplot", "#!/bin/sh\n" + body + "\n");
    testing::fs::permissions(campaign.folder / "bin/gnuplot", testing::fs::perms::all);
    const testing::Result failed = with_path("\"$PWD/bin\"");
    EXPECT_EQ(failed.code, 3) << body << failed.err;
    EXPECT_THAT(failed.err, HasSubstr("gnuplot")) << body;
    if (!body.starts_with("echo 'line")) continue;
    EXPECT_THAT(failed.err, HasSubstr("unknown terminal"));
  }
  EXPECT_FALSE(testing::fs::exists(campaign.folder / "new"));
}

// Claim: names that would be commands of gnuplot's, of the shell's or of SVG are words of the picture.
TEST(PlotOfStrangers, NamesAreWords) {
  if (no_gnuplot()) GTEST_SKIP() << "gnuplot is not installed";
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  ScenarioOptions longer;
  longer.overrides = {{"time.end", "0.3 s"}};
  const Scenario scenario = load_scenario((folder / "ball.yaml").string(), longer);
  const std::string hostile =
      "'; system('touch owned'); `touch owned` @m {/Bold x}_1 %d <b>&amp; \\n \"$(touch owned)\"\n!touch "
      "owned\n\x1b[31m";
  testing::write_campaign(folder / "a.graze", scenario, 12, [&](CampaignInfo& info) {
    info.scenario_name = hostile;
    for (auto& one : info.requirements) one.name = hostile;
    for (auto& one : info.parameters) one.name = hostile + one.name;
    for (std::string& one : info.colliders) one += hostile;
  });
  const testing::Result run = testing::graze(
      folder.path(), "plot a.graze success failures margins parameters survival tree causes -o pictures");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_FALSE(testing::fs::exists(folder / "owned"));
  for (const auto& entry : testing::fs::directory_iterator(folder / "pictures")) {
    const Svg svg(testing::read_file(entry.path()));
    EXPECT_THAT(svg.texts, HasSubstr("’; system(’touch owned’); `touch owned` @m {/Bold x}_1 %d <b>&amp;"))
        << entry.path();
  }
}

// Claim: what cannot be had of an archive is refused by its reason, and left out of `all` with a warning.
TEST(PlotOfAnother, ResultsVersionHasNoPaths) {
  if (no_gnuplot()) GTEST_SKIP() << "gnuplot is not installed";
  const testing::TemporaryFolder folder;
  testing::write_ball(folder);
  const Scenario scenario = load_scenario((folder / "ball.yaml").string());
  testing::write_campaign(folder / "old.graze", scenario, 12,
                          [](CampaignInfo& info) { info.results_version = "0.0.9+abc"; });
  const testing::Result plan = testing::graze(folder.path(), "plot old.graze plan");
  EXPECT_EQ(plan.code, 2);
  EXPECT_THAT(plan.err, HasSubstr("0.0.9+abc"));
  const testing::Result all = testing::graze(folder.path(), "plot old.graze all -o pictures");
  EXPECT_EQ(all.code, 0) << all.err;
  EXPECT_THAT(all.err, AllOf(HasSubstr("without the picture plan"), HasSubstr("without the picture channel")));
  EXPECT_THAT(all.err, HasSubstr("graze: warning: without the picture tree: old.graze: has no contact phases"));
  EXPECT_TRUE(testing::fs::exists(folder / "pictures/success.svg"));
  EXPECT_FALSE(testing::fs::exists(folder / "pictures/plan.svg"));
}

}  // namespace
}  // namespace graze
