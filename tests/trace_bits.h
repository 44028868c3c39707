#pragma once
// Everything that is kept of a trace, as bytes: two traces are the same if these are.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "engine/model/model.h"
#include "scenarios/scenario.h"
#include "simulation/trace.h"

namespace graze::testing {

inline void add_bits(double value, std::string& out) {
  // Which NaN it is depends on the compiler, not on the trace.
  if (std::isnan(value)) value = std::numeric_limits<double>::quiet_NaN();
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void add_bits(const std::vector<double>& values, std::string& out) {
  for (const double value : values) add_bits(value, out);
}

inline void add_bits(const std::vector<Event>& events, std::string& out) {
  for (const Event& event : events) {
    out += fmt::format("{} {} {} {} {} ", static_cast<int>(event.kind), event.a, event.b,
                       static_cast<int>(event.feature_a), static_cast<int>(event.feature_b));
    add_bits({event.time, event.impulse, event.p_W.x(), event.p_W.y(), event.p_W.z()}, out);
  }
}

inline void add_bits(const std::vector<ContactPhase>& phases, std::string& out) {
  for (const ContactPhase& phase : phases) {
    out += fmt::format("{} {} {} {} ", phase.a, phase.b, static_cast<int>(phase.feature_a),
                       static_cast<int>(phase.feature_b));
    add_bits({phase.begin, phase.end, phase.peak, phase.impulse, phase.slip, phase.roll}, out);
  }
}

template <class Frames>
void add_frame_bits(const Frames& telemetry, std::string& out) {
  for (std::size_t i = 0; i < telemetry.size(); ++i) {
    const TelemetryFrame& frame = telemetry[i];
    add_bits(frame.time, out);
    for (const auto* values : {&frame.q, &frame.v, &frame.tau}) add_bits(*values, out);
  }
}

inline std::string bits_of(const TraceRecord& trace) {
  std::string out = fmt::format("{} {} {:x} {} {} ", static_cast<int>(trace.outcome), trace.violated, trace.digest,
                                trace.sequence, trace.invalid_reason);
  add_bits({trace.end_time, trace.objective_margin}, out);
  for (const auto* values : {&trace.margins, &trace.first_violations, &trace.q, &trace.v}) add_bits(*values, out);
  for (const auto* parts : {&trace.margin_parts, &trace.violation_parts}) {
    for (const int part : *parts) out += fmt::format("{} ", part);
  }
  add_bits(trace.events, out);
  add_bits(trace.phases, out);
  add_frame_bits(trace.telemetry, out);
  return out;
}

/// The same, and what the contact solver did.
inline std::string all_bits_of(const TraceRecord& trace) {
  std::string out = bits_of(trace);
  const SolverLog& log = trace.solver;
  add_bits({log.mean_sweeps, log.most_sweeps, log.largest_residual, log.unconverged_steps, log.steps,
            log.median_residual, log.braked_steps, log.most_braked},
           out);
  return out;
}

/// Whether drives have rotors, which some back ends refuse.
inline bool has_rotors(const Model& model) {
  return std::any_of(model.bodies.begin(), model.bodies.end(), [](const Body& body) { return body.armature != 0; });
}

/// Drives with rotors, and motion that is prescribed, which Bullet refuses.
inline bool is_for_lanes_alone(const Scenario& scenario) {
  const auto prescribes = [](const PolicySpec& policy) {
    const auto control = policy.settings.find("control");
    return control && control->is_map() && control->has("prescribed");
  };
  return has_rotors(scenario.model) || std::any_of(scenario.policies.begin(), scenario.policies.end(), prescribes);
}

}  // namespace graze::testing
