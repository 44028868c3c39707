// Claim: every trace of an archive can be had again, bit for bit, from the archive alone; what is not the archive's is
// told; and what is exported is the trace.
#include "jobs/campaign/replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "analysis/failure_table.h"
#include "archive/hdf5/hdf5.h"
#include "jobs/campaign/campaign.h"
#include "jobs/campaign/describe_campaign.h"
#include "simulation/results_epoch.h"
#include "tests/archive/tables.h"
#include "tests/jobs/program.h"
#include "tests/jobs/replay_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::Balls;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::read_csv;
using testing::request;
using testing::row;
using testing::table;
using testing::TemporaryFolder;
using testing::write_campaign;
namespace fs = std::filesystem;

/// The curb on a back end, cut short; traces end one by one, so that lanes are refilled in the middle of others'
/// traces.
Scenario curb_on(const std::string& physics, const std::string& stop_at_violation) {
  ScenarioOptions options;
  options.overrides = {{"physics", physics},
                       {"time.end", "60 ms"},
                       {"time.control", "2 ms"},
                       {"record", "{telemetry: all, every: 1, events: true}"},
                       {"task.stop_at_violation", stop_at_violation},
                       {"task.requirements.level", "{height: {link: BODY0, above: 17.5 cm}}"}};
  if (physics == "bullet") options.overrides.push_back({"uncertain.contact.model", "{choice: [dantzig]}"});
  return load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
}

/// Replays all traces of some policies; each must be the archive's, and its frames those that the archive recorded.
void expect_replays(const Scenario& scenario, const fs::path& archive, const std::vector<std::string>& policies,
                    std::uint32_t particles) {
  const Archive whole(archive);
  for (const std::string& policy : policies) {
    for (std::uint32_t i = 0; i < particles; ++i) {
      SCOPED_TRACE(policy + ", particle " + std::to_string(i));
      const Replay got = replay(request(archive, i, policy));
      ASSERT_TRUE(got.verified()) << (got.differences.empty() ? "" : got.differences[0]);
      EXPECT_EQ(got.file.trace.events.size(), got.archived->events.size());
      const std::vector<TelemetryFrame> frames = whole.telemetry(policy, i);
      ASSERT_EQ(frames.size(), got.file.log.time.size());
      for (std::size_t k = 0; k < frames.size(); ++k) {
        ASSERT_EQ(frames[k].time, got.file.log.time[k]);
        ASSERT_EQ(frames[k].q, row(table(got.file.log, "q"), k));
        ASSERT_EQ(frames[k].v, row(table(got.file.log, "v"), k));
        ASSERT_EQ(frames[k].tau, row(table(got.file.log, "tau"), k));
      }
    }
  }
  EXPECT_EQ(scenario.policies.size(), whole.info().policies.size());
}

TEST(Replay, GivesTheBitsOfALaneCampaign) {
  const TemporaryFolder folder;
  const Scenario scenario = curb_on("lanes", "true");
  write_campaign(folder / "a.graze", scenario, 21);
  std::set<double> ends;
  for (const double end : table_of(Archive(folder / "a.graze"), "step/4cm").end_time) ends.insert(end);
  EXPECT_GT(ends.size(), 3u) << "the traces are meant to end at different times";
  expect_replays(scenario, folder / "a.graze", {"step/1cm", "step/4cm"}, 21);
}

TEST(Replay, GivesTheBitsOfABulletCampaign) {
  const TemporaryFolder folder;
  const Scenario scenario = curb_on("bullet", "true");
  write_campaign(folder / "a.graze", scenario, 19);
  expect_replays(scenario, folder / "a.graze", {"step/4cm"}, 19);
}

TEST(Replay, ReadsPackedArchivesAndGoesOnAfterViolations) {
  const TemporaryFolder folder;
  const Scenario scenario = curb_on("lanes", "false");
  write_campaign(folder / "a.graze", scenario, 9);
  pack(folder / "a.graze", folder / "a.h5", false);
  expect_replays(scenario, folder / "a.h5", {"step/3cm"}, 9);
}

// Ground that is drawn for each particle comes back by the particle's values, under both back ends.
TEST(Replay, GivesTheBitsOverDrawnGround) {
  for (const char* physics : {"lanes", "bullet"}) {
    const TemporaryFolder folder;
    ScenarioOptions options;
    options.overrides = {{"physics", physics},
                         {"time.end", "30 ms"},
                         {"record", "{telemetry: all, every: 1, events: true}"},
                         {"environment.ground.heightfield.spectrum.rms", "{uniform: [5 mm, 10 mm]}"}};
    const Scenario scenario = load_scenario(testing::data("scenarios/quadruped_rough.yaml"), options);
    write_campaign(folder / "a.graze", scenario, 6);
    expect_replays(scenario, folder / "a.graze", {"walk/3cm"}, 6);
  }
}

// A Latin hypercube's particle depends on how many there are: the archive tells.
TEST(Replay, KnowsTheSizeOfALatinHypercube) {
  const TemporaryFolder folder;
  testing::write_ball(folder, "sampling: {design: latin_hypercube}\n");
  write_campaign(folder / "a.graze", load_scenario((folder / "ball.yaml").string()), 30);
  EXPECT_TRUE(replay(request(folder / "a.graze", 29, "still")).verified());
  EXPECT_THAT(testing::graze(folder.path(), "replay a.graze --particle 30 --unverified").err,
              AllOf(HasSubstr("has particles 0 to 29"), Not(HasSubstr("--unverified"))));
}

// The witnesses of a replay are those that its trace was judged by.
TEST(Replay, WitnessesGiveTheMargins) {
  const TemporaryFolder folder;
  const Scenario scenario = curb_on("lanes", "false");
  write_campaign(folder / "a.graze", scenario, 3);
  const Replay got = replay(request(folder / "a.graze", 2, "step/4cm"));
  const FrameTable& witnesses = table(got.file.log, "requirements");
  std::vector<double> least = row(witnesses, 0);
  for (std::size_t k = 0; k < got.file.log.time.size(); ++k) {
    const std::vector<double> now = row(witnesses, k);
    for (std::size_t i = 0; i < now.size(); ++i) least[i] = std::min(least[i], now[i]);
  }
  EXPECT_EQ(least, got.archived->margins);
  const std::size_t last = got.file.info.deciding() - 1;  // measures stand behind it
  EXPECT_EQ(witnesses.columns.at(last).name, "level");
  EXPECT_EQ(witnesses.columns.at(last).unit, "m");
  EXPECT_EQ(witnesses.columns.back().unit, "N s");
}

// Contacts stand beside the frames in which they act: where an event says that a part touches, a contact of it begins.
TEST(Replay, ContactsAgreeWithEvents) {
  const TemporaryFolder folder;
  write_campaign(folder / "a.graze", curb_on("lanes", "false"), 2);
  const Replay got = replay(request(folder / "a.graze", 1, "step/4cm"));
  const StepLog& log = got.file.log;
  int begun = 0;
  for (const Event& event : got.file.trace.events) {
    if (event.kind != EventKind::contact_begin) continue;
    const auto frame = static_cast<std::uint32_t>(std::ceil(event.time / got.file.info.step - 1e-9));
    bool before = false, now = false;
    for (std::size_t i = 0; i < log.contacts.size(); ++i) {
      const bool same = log.contacts[i].a == event.a && log.contacts[i].b == event.b;
      now = now || (same && log.contact_frame[i] == frame);
      before = before || (same && log.contact_frame[i] + 1 == frame);
    }
    EXPECT_TRUE(now) << event.time;
    EXPECT_FALSE(before) << event.time;
    ++begun;
  }
  EXPECT_GT(begun, 4);
}

TEST(Replay, TellsTheTraceInWords) {
  const Balls balls;
  const testing::Result got = balls.graze("replay a.graze --particle 7 --policy still");
  EXPECT_EQ(got.code, 0) << got.err;
  EXPECT_THAT(got.out, AllOf(HasSubstr("Ball: particle 7 under policy still"), HasSubstr("the same trace, bit for bit"),
                             HasSubstr("initial.base.z"), HasSubstr("std from mean"), HasSubstr("high")));
  EXPECT_EQ(balls.graze("replay a.graze --particle 7").out, got.out) << "the only policy need not be named";
}

TEST(Replay, JsonHasEverything) {
  const Balls balls;
  const testing::Result got = balls.graze("replay a.graze --particle 7 --json -o a.h5");
  const auto json = nlohmann::json::parse(got.out);
  EXPECT_EQ(json["verification"]["verdict"], "identical");
  EXPECT_EQ(json["verification"]["digest"], json["verification"]["archived_digest"]);
  EXPECT_EQ(json["parameters"].size(), 2u);
  EXPECT_EQ(json["requirements"][0]["name"], "high");
  EXPECT_EQ(json["exported"], nlohmann::json::array({"a.h5"}));
}

/// A ball that violates a requirement at its start, so that a measure of the whole trace cannot be decided.
const char* const kCutBall =
    "-n 4 --set task.requirements.high.height.above='10 m' --set 'task.measures={calm: {speed: {link: ball, below: 90 "
    "m/s}}, early: {speed: {link: ball, below: 90 m/s}, window: [0 s, 0 s]}, slow: {height: {link: ball, above: 1 "
    "m}}}'";

// Claim: what is told and exported of measures says that they are measures, and whether they were kept: not so far as a
// trace went that a violation ended.
TEST(Replay, MarksMeasuresAndWhatCameOfThem) {
  const Balls balls("", kCutBall);
  const testing::Result got = balls.graze("replay a.graze --particle 3 -o out.csv");
  ASSERT_EQ(got.code, 0) << got.err;
  EXPECT_THAT(got.out, AllOf(HasSubstr("steps of 0.001 s; the violation ended it before its 0.05 s"),
                             HasSubstr("not met, the trace was cut short, margin ")));
  EXPECT_THAT(got.out, AllOf(ContainsRegex("calm .* undecided +measure: "), Not(ContainsRegex("early .*undecided"))));
  EXPECT_THAT(testing::read_file(balls.folder / "out.trace.csv"),
              AllOf(HasSubstr("is_measure.high,no,\n"), HasSubstr("is_measure.calm,yes,\n"),
                    HasSubstr("kept.calm,undecided,\n"), HasSubstr("kept.early,yes,\n"), HasSubstr("kept.slow,no,\n"),
                    Not(HasSubstr("kept.high"))));
  const auto json = nlohmann::json::parse(balls.graze("replay a.graze --particle 3 --json -o out.h5").out);
  EXPECT_EQ(json["requirements"][1]["kept"], "undecided");
  EXPECT_TRUE(json["requirements"][0]["kept"].is_null());
  const hdf5::Lock lock;
  const hdf5::Handle file = hdf5::open_for_reading(balls.folder / "out.h5");
  EXPECT_THAT(hdf5::read_strings(file.id(), "requirements/kept"), ElementsAre("", "undecided", "yes", "no"));
  const auto bytes = fs::file_size(balls.folder / "out.h5");
  EXPECT_THAT(hdf5::read_column<std::uint8_t>(file.id(), "requirements", {"measure", hdf5::Type::u8}, bytes),
              ElementsAre(0, 1, 1, 1));
}

// Claim: of what no step was judged by it is said so, in words and not as an infinite margin.
TEST(Replay, WhatWasNeverJudgedIsSaidSo) {
  const Balls balls(
      "",
      "-n 2 --set task.requirements.high.height.above='10 m' --set 'task.requirements.late={height: {link: "
      "ball, above: 0}, window: [2, 3]}' --set 'task.objective={low: {height: {link: ball, below: 1}, once: "
      "true, window: [20 ms, 40 ms]}}'");
  const testing::Result got = balls.graze("replay a.graze --particle 1");
  ASSERT_EQ(got.code, 0) << got.err;
  EXPECT_THAT(got.out, AllOf(ContainsRegex("late +never judged"), HasSubstr("; it was never judged"),
                             Not(ContainsRegex("[^a-z]inf[^a-z]"))));
  EXPECT_THAT(balls.graze("score a.graze").out, Not(ContainsRegex("[^a-z]inf[^a-z]")));
}

// Claim: parameters are compared in standard deviations of their own distribution, from its mean: wherever the nominal
// value lies, a uniform one is never farther out than sqrt(3), and its end is nearly so.
TEST(Replay, MeasuresUniformSpreadsByTheirOwnDistribution) {
  const Balls balls("", "-n 40 --set 'uncertain.control.lag={uniform: [0 s, 10 ms]}'");
  double farthest = 0;
  for (int particle = 0; particle < 40; ++particle) {
    const auto json =
        nlohmann::json::parse(balls.graze("replay a.graze --json --particle " + std::to_string(particle)).out);
    for (const auto& parameter : json["parameters"]) {
      if (parameter["name"].get<std::string>() != "control.lag") continue;
      EXPECT_NEAR(parameter["deviations"], (parameter["value"].get<double>() - 5e-3) / (10e-3 / std::sqrt(12.0)), 1e-9);
      farthest = std::max(farthest, std::abs(parameter["deviations"].get<double>()));
    }
  }
  EXPECT_GT(farthest, 1.5);
  EXPECT_LE(farthest, std::sqrt(3.0));
}

TEST(Replay, MisspeltThingsAreNamed) {
  const Balls balls;
  const auto refusal = [&](const std::string& arguments) {
    const testing::Result got = balls.graze("replay a.graze " + arguments);
    EXPECT_EQ(got.code, 2);
    return got.err;
  };
  EXPECT_THAT(refusal("--particle 3 --policy stil"), HasSubstr("nearest: still"));
  EXPECT_THAT(refusal("--particle 12"), AllOf(HasSubstr("particles 0 to 11"), HasSubstr("--unverified")));
  const testing::Result other = balls.graze("replay a.graze --particle 12 --unverified");
  EXPECT_EQ(other.code, 0);
  EXPECT_THAT(other.out, HasSubstr("NOT VERIFIED"));
}

// An archive whose digest says something else is told apart, loudly, with what differs.
TEST(Replay, AForgedDigestIsFound) {
  const TemporaryFolder folder;
  testing::write_ball(folder);
  const Scenario scenario = load_scenario((folder / "ball.yaml").string());
  write_campaign(
      folder / "a.graze", scenario, 9, [](CampaignInfo&) {},
      [](TraceRecord& trace) {
        if (trace.particle == 4) trace.digest ^= 1;
        if (trace.particle == 5) trace.margins[0] += 1;
      });
  EXPECT_EQ(testing::graze(folder.path(), "replay a.graze --particle 3").code, 0);
  const testing::Result forged = testing::graze(folder.path(), "replay a.graze --particle 4 -o four.h5");
  EXPECT_EQ(forged.code, 1);
  EXPECT_THAT(forged.out, HasSubstr("DIFFERENT"));
  EXPECT_THAT(forged.err, AllOf(HasSubstr("ANOTHER WAY"), HasSubstr("digest: 0x"), HasSubstr("in the archive")));
  const Replay margin = replay(request(folder / "a.graze", 5, "still"));
  ASSERT_EQ(margin.differences.size(), 1u);
  EXPECT_THAT(margin.differences[0], HasSubstr("margin of high"));
}

// What the programs were built with stands in the message when bits differ, and nowhere else in words.
TEST(Replay, TellsOfAnotherBuildWhenTheTraceDiffers) {
  const TemporaryFolder folder;
  testing::write_ball(folder);
  const Scenario scenario = load_scenario((folder / "ball.yaml").string());
  write_campaign(
      folder / "a.graze", scenario, 4, [](CampaignInfo& info) { info.build.c_library = "musl 1.2.3"; },
      [](TraceRecord& trace) {
        if (trace.particle == 2) trace.digest ^= 1;
      });
  const testing::Result same = testing::graze(folder.path(), "replay a.graze --particle 1");
  EXPECT_EQ(same.code, 0) << same.err;
  EXPECT_THAT(same.out, Not(HasSubstr("musl")));
  const testing::Result other = testing::graze(folder.path(), "replay a.graze --particle 2");
  EXPECT_EQ(other.code, 1);
  const std::string here = build_facts().c_library;
  EXPECT_THAT(other.out, HasSubstr("built with c_library: 'musl 1.2.3' there, '" + here + "' here"));
  EXPECT_THAT(other.err, HasSubstr("another program (c_library: 'musl 1.2.3' there"));
  const auto json = nlohmann::json::parse(testing::graze(folder.path(), "replay a.graze --particle 1 --json").out);
  EXPECT_EQ(json["verification"]["archived_build"]["c_library"], "musl 1.2.3");
  EXPECT_EQ(json["verification"]["build"]["c_library"], here);
}

TEST(Replay, AnotherVersionIsRefusedUnlessAskedFor) {
  const TemporaryFolder folder;
  testing::write_ball(folder);
  const Scenario scenario = load_scenario((folder / "ball.yaml").string());
  write_campaign(folder / "old.graze", scenario, 4, [](CampaignInfo& info) { info.results_version = "0.0.9+abc"; });
  const testing::Result refused = testing::graze(folder.path(), "replay old.graze --particle 1");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("0.0.9+abc"), HasSubstr(results_version()), HasSubstr("--any-version")));
  const testing::Result anyway = testing::graze(folder.path(), "replay old.graze --particle 1 --any-version");
  EXPECT_EQ(anyway.code, 0);
  EXPECT_THAT(anyway.out, AllOf(HasSubstr("0.0.9+abc"), HasSubstr("bit for bit")));

  write_campaign(folder / "older.graze", scenario, 4, [](CampaignInfo& info) { info.source = {}; });
  const testing::Result older = testing::graze(folder.path(), "replay older.graze --particle 1 --any-version");
  EXPECT_EQ(older.code, 2);
  EXPECT_THAT(older.err, HasSubstr("did not keep the scenario's files; it cannot be replayed"));
}

// A particle that cannot be fabricated is replayed as what it is: the reason, and an export without frames.
TEST(Replay, ExplainsAParticleThatCouldNotBeFabricated) {
  TemporaryFolder folder;
  std::string text = testing::ball_scenario();
  text.replace(text.find("{normal: {std: 2%}}"), 19, "{choice: [200, 1e-323]}");
  testing::write_file(folder / "ball.urdf", testing::kBallUrdf);
  testing::write_file(folder / "ball.yaml", text);
  ASSERT_EQ(testing::graze(folder.path(), "run ball.yaml --quiet -n 20 -o a.graze").code, 0);
  const TraceTable traces = table_of(Archive(folder / "a.graze"), "still");
  const auto found = std::find(traces.outcome.begin(), traces.outcome.end(), Outcome::invalid);
  ASSERT_NE(found, traces.outcome.end()) << "some balls are meant to have no mass";
  const auto particle = traces.particle[static_cast<std::size_t>(found - traces.outcome.begin())];
  const testing::Result got =
      testing::graze(folder.path(), "replay a.graze -o a.csv --particle " + std::to_string(particle));
  EXPECT_EQ(got.code, 0) << got.err;
  EXPECT_THAT(got.out, AllOf(HasSubstr("outcome    invalid: "), HasSubstr("mass 0"), HasSubstr("never began"),
                             HasSubstr("bit for bit")));
  EXPECT_EQ(read_csv(folder / "a.csv").size(), 1u);
}

// A trace that threw in its campaign throws again: the same reason, and the frames up to it. (The policy `faulty` is
// that of contained_test.cpp.)
TEST(Replay, ATraceThatThrewThrowsAgain) {
  const TemporaryFolder folder;
  std::string text = testing::ball_scenario();
  const std::string still = "{hold: {}, control: {torque: {}}}";
  text.replace(text.find(still), still.size(), "{faulty: {does: throw, above: 0.2}, control: {torque: {}}}");
  testing::write_file(folder / "ball.urdf", testing::kBallUrdf);
  testing::write_file(folder / "ball.yaml", text);
  write_campaign(folder / "a.graze", load_scenario((folder / "ball.yaml").string()), 16);
  const FailureTable failures = failures_of(Archive(folder / "a.graze"), "still");
  int thrown = 0;
  for (const FailureTable::Row& row : failures.rows) {
    if (row.outcome != Outcome::invalid) continue;
    const Replay got = replay(request(folder / "a.graze", row.particle, "still"));
    EXPECT_TRUE(got.verified()) << (got.differences.empty() ? "" : got.differences[0]);
    EXPECT_THAT(got.file.trace.invalid_reason, HasSubstr("no fingers"));
    EXPECT_EQ(got.file.log.time.size(), 11u) << "the start and 10 ms";
    ++thrown;
  }
  EXPECT_GT(thrown, 0);
}

// Every failure that `score` lists is replayed by the command that it lists.
TEST(Replay, TheCommandsOfScoreWork) {
  const Balls balls("", "-n 60");
  const auto json = nlohmann::json::parse(balls.graze("score a.graze --json --failures").out);
  ASSERT_GT(json["failures"].size(), 3u);
  EXPECT_EQ(json["failures"].size(), json["failed"]);
  EXPECT_EQ(json["failures_listed"], "all");
  for (const auto& failure : json["failures"]) {
    const std::string command = failure["replay"];
    ASSERT_TRUE(command.starts_with("graze "));
    const testing::Result got = balls.graze(command.substr(6));
    EXPECT_EQ(got.code, 0) << got.err;
    EXPECT_THAT(got.out, HasSubstr("outcome    " + failure["outcome"].get<std::string>()));
  }
  EXPECT_THAT(balls.graze("score a.graze").out, HasSubstr("graze replay a.graze --particle"));
}

TEST(Replay, DifferencesAreNamedOneByOne) {
  const TemporaryFolder folder;
  testing::write_ball(folder);
  const Scenario scenario = load_scenario((folder / "ball.yaml").string());
  const CampaignInfo info = describe_campaign(scenario, 4, "test");
  TraceRecord a;
  a.outcome = Outcome::known_failure;
  a.violated = 0;
  a.margins = {-0.5};
  a.first_violations = {std::nan("")};
  a.q.assign(7, 0.0);
  a.v.assign(6, 0.0);
  EXPECT_TRUE(trace_differences(a, a, info, {.events = true}).empty()) << "NaN equals itself";
  TraceRecord b = a;
  b.q[6] = -0.0;
  b.outcome = Outcome::success;
  b.violated = -1;
  b.events.emplace_back();
  EXPECT_THAT(trace_differences(a, b, info, {.events = true}),
              ElementsAre(HasSubstr("known failure (high) in the archive, success now"),
                          HasSubstr("final position base.z: 0 in the archive, -0 now"), HasSubstr("number of events")));
  EXPECT_EQ(trace_differences(a, b, info, {}).size(), 2u) << "an archive without events";
}

}  // namespace
}  // namespace graze
