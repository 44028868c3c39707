// The data of reports: what comes from archives alone.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <set>

#include "analysis/report_data.h"
#include "analysis/report_families.h"
#include "analysis/report_margins.h"
#include "sampling/constants.h"
#include "tests/archive/compare.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::HasSubstr;
using ::testing::Not;

CampaignInfo report_facts() {
  CampaignInfo facts = info();
  facts.particles = 200;
  return facts;
}

std::string bytes_of(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6u | static_cast<std::uint32_t>(digits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    out += static_cast<char>(bits >> static_cast<unsigned>(count) & 255u);
  }
  return out;
}

// Claim: base64 is that of RFC 4648 (its own test vectors).
TEST(ReportNumbers, Base64) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\x00"), "//4=") << "a literal ends at its zero";
}

// Claim: a packed number is within half a step of what it was; ends of the range are exact; what is not finite is
// nothing; one value, none, and the largest range do no harm.
TEST(ReportNumbers, PackedNumbersAreNearWhatTheyWere) {
  const double huge = std::numeric_limits<double>::max();
  const std::vector<std::vector<double>> columns = {{1, 2, 3, kNaN, 2.5, std::numeric_limits<double>::infinity()},
                                                    {-1e-9, 1e9, 17},
                                                    {7, 7},
                                                    {kNaN},
                                                    {},
                                                    {-huge / 2, 0, huge / 2}};
  for (const std::vector<double>& values : columns) {
    const Json json = numbers(values, NumberForm::packed);
    ASSERT_EQ(json["n"], values.size());
    const std::string bytes = bytes_of(json["u16"]);
    ASSERT_EQ(bytes.size(), 2 * values.size());
    const double low = json["lo"], high = json["hi"], step = high / 65534 - low / 65534;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int code = static_cast<unsigned char>(bytes[2 * i]) + 256 * static_cast<unsigned char>(bytes[2 * i + 1]);
      EXPECT_EQ(code == 65535, !std::isfinite(values[i]));
      if (code == 65535) continue;
      const double read = code == 65534 ? high : low + code * step;  // as the page reads it
      EXPECT_LE(std::abs(read - values[i]), 0.5001 * step);
      EXPECT_TRUE(values[i] != low || code == 0);
    }
  }
}

TEST(ReportNumbers, PlainNumbersHaveSixDigits) {
  EXPECT_EQ(numbers(std::vector<double>{1.0 / 3, kNaN, 12345678, 0}, NumberForm::plain).dump(),
            "[0.333333,null,12345700.0,0.0]");
}

// Claim: whatever an archive holds as a name, the data neither end the script element that they stand in nor begin a
// comment, and are the same data.
TEST(ReportData, CannotLeaveTheirElement) {
  const Json data = {{"</script><!--", "a & b \"'<>]]> \xff"}};
  const std::string text = script_json(data);
  for (const char* never : {"<", ">", "&", "\xff"}) EXPECT_THAT(text, Not(HasSubstr(never)));
  EXPECT_EQ(Json::parse(text), (Json{{"</script><!--", "a & b \"'<>]]> \xef\xbf\xbd"}}));
}

// Claim: policies that `over` made are a family with its keys, units and values; a mixture of units and words is none
// of numbers; what does not read is nothing.
TEST(ReportFamilies, AreThoseOfTheScenario) {
  CampaignInfo info;
  info.scenario_text =
      "policies: {step: {over: {gait.step_height: [1 cm, 2 cm], gait.duty: [50 %, 75 %]}}, still: {},\n"
      " mixed: {over: {a.b: [1 cm, fast]}}, wave: {over: {c.rate: [1 rad/s, 2 rad/s]}}}";
  const std::vector<std::string> policies = {"step/1cm/50%", "step/2cm/50%", "step/2cm/75%", "still",
                                             "mixed/1cm",    "mixed/fast",   "wave/1rad_s",  "wave/2rad_s"};
  const std::vector<PolicyFamily> got = policy_families(info, policies);
  ASSERT_EQ(got.size(), 3u);
  EXPECT_EQ(got[0].name, "step");
  ASSERT_EQ(got[0].axes.size(), 2u);
  EXPECT_EQ(got[0].axes[0].key, "gait.step_height");
  EXPECT_EQ(got[0].axes[0].unit, "cm");
  EXPECT_EQ(got[0].axes[1].unit, "%");
  ASSERT_EQ(got[0].members.size(), 3u);
  EXPECT_EQ(got[0].members[2].policy, "step/2cm/75%");
  EXPECT_EQ(got[0].members[2].values, (std::vector<double>{2, 75}));
  EXPECT_FALSE(got[1].axes[0].numeric);
  EXPECT_EQ(got[1].members[1].values, std::vector<double>{1});
  EXPECT_EQ(got[2].axes[0].unit, "rad/s");
  EXPECT_TRUE(got[2].axes[0].numeric);
  info.scenario_text = "{";
  EXPECT_TRUE(policy_families(info, policies).empty());
}

// Claim: the ways to fail count every failed trace once, and each names the earliest, the worst and a median one.
TEST(ReportFailures, WaysAreThoseOfTheRecords) {
  const Folder folder;
  const CampaignInfo want = report_facts();
  write(folder / "a.graze", want);
  const std::vector<FailureWay> ways = failure_ways(Archive(folder / "a.graze"), want.policies);
  for (int policy = 0; policy < 3; ++policy) {
    std::uint64_t failed = 0, counted = 0;
    for (std::uint32_t i = 0; i < want.particles; ++i) failed += trace(want, policy, i).outcome != Outcome::success;
    for (const FailureWay& way : ways) {
      if (way.policy != want.policies[static_cast<std::size_t>(policy)]) continue;
      counted += way.traces;
      for (const std::uint32_t particle : {way.earliest_particle, way.worst_particle, way.typical_particle}) {
        EXPECT_EQ(trace(want, policy, particle).outcome, way.outcome);
      }
      const TraceRecord earliest = trace(want, policy, way.earliest_particle);
      EXPECT_EQ(way.earliest, earliest.end_time) << "the synthetic traces end at their violation";
    }
    EXPECT_EQ(counted, failed);
  }
}

// Claim: margins of all valid traces are in the histograms, each once per requirement, and 0 is an edge where margins
// have both signs.
TEST(ReportMargins, CountEveryValidTrace) {
  const Folder folder;
  const CampaignInfo want = report_facts();
  write(folder / "a.graze", want);
  const Archive archive(folder / "a.graze");
  const ReportSample sample = sample_traces(archive, want.policies, 60);  // of which the range is taken
  ASSERT_LT(sample.count, want.particles);
  for (const MarginHistogram& one : margin_histograms(archive, sample)) {
    const auto& edges = one.edges;
    ASSERT_TRUE(std::is_sorted(edges.begin(), edges.end()));
    EXPECT_LE(edges.size(), 44u);
    if (edges.front() < 0 && edges.back() > 0) {
      EXPECT_EQ(std::count(edges.begin(), edges.end(), 0.0), 1);
    }
    for (std::size_t p = 0; p < 3; ++p) {
      std::array<std::uint64_t, 3> want_of{}, got{};
      for (std::uint32_t i = 0; i < want.particles; ++i) {
        const TraceRecord record = trace(want, static_cast<int>(p), i);
        if (record.outcome != Outcome::invalid) ++want_of[static_cast<std::size_t>(record.outcome)];
      }
      for (const auto& bin : one.policies[p].bins) {
        for (std::size_t k = 0; k < 3; ++k) got[k] += bin[k];
      }
      EXPECT_EQ(got[0] + got[1] + got[2] + one.policies[p].unjudged, want_of[0] + want_of[1] + want_of[2]) << one.name;
    }
  }
}

// Claim: margins that are all the same lie in a bin that is to be seen, within a tenth of what they are.
TEST(ReportMargins, AllTheSameHaveABar) {
  const Folder folder;
  const CampaignInfo want = report_facts();
  write(folder / "a.graze", want);
  const Archive archive(folder / "a.graze");
  for (const double same : {0.02, -3.0}) {
    ReportSample sample = sample_traces(archive, want.policies, 60);
    for (SampledTraces& traces : sample.policies) std::fill(traces.objective.begin(), traces.objective.end(), same);
    const std::vector<double> edges = margin_histograms(archive, sample).back().edges;
    EXPECT_NEAR(edges.back() - edges.front(), 0.1 * std::abs(same), 0.01 * std::abs(same));
    EXPECT_LT(edges.front(), same);
    EXPECT_GT(edges.back(), same);
  }
}

// Claim: which traces are shown depends on the archive alone, not on how it lies on the disk; each is there once, every
// policy gets its turn, and the first of a policy is a success if it has one.
TEST(ReportChoice, DependsOnTheArchiveAlone) {
  const Folder folder;
  const CampaignInfo want = report_facts();
  write(folder / "a.graze", want);
  pack(folder / "a.graze", folder / "a.h5", false);
  std::vector<std::vector<ChosenTrace>> got;
  for (const char* name : {"a.graze", "a.h5"}) {
    const Archive archive(folder / name);
    got.push_back(choose_traces(failure_ways(archive, want.policies), sample_traces(archive, want.policies), want, 40));
  }
  ASSERT_EQ(got[0].size(), 40u);
  ASSERT_EQ(got[1].size(), 40u);
  std::set<std::pair<std::string, std::uint32_t>> seen;
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(got[0][i].policy, got[1][i].policy);
    EXPECT_EQ(got[0][i].particle, got[1][i].particle);
    EXPECT_EQ(got[0][i].policy, want.policies[i % 3]);
    EXPECT_TRUE(seen.emplace(got[0][i].policy, got[0][i].particle).second);
  }
  for (int policy = 0; policy < 3; ++policy) {
    EXPECT_EQ(trace(want, policy, got[0][static_cast<std::size_t>(policy)].particle).outcome, Outcome::success);
  }
}

// Claim: the data have the score as score_json() says it, bit by bit.
TEST(ReportData, HoldTheScore) {
  const Folder folder;
  write(folder / "a.graze", report_facts());
  const Archive archive(folder / "a.graze");
  const ReportInput input = read_report(archive, "a.graze", archive.info().policies);
  const Json data = Json::parse(report_data(archive, input, NumberForm::packed).dump());
  EXPECT_EQ(data["score"], Json::parse(score_json(score(archive, "a.graze"))));
}

}  // namespace
}  // namespace graze
