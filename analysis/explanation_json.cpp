// An explanation as JSON: everything, for scripts and reports.
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/cause_numbers.h"
#include "analysis/explanation.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no NaN and no infinity.
Json of(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
Json of(const Interval& interval) { return Json::array({of(interval.low), of(interval.high)}); }

template <class T, class Function>
Json list(const std::vector<T>& values, const Function& function) {
  Json out = Json::array();
  for (const T& value : values) out.push_back(function(value));
  return out;
}
Json numbers(const std::vector<double>& values) {
  return list(values, [](double x) { return of(x); });
}

Json of(const FreedomSpread& f) {
  const auto mode = [](const Mode& m) {
    return Json{{"traces", m.traces}, {"mean", of(m.mean)}, {"deviation", of(m.deviation)}};
  };
  return {{"name", f.name},
          {"unit", f.unit},
          {"mean", of(f.mean)},
          {"median", of(f.median)},
          {"deviation", of(f.deviation)},
          {"iqr", of(f.iqr)},
          {"mean_minus_median", of(f.skew_drift)},
          {"dip", of(f.dip)},
          {"p_value", of(f.p_value)},
          {"p_holm", of(f.p_holm)},
          {"modes", list(f.modes, mode)},
          {"cuts", numbers(f.cuts)}};
}

Json of(const Scatter& s) {
  return {{"traces", s.traces},
          {"verdict", scatter_text(s)},
          {"bifurcates", s.bifurcates()},
          {"clearest", s.bifurcates() ? Json(s.freedoms[static_cast<std::size_t>(s.clearest)].name) : Json(nullptr)},
          {"degrees_of_freedom", list(s.freedoms, [](const FreedomSpread& f) { return of(f); })},
          {"notes", s.notes}};
}

Json of(const Growth& g) {
  const auto at = [](const SpreadAt& s) { return Json{{"time", of(s.time)}, {"deviations", numbers(s.deviations)}}; };
  return {{"note", g.note}, {"traces", g.traces}, {"names", g.names}, {"units", g.units}, {"times", list(g.times, at)}};
}

Json of(const Survival& s) {
  const auto step = [](const SurvivalStep& at) {
    return Json{{"time", of(at.time)},
                {"at_risk", at.at_risk},
                {"failed", at.failed},
                {"share", of(at.share)},
                {"interval", of(at.interval)}};
  };
  return {{"what", s.what},
          {"traces", s.traces},
          {"failed", s.failed},
          {"seen_until", of(s.seen_until)},
          {"median", of(s.median)},
          {"median_interval", of(s.median_interval)},
          {"steps", list(s.steps, step)}};
}

Json of(const MarginSummary& m) {
  Json quantiles = Json::array();
  for (std::size_t k = 0; k < m.quantiles.size(); ++k) {
    quantiles.push_back({{"p", kMarginQuantiles[k]}, {"margin", of(m.quantiles[k])}});
  }
  return {{"name", m.name},
          {"unit", m.unit},
          {"n", m.n},
          {"quantiles", quantiles},
          {"worst", of(m.worst)},
          {"worst_particle", m.n > 0 ? Json(m.worst_particle) : Json(nullptr)},
          {"below_0", m.below},
          {"interval", of(m.interval)}};
}

Json of(const LogRank& test) {
  return {{"chi_square", of(test.chi_square)}, {"freedom", test.freedom}, {"p_value", of(test.p_value)}};
}

Json rate_of(const RateBounds& r) {
  return {{"n", r.n},
          {"success", r.success},
          {"unknown_failure", r.unknown},
          {"rate", of(r.worst)},
          {"interval", of(r.worst_interval)},
          {"rate_if_unknown_were_success", of(r.best)},
          {"interval_if_unknown_were_success", of(r.best_interval)},
          {"simultaneous_interval", of(r.simultaneous)}};
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

Json of(const PolicyExplanation& p, const RateBounds& rate, const ParticleTable& table) {
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
          {"causes", list(p.causes, [&](const Causes& one) { return causes_json(one, table); })},
          {"bifurcation_causes", p.bifurcations},
          {"final_states", of(p.ended)},
          {"final_states_of_all", of(p.all)},
          {"modes", list(p.modes, mode)},
          {"growth", of(p.growth)},
          {"survival", list(p.survival, [](const Survival& s) { return of(s); })},
          {"margins", list(p.margins, [](const MarginSummary& m) { return of(m); })},
          {"sizes", sizes_of(p)}};
}

}  // namespace

std::string explanation_json(const Explanation& all) {
  Json policies = Json::array(), pairs = Json::array();
  for (std::size_t i = 0; i < all.policies.size(); ++i) {
    policies.push_back(of(all.policies[i], all.rates.policies[i], all.parameters));
  }
  for (std::size_t i = 0; i < all.pairs.size(); ++i) {
    const CorrectedPair& rate = all.rates.pairs[i];
    pairs.push_back({{"a", rate.a},
                     {"b", rate.b},
                     {"difference", of(rate.difference)},
                     {"mcnemar_p", of(rate.p_value)},
                     {"mcnemar_p_holm", of(rate.p_holm)},
                     {"log_rank", of(all.pairs[i].plain)},
                     {"paired_log_rank", of(all.pairs[i].paired)},
                     {"paired_log_rank_p_holm", of(all.pairs[i].p_holm)}});
  }
  const Json json = {{"campaign", all.campaign},
                     {"complete", all.complete},
                     {"particles", all.particles},
                     {"looked_at", all.looked_at},
                     {"parameters", all.parameters.columns.size()},
                     {"notes", all.notes},
                     {"policies", policies},
                     {"log_rank", of(all.log_rank)},
                     {"pairs", pairs}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace graze
