#include "archive/schema/schema.h"

namespace graze {
namespace {

using hdf5::Spec;
using hdf5::Type;

Spec plain(std::string name, Type type, std::string unit = {}) {
  return {std::move(name), type, false, 1, std::move(unit)};
}

Spec matrix(std::string name, std::size_t width, std::string unit = {}, Type type = Type::f64) {
  return {std::move(name), type, true, width, std::move(unit)};
}

Spec enumeration(std::string name, std::vector<std::string> labels) {
  return {std::move(name), Type::enumeration, false, 1, {}, std::move(labels)};
}

}  // namespace

Widths widths_of(const CampaignInfo& info) {
  return {info.parameters.size(), info.requirements.size(), info.q_names.size(), info.v_names.size(),
          info.actuator_names.size()};
}

namespace schema {

Spec particle() { return plain("particle", Type::u32); }
Spec values(const Widths& widths) { return matrix("values", widths.parameters); }

Spec outcome() { return enumeration("outcome", {"success", "known_failure", "unknown_failure", "invalid"}); }
Spec violated() { return plain("violated", Type::i32); }
Spec end_time() { return plain("end_time", Type::f64, "s"); }
Spec solver() { return matrix("solver", 4); }
Spec convergence() { return matrix("convergence", 4); }
Spec objective_margin() { return plain("objective_margin", Type::f64); }
Spec margins(const Widths& widths) { return matrix("margins", widths.requirements); }
Spec first_violations(const Widths& widths) { return matrix("first_violations", widths.requirements, "s"); }
Spec margin_parts(const Widths& widths) { return matrix("margin_parts", widths.requirements, {}, Type::i32); }
Spec violation_parts(const Widths& widths) { return matrix("violation_parts", widths.requirements, {}, Type::i32); }
Spec objective_culprit() { return matrix("objective_culprit", 2, {}, Type::i32); }
Spec final_q(const Widths& widths) { return matrix("final_q", widths.q); }
Spec final_v(const Widths& widths) { return matrix("final_v", widths.v); }
Spec digest() { return plain("digest", Type::u64); }
Spec sequence() { return plain("sequence", Type::u32); }
Spec invalid_reason() { return plain("invalid_reason", Type::u32); }

Spec offset() { return plain("offset", Type::u64); }
Spec time() { return plain("time", Type::f64, "s"); }

Spec kind() {
  return enumeration("kind", {"contact_begin", "contact_end", "stick_to_slip", "slip_to_stick", "limit_begin",
                              "limit_end", "stick_to_roll", "roll_to_stick", "slip_to_roll", "roll_to_slip"});
}
Spec collider(const char* name) { return plain(name, Type::i32); }
Spec feature(const char* name) {
  return enumeration(name, {"surface", "top", "bottom", "side", "edge", "vertex", "cap", "rim"});
}
Spec impulse() { return plain("impulse", Type::f64, "N s"); }
Spec position() { return matrix("position", 3, "m"); }

Spec begin() { return plain("begin", Type::f64, "s"); }
Spec end() { return plain("end", Type::f64, "s"); }
Spec peak() { return plain("peak", Type::f64, "N s"); }
Spec share(const char* name) { return plain(name, Type::f64); }

Spec telemetry_q(const Widths& widths) { return matrix("q", widths.q); }
Spec telemetry_v(const Widths& widths) { return matrix("v", widths.v); }
Spec telemetry_tau(const Widths& widths) { return matrix("tau", widths.actuators); }

std::vector<Spec> events() {
  return {time(),    kind(),    collider("a"), collider("b"), feature("feature_a"), feature("feature_b"),
          impulse(), position()};
}

std::vector<Spec> phases() {
  return {begin(), end(),     collider("a"), collider("b"), feature("feature_a"), feature("feature_b"),
          peak(),  impulse(), share("slip"), share("roll")};
}

std::vector<Spec> telemetry(const Widths& widths) {
  return {time(), telemetry_q(widths), telemetry_v(widths), telemetry_tau(widths)};
}

std::string traces_group(const std::string& policy) { return "traces/" + policy; }
std::string events_group(const std::string& policy) { return "events/" + policy; }
std::string phases_group(const std::string& policy) { return "phases/" + policy; }
std::string telemetry_group(const std::string& policy) { return "telemetry/" + policy; }

}  // namespace schema
}  // namespace graze
