// Kinds of unknown failures as text and JSON.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "analysis/failures.h"
#include "analysis/number_words.h"
#include "analysis/text_table.h"
#include "analysis/unknown_failures.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;

std::string trait_text(const Trait& trait) {
  const std::string unit = trait.unit.empty() || trait.unit == "1" ? "" : " " + trait.unit;
  return fmt::format("{} {:.4g}{} ({:.4g})", trait.name, trait.here, unit, trait.successes);
}

std::string kind_text(const FailureKind& kind, std::size_t number, const UnknownFailures& one,
                      const std::string& archive) {
  const bool successes = one.successes > 0;
  std::string out = fmt::format("  kind {}: {}; typical: {}\n", number, counted(kind.traces, "trace", "traces"),
                                replay_command(archive, one.policy, kind.typical, one.trust));
  if (kind.traits.empty()) return out;
  out += fmt::format("    medians, those of the {} in brackets:", successes ? "successes" : "unknown failures");
  for (std::size_t i = 0; i < kind.traits.size(); ++i) out += (i > 0 ? "; " : " ") + trait_text(kind.traits[i]);
  out += "\n";
  if (!successes) return out;
  if (!kind.tried) return out + "    too few traces to choose a requirement on and to try it\n";
  if (kind.witnesses.empty()) return out + "    no simple requirement tells it from the successes\n";
  out += "    would have caught it (chosen on even particles, tried on odd ones):\n";
  for (const ProposedWitness& w : kind.witnesses) {
    out += fmt::format("      {{{}}}   {} of {}, false alarms {} of {}{}\n", w.yaml, w.caught, w.of, w.alarms,
                       counted(w.successes, "success", "successes"),
                       w.in_objective ? "; the objective judges this already" : "");
  }
  return out;
}

}  // namespace

std::string format_unknown_failures(const std::vector<UnknownFailures>& all, const std::string& archive,
                                    bool complete) {
  std::string out = complete ? "" : "INCOMPLETE: of the traces that are there.\n";
  for (const UnknownFailures& one : all) {
    out += fmt::format("{}{}: {}", out.empty() ? "" : "\n", one.policy,
                       counted(one.traces, "unknown failure", "unknown failures"));
    if (one.looked_at < one.traces) out += fmt::format(", of which the first {} are looked at", one.looked_at);
    if (one.kinds.size() > 1) {
      out += fmt::format(", {} kinds (silhouette {:.2f})", one.kinds.size(), one.silhouette);
    } else if (one.traces > 1) {
      out += ", all of one kind";
    }
    out += "\n";
    for (std::size_t i = 0; i < one.kinds.size(); ++i) {
      out += kind_text(one.kinds[i], i + 1, one, archive);
    }
  }
  return out;
}

std::string unknown_failures_json(const std::vector<UnknownFailures>& all, const std::string& archive, bool complete) {
  Json policies = Json::array();
  for (const UnknownFailures& one : all) {
    Json kinds = Json::array();
    for (const FailureKind& kind : one.kinds) {
      Json traits = Json::array(), witnesses = Json::array();
      for (const Trait& t : kind.traits) {
        traits.push_back({{"name", t.name},
                          {"unit", t.unit},
                          {"median", t.here},
                          {"median_of_successes", t.successes},
                          {"deviations", t.deviation}});
      }
      for (const ProposedWitness& w : kind.witnesses) {
        witnesses.push_back({{"requirement", w.yaml},
                             {"caught", w.caught},
                             {"of", w.of},
                             {"false_alarms", w.alarms},
                             {"successes", w.successes},
                             {"in_objective", w.in_objective}});
      }
      kinds.push_back({{"traces", kind.traces},
                       {"typical", kind.typical},
                       {"replay", replay_command(archive, one.policy, kind.typical, one.trust)},
                       {"particles", kind.particles},
                       {"traits", traits},
                       {"tried", kind.tried},
                       {"witnesses", witnesses}});
    }
    policies.push_back({{"policy", one.policy},
                        {"unknown_failures", one.traces},
                        {"successes", one.successes},
                        {"looked_at", one.looked_at},
                        {"silhouette", one.silhouette},
                        {"kinds", kinds}});
  }
  const Json out = {{"archive", archive}, {"complete", complete}, {"policies", policies}};
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace graze
