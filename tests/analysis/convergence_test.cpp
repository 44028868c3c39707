// What scores say of the contact solver: nothing that did not converge is counted in silence, and where all did there
// is nothing to read.
#include "analysis/convergence.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "analysis/compare.h"
#include "analysis/score.h"
#include "archive/schema/schema.h"
#include "tests/analysis/planted_archive.h"
#include "tests/archive/forge.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Parsed = nlohmann::json;

/// One trace of 1000 steps each, of a solver that told: sweeps, last change at most, steps that did not converge, their
/// median, steps that were braked.
struct Planted {
  Outcome outcome;
  double largest, unconverged, median, braked = 0, mean_sweeps = 3;
};

CampaignInfo facts_of(std::size_t particles, double limit) {
  CampaignInfo out = info();
  out.particles = particles;
  out.policies = {"hold"};
  out.unconverged = limit;
  return out;
}

void plant(const std::filesystem::path& path, const CampaignInfo& facts, const std::vector<Planted>& traces) {
  planted::write(path, facts, [&](std::uint32_t particle) {
    const Planted& one = traces[particle];
    TraceRecord out = planted::plain_trace(facts, 0, particle, one.outcome);
    out.violated = one.outcome == Outcome::known_failure ? 0 : -1;
    out.first_violations.assign(out.first_violations.size(), std::nan(""));
    if (out.violated == 0) out.first_violations[0] = 0.5 * out.end_time;
    out.objective_margin = one.outcome == Outcome::success ? 0.1 : -0.1;
    out.solver = {one.mean_sweeps,         60, one.largest, one.unconverged, 1000, one.median, one.braked,
                  one.braked > 0 ? 3.0 : 0};
    return out;
  });
}

const std::vector<Planted> kSome = {{Outcome::success, 9e-7, 0, 0},
                                    {Outcome::success, 0.25, 51, 1e-3},
                                    {Outcome::known_failure, 2e-6, 50, 2e-6},
                                    {Outcome::unknown_failure, 0.5, 1000, 1e-2, 7},
                                    {Outcome::invalid, 8, 60, 4},
                                    {Outcome::success, 0, 0, 0, 0, 0}};  // a back end that does not tell

// Claim: traces, steps and flags are counted by hand; a share at the limit is not above it; a flagged trace stays in
// its class.
TEST(Convergence, IsCountedByClass) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(6, 0.05), kSome);
  const Score got = score(Archive(folder / "a.graze"));
  const PolicyScore& p = got.policies.at(0);
  const Convergence& c = p.convergence;
  EXPECT_EQ(c.traces, 5u);
  EXPECT_EQ(c.steps, 5000u);
  EXPECT_EQ(c.unconverged_steps, 1161u);
  EXPECT_EQ(c.unconverged_traces, 4u);
  EXPECT_EQ(c.largest_change, 8);
  EXPECT_NEAR(c.median_change, 1e-2, 0.07 * 1e-2) << "most of such steps are of the trace whose median that is";
  EXPECT_EQ(c.braked_steps, 7u);
  EXPECT_EQ(c.braked_traces, 1u);
  EXPECT_THAT(c.flagged, ElementsAre(1, 0, 1, 1));
  EXPECT_EQ(c.flagged_valid(), 2u);
  EXPECT_EQ(c.first_flagged, 1u);
  EXPECT_EQ(p.success, 3u);
  EXPECT_EQ(p.known, 1u);
  EXPECT_EQ(p.unknown, 1u);
}

// Claim: the table has a column of flagged traces, and a line that says how many steps, of how many traces, by how
// much.
TEST(Convergence, HasItsTableAndColumn) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(6, 0.05), kSome);
  const std::string text = format_score(score(Archive(folder / "a.graze")));
  EXPECT_THAT(text, HasSubstr("95 % interval  flagged\n"));
  EXPECT_THAT(text, HasSubstr("Steps whose contacts did not converge (flagged: traces with more than 5 % of them)\n"
                              "policy  steps  unconverged  share  in traces  by (median), m/s  by (most), m/s  braked  "
                              "by (most), m/s  flagged S  flagged K  flagged U  flagged invalid  first\n"
                              "hold     5000         1161   23 %     4 of 5              0.01               8       7  "
                              "             3          1          0          1                1      1\n"));
  EXPECT_THAT(text, HasSubstr("--flagged' lists the flagged traces\n"));
}

// Claim: where every step converged there is nothing to read, but the numbers are in JSON; a back end that does not
// tell has none.
TEST(Convergence, IsQuietWhereThereIsNothing) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(2, 0), {kSome[0], kSome[0]});
  const Score none = score(Archive(folder / "a.graze"));
  EXPECT_THAT(format_score(none), Not(HasSubstr("converge")));
  EXPECT_THAT(format_score(none), Not(HasSubstr("flagged")));
  const Parsed json = Parsed::parse(score_json(none));
  EXPECT_EQ(json["unconverged_limit"], 0);
  EXPECT_EQ(json["policies"][0]["convergence"]["steps"], 2000);
  EXPECT_EQ(json["policies"][0]["convergence"]["unconverged_steps"], 0);
  EXPECT_TRUE(json["policies"][0]["convergence"]["largest_change"].is_null());
  EXPECT_TRUE(json["policies"][0]["convergence"]["flagged"]["first_particle"].is_null());
  plant(folder / "b.graze", facts_of(1, 0), {kSome[5]});
  EXPECT_TRUE(Parsed::parse(score_json(score(Archive(folder / "b.graze"))))["policies"][0]["convergence"].is_null());
}

// Claim: JSON has every number, and which failures are flagged; the list of failures has a column where some are.
TEST(Convergence, IsInJsonAndInTheListOfFailures) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(6, 0.05), kSome);
  const Archive archive(folder / "a.graze");
  const Parsed json = Parsed::parse(score_json(score(archive))), c = json["policies"][0]["convergence"];
  EXPECT_EQ(json["unconverged_limit"], 0.05);
  EXPECT_EQ(c["unconverged_steps"], 1161);
  EXPECT_EQ(c["largest_change"], 8);
  EXPECT_EQ(c["most_braked"], 3);
  EXPECT_EQ(c["flagged"], Parsed({{"all", 3},
                                  {"success", 1},
                                  {"known_failure", 0},
                                  {"unknown_failure", 1},
                                  {"invalid", 1},
                                  {"first_particle", 1}}));
  std::ostringstream all;
  list_traces_json(archive, Listed::failures, {"hold"}, "a", all);
  const Parsed failures = Parsed::parse("[" + all.str() + "]");
  ASSERT_EQ(failures.size(), 3u);
  EXPECT_EQ(failures[0]["unconverged"], 0.05);
  EXPECT_EQ(failures[0]["flagged"], false);
  EXPECT_EQ(failures[1]["unconverged"], 1);
  EXPECT_EQ(failures[1]["flagged"], true);
  std::ostringstream with, without;
  list_traces(archive, Listed::failures, {"hold"}, "a", true, with);
  list_traces(archive, Listed::failures, {"hold"}, "a", false, without);
  EXPECT_THAT(with.str(), HasSubstr("flagged  replay\n"));
  EXPECT_THAT(with.str(), HasSubstr("  100 %    graze replay a --particle 3"));
  EXPECT_THAT(without.str(), Not(HasSubstr("flagged")));
}

// Claim: every flagged trace is listed, successes among them, each with its replay command; no other is.
TEST(Convergence, FlaggedTracesAreListedWhateverBecameOfThem) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(6, 0.05), kSome);
  const Archive archive(folder / "a.graze");
  std::ostringstream text, json;
  list_traces(archive, Listed::flagged, {"hold"}, "a", true, text);
  list_traces_json(archive, Listed::flagged, {"hold"}, "a", json);
  const Parsed all = Parsed::parse("[" + json.str() + "]");
  ASSERT_EQ(all.size(), 3u);
  const std::vector<std::pair<int, std::string>> want = {{1, "success"}, {3, "unknown failure"}, {4, "invalid"}};
  for (std::size_t i = 0; i < want.size(); ++i) {
    EXPECT_EQ(all[i]["particle"], want[i].first);
    EXPECT_EQ(all[i]["outcome"], want[i].second);
    EXPECT_EQ(all[i]["flagged"], true);
    EXPECT_EQ(all[i]["replay"], replay_command("a", "hold", static_cast<std::uint32_t>(want[i].first)));
    EXPECT_THAT(text.str(), HasSubstr(all[i]["replay"].get<std::string>() + "\n"));
  }
  EXPECT_THAT(text.str(), HasSubstr("success"));
  std::size_t listed = 0;
  for (std::size_t at = text.str().find("graze replay"); at != std::string::npos; ++listed) {
    at = text.str().find("graze replay", at + 1);
  }
  EXPECT_EQ(listed, 3u);
}

// Claim: replay and score tell the same numbers by the same names.
TEST(Convergence, HasTheSameNamesForOneTraceAndForAll) {
  const Parsed one = solver_json({3, 70, 0.4, 12, 3000, 2e-4, 1, 0.3}, 0.05);
  ConvergenceSum sum;
  sum.add(7, Outcome::success, {3, 70, 0.4, 12, 3000, 2e-4, 1, 0.3}, false);
  const Parsed all = convergence_json(sum.total());
  for (const char* name : {"steps", "unconverged_steps", "largest_change", "braked_steps", "most_braked"}) {
    EXPECT_EQ(one.at(name).get<double>(), all.at(name).get<double>()) << name;
  }
  EXPECT_NEAR(one.at("median_change").get<double>(), all.at("median_change").get<double>(), 0.07 * 2e-4);
  EXPECT_TRUE(convergence_json({}).is_null());
}

// Claim: in a sentence, as explain has it, stands all that the table says of a policy; where all converged there is
// none.
TEST(Convergence, IsASentenceOfAPolicy) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(6, 0.05), kSome);
  const Score got = score(Archive(folder / "a.graze"));
  EXPECT_EQ(
      convergence_sentence(got.policies[0].convergence, got.unconverged),
      "contacts of 1161 of 5000 steps (23 %), in 4 of 5 traces, did not converge, by 0.01 m/s at the median and 8 "
      "m/s at most; 7 of 5000 steps (0.14 %) were braked, by 3 m/s at most; 3 traces are FLAGGED (more than 5 % "
      "of them): 1 S, 0 K, 1 U, 1 invalid");
  plant(folder / "b.graze", facts_of(1, 0), {kSome[0]});
  EXPECT_EQ(convergence_sentence(score(Archive(folder / "b.graze")).policies[0].convergence, 0), "");
}

// Claim: of two campaigns each has its line and its limit, and of who was fixed or broke it is told which are flagged
// in which.
TEST(Convergence, OfTwoCampaignsIsCompared) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(3, 0.05), {{Outcome::known_failure, 0.1, 60, 0.01}, kSome[0], kSome[0]});
  plant(folder / "b.graze", facts_of(3, 0.02),
        {{Outcome::success, 0.2, 30, 0.02}, {Outcome::known_failure, 0.1, 20, 0.01}, kSome[0]});
  const Comparison got =
      compare_campaigns(Archive(folder / "a.graze"), Archive(folder / "b.graze"), {"a", "b", {}, "", ""});
  const std::string text = format_comparison(got, 5);
  EXPECT_THAT(text, HasSubstr("(flagged: traces with more than 5 % of them in A, more than 2 % of them in B)\n"));
  EXPECT_THAT(text, HasSubstr("\nhold, A   3000           60 "));
  EXPECT_THAT(text, HasSubstr("\nhold, B   3000           50 "));
  EXPECT_THAT(text, HasSubstr("success  A, B     graze replay b --particle 0"));
  EXPECT_THAT(changes_csv(got),
              HasSubstr("hold,hold,0,fixed,upright,success,1,1\nhold,hold,1,broken,success,upright,0,0\n"));
  const Parsed json = Parsed::parse(comparison_json(got));
  EXPECT_EQ(json["policies"][0]["b"]["convergence"]["flagged"]["success"], 1);
  EXPECT_EQ(json["b"]["unconverged_limit"], 0.02);
  EXPECT_EQ(json["policies"][0]["fixed"][0]["flagged"]["a"], true);
}

// Claim: of an older archive, which does not know medians, all else is told.
TEST(Convergence, OfOlderArchivesIsToldAsFarAsItIsKnown) {
  const Folder folder;
  plant(folder / "a.graze", facts_of(6, 0.05), kSome);
  pack(folder / "a.graze", folder / "a.h5", false);
  const auto older = [](hid_t f) { hdf5::check(H5Ldelete(f, "traces/hold/convergence", H5P_DEFAULT), "drop"); };
  CampaignInfo facts = facts_of(6, 0.05);
  facts.tells_convergence = false;
  publish_hdf5(folder / "older.h5", true, [&](const hdf5::Handle& out) {
    const hdf5::Handle in = hdf5::open_for_reading(folder / "a.h5");
    for (const std::string& name : hdf5::links(in.id(), ".")) {
      hdf5::check(H5Ocopy(in.id(), name.c_str(), out.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), name);
    }
    write_info_attributes(out, facts, Layout::packed, true);
    older(out.id());
  });
  const Score got = score(Archive(folder / "older.h5"));
  const Convergence& c = got.policies.at(0).convergence;
  EXPECT_EQ(c.unconverged_steps, 1161u);
  EXPECT_GT(c.steps, 0u);
  EXPECT_TRUE(std::isnan(c.median_change));
  EXPECT_EQ(c.braked_steps, 0u);
  EXPECT_TRUE(Parsed::parse(score_json(got))["policies"][0]["convergence"]["median_change"].is_null());
}

// Claim: of one trace it is a line, with a mark where it is flagged.
TEST(Convergence, OfOneTraceIsALine) {
  EXPECT_EQ(solver_lines({3, 60, 9e-7, 0, 1000, 0, 0, 0}, 0), "");
  const SolverLog log = {3, 60, 0.4, 12, 3000, 2e-4, 1, 0.3};
  EXPECT_EQ(
      solver_lines(log, 0.05),
      "contact    12 of 3000 steps (0.4 %) did not converge; last change 0.0002 m/s at the median, 0.4 m/s at most\n"
      "contact    1 of 3000 steps (0.033 %) were braked, by 0.3 m/s at most\n");
  EXPECT_THAT(solver_lines(log, 0.001), HasSubstr("FLAGGED    more than 0.1 % of its steps did not converge"));
  EXPECT_EQ(solver_json(log, 0.001)["flagged"], true);
  EXPECT_TRUE(solver_json({}, 0).is_null());
}

}  // namespace
}  // namespace graze
