// An explanation as JSON: everything, for scripts and reports.
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/cause_numbers.h"
#include "analysis/explanation.h"
#include "analysis/json_of.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;
using graze::json_of;

Json numbers(const std::vector<double>& values) {
  return json_list(values, [](double x) { return json_of(x); });
}

Json json_of(const FreedomSpread& f) {
  const auto mode = [](const Mode& m) {
    return Json{{"traces", m.traces}, {"mean", json_of(m.mean)}, {"deviation", json_of(m.deviation)}};
  };
  return {{"name", f.name},
          {"unit", f.unit},
          {"mean", json_of(f.mean)},
          {"median", json_of(f.median)},
          {"deviation", json_of(f.deviation)},
          {"iqr", json_of(f.iqr)},
          {"mean_minus_median", json_of(f.skew_drift)},
          {"dip", json_of(f.dip)},
          {"p_value", json_of(f.p_value)},
          {"p_holm", json_of(f.p_holm)},
          {"modes", json_list(f.modes, mode)},
          {"cuts", numbers(f.cuts)}};
}

Json json_of(const Scatter& s) {
  return {{"traces", s.traces},
          {"verdict", scatter_text(s)},
          {"bifurcates", s.bifurcates()},
          {"clearest", s.bifurcates() ? Json(s.freedoms[static_cast<std::size_t>(s.clearest)].name) : Json(nullptr)},
          {"degrees_of_freedom", json_list(s.freedoms, [](const FreedomSpread& f) { return json_of(f); })},
          {"notes", s.notes}};
}

Json json_of(const Growth& g) {
  const auto at = [](const SpreadAt& s) {
    return Json{{"time", json_of(s.time)}, {"deviations", numbers(s.deviations)}};
  };
  return {{"note", g.note},
          {"traces", g.traces},
          {"names", g.names},
          {"units", g.units},
          {"times", json_list(g.times, at)}};
}

Json json_of(const Survival& s) {
  const auto step = [](const SurvivalStep& at) {
    return Json{{"time", json_of(at.time)},
                {"at_risk", at.at_risk},
                {"failed", at.failed},
                {"share", json_of(at.share)},
                {"interval", json_of(at.interval)}};
  };
  return {{"what", s.what},
          {"traces", s.traces},
          {"failed", s.failed},
          {"seen_until", json_of(s.seen_until)},
          {"median", json_of(s.median)},
          {"median_interval", json_of(s.median_interval)},
          {"steps", json_list(s.steps, step)}};
}

Json json_of(const MarginSummary& m) {
  Json quantiles = Json::array();
  for (std::size_t k = 0; k < m.quantiles.size(); ++k) {
    quantiles.push_back({{"p", kMarginQuantiles[k]}, {"margin", json_of(m.quantiles[k])}});
  }
  return {{"name", m.name},
          {"unit", m.unit},
          {"n", m.n},
          {"quantiles", quantiles},
          {"worst", json_of(m.worst)},
          {"worst_particle", m.n > 0 ? Json(m.worst_particle) : Json(nullptr)},
          {"below_0", m.below},
          {"interval", json_of(m.interval)}};
}

Json json_of(const LogRank& test) {
  return {{"chi_square", json_of(test.chi_square)}, {"freedom", test.freedom}, {"p_value", json_of(test.p_value)}};
}

Json rate_of(const RateBounds& r) {
  return {{"n", r.n},
          {"success", r.success},
          {"unknown_failure", r.unknown},
          {"rate", json_of(r.worst)},
          {"interval", json_of(r.worst_interval)},
          {"rate_if_unknown_were_success", json_of(r.best)},
          {"interval_if_unknown_were_success", json_of(r.best_interval)},
          {"simultaneous_interval", json_of(r.simultaneous)}};
}

Json sizes_of(const PolicyExplanation& p) {
  const auto size = [](std::uint64_t n) { return n > 0 ? Json(n) : Json(nullptr); };
  Json widths = Json::array(), decisions = Json::array();
  for (std::size_t k = 0; k < p.sizes.size(); ++k) {
    widths.push_back({{"half_width", kHalfWidths[k]}, {"particles", size(p.sizes[k])}});
  }
  for (const DecisionSize& one : p.decisions) {
    decisions.push_back(
        {{"bound", one.bound}, {"particles", size(one.fixed)}, {"particles_with_until", size(one.sequence)}});
  }
  return {{"widths", widths}, {"decisions", decisions}};
}

Json json_of(const PolicyExplanation& p, const RateBounds& rate, const Convergence& convergence,
             const ParticleTable& table) {
  const auto mode = [](const ModeTraces& m) {
    return Json{
        {"success", m.success}, {"known_failure", m.known}, {"unknown_failure", m.unknown}, {"particles", m.particles}};
  };
  return {{"policy", p.policy},
          {"n", p.n},
          {"success", p.success},
          {"known_failure", p.known},
          {"unknown_failure", p.unknown},
          {"invalid", p.invalid},
          {"rate", rate_of(rate)},
          {"convergence", convergence_json(convergence)},
          {"causes", json_list(p.causes, [&](const Causes& one) { return causes_json(one, table); })},
          {"bifurcation_causes", p.bifurcations},
          {"final_states", json_of(p.ended)},
          {"final_states_of_all", json_of(p.all)},
          {"modes", json_list(p.modes, mode)},
          {"growth", json_of(p.growth)},
          {"survival", json_list(p.survival, [](const Survival& s) { return json_of(s); })},
          {"margins", json_list(p.margins, [](const MarginSummary& m) { return json_of(m); })},
          {"sizes", sizes_of(p)}};
}

}  // namespace

std::string explanation_json(const Explanation& all) {
  Json policies = Json::array(), pairs = Json::array();
  for (std::size_t i = 0; i < all.policies.size(); ++i) {
    policies.push_back(
        json_of(all.policies[i], all.rates.policies[i], all.score.policies[i].convergence, all.parameters));
  }
  for (std::size_t i = 0; i < all.pairs.size(); ++i) {
    const CorrectedPair& rate = all.rates.pairs[i];
    pairs.push_back({{"a", rate.a},
                     {"b", rate.b},
                     {"difference", json_of(rate.difference)},
                     {"mcnemar_p", json_of(rate.p_value)},
                     {"mcnemar_p_holm", json_of(rate.p_holm)},
                     {"log_rank", json_of(all.pairs[i].plain)},
                     {"paired_log_rank", json_of(all.pairs[i].paired)},
                     {"paired_log_rank_p_holm", json_of(all.pairs[i].p_holm)}});
  }
  const Json json = {{"campaign", all.campaign},
                     {"complete", all.complete},
                     {"particles", all.particles},
                     {"looked_at", all.looked_at},
                     {"parameters", all.parameters.columns.size()},
                     {"notes", all.notes},
                     {"unconverged_limit", all.score.unconverged},
                     {"policies", policies},
                     {"log_rank", json_of(all.log_rank)},
                     {"pairs", pairs}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace graze
