#pragma once
// A replay without a simulation, every field of which is another value.

#include <limits>

#include "archive/replay_file.h"
#include "tests/archive/synthetic.h"

namespace graze::synthetic {

inline Contact touch(int b, ContactMode mode, double x) {
  Contact contact;
  contact.a = 0;
  contact.b = b;
  contact.feature_a = Feature::cap;
  contact.feature_b = b == 1 ? Feature::edge : Feature::top;
  contact.p_W = Vec3(x, 0.25, -1);
  contact.n_W = Vec3(0, 0.6, 0.8);
  contact.phi = -0.001 * x;
  contact.impulse_W = Vec3(0.5, 1, x);
  contact.mode = mode;
  return contact;
}

inline StepLog step_log() {
  StepLog log;
  log.time = {0, 0.1, 0.2};
  log.tables = {{"q", {{"base.x", "m"}, {"base.qw", "1"}}, {1, 2, 3, 4, 5, 1.0 / 3}},
                {"command/kp", {{"LF_X_1", "N m/rad"}}, {10, 20, std::numeric_limits<double>::quiet_NaN()}},
                {"none", {}, {}}};
  log.contact_frame = {1, 1, 2};
  log.contacts = {touch(1, ContactMode::stick, 2), touch(2, ContactMode::slip, 3), touch(2, ContactMode::roll, 4)};
  return log;
}

/// A known failure with one deciding requirement of each kind, a measure, two parameters and two events.
inline ReplayFile replayed() {
  ReplayFile out;
  out.archive = "runs/a, b.graze";
  out.policy = "step/1cm";
  out.info = info();
  out.info.scenario_text = "graze: 1";
  out.info.requirements.push_back({"fast", "speed of the joint", "rad/s", true, "joints", {0.1, 0.3}});
  TraceRecord& trace = out.trace;
  trace.particle = 7;
  trace.outcome = Outcome::known_failure;
  trace.violated = 1;
  trace.end_time = 0.2;
  trace.objective_margin = -0.125;
  trace.margins = {0.5, -0.25, 0.75};
  trace.first_violations = {std::numeric_limits<double>::quiet_NaN(), 0.2, std::numeric_limits<double>::quiet_NaN()};
  trace.margin_parts = {kNoPart, 1, 0};
  trace.violation_parts = {kNoPart, 2, kNoPart};
  trace.objective_culprit = {1, 2};
  trace.digest = 0xFEDCBA9876543210;
  trace.sequence = "LF_FOOT-curb";
  Event begin, limit;
  begin.time = 0.1;
  begin.a = 0;
  begin.b = 1;
  begin.feature_a = Feature::cap;
  begin.feature_b = Feature::rim;
  begin.impulse = 0.5;
  begin.p_W = Vec3(1, 2, 3);
  limit.time = 0.2;
  limit.kind = EventKind::limit_end;
  limit.a = 1;
  limit.b = 1;
  trace.events = {begin, limit};
  ContactPhase phase;
  phase.begin = 0.1;
  phase.end = 0.2;
  phase.b = 1;
  phase.feature_a = Feature::cap;
  phase.feature_b = Feature::side;
  phase.peak = 0.5;
  phase.impulse = 1.25;
  phase.slip = 0.75;
  phase.roll = 0.125;
  trace.phases = {phase};
  out.verification = "different";
  out.archived_digest = 0x123;
  for (const CampaignInfo::RequirementRow& row : out.info.requirements) {
    const double to = row.measure ? row.window.to : 1.5;
    out.requirements.push_back({row.name, row.description, row.unit, row.window.from, to, row.measure});
  }
  out.parameters = {
      {"mass", "kg", "normal(mean=1, std=0.5)", 1, 2, 2, "", ""},
      {"contact.model", "1", "choice(2)", 0, 1, std::numeric_limits<double>::quiet_NaN(), "say \"a\"", "two\r\nlines"}};
  out.derived = {{"inertia", "kg m^2", 0.25, 0.125}};
  out.log = step_log();
  return out;
}

}  // namespace graze::synthetic
