#include "jobs/cli/predict_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/json_of.h"
#include "analysis/score.h"
#include "analysis/text_table.h"

namespace graze {
namespace {

/// The best candidate against the one that would be best without it, on the particles that are valid under both.
struct AgainstNext {
  std::string policy;
  std::uint64_t only_best = 0, only_next = 0;  // successes
  double p_value = 1;                          // McNemar, exact
};

std::optional<AgainstNext> against_next(const Prediction& told) {
  if (told.best < 0) return std::nullopt;
  const auto best = static_cast<std::size_t>(told.best);
  std::vector<CandidatePrediction> others = told.candidates;
  others.erase(others.begin() + told.best);
  const int next = best_of(others);
  if (next < 0) return std::nullopt;
  const CandidatePrediction& a = told.candidates[best];
  const CandidatePrediction& b = others[static_cast<std::size_t>(next)];
  AgainstNext out;
  out.policy = b.policy;
  for (std::size_t i = 0; i < a.by_particle.size(); ++i) {
    const Outcome one = a.by_particle[i], other = b.by_particle[i];
    if (one == Outcome::invalid || other == Outcome::invalid) continue;
    out.only_best += one == Outcome::success && other != Outcome::success;
    out.only_next += one != Outcome::success && other == Outcome::success;
  }
  out.p_value = mcnemar_exact(out.only_best, out.only_next);
  return out;
}

std::string cell(double x, double factor = 1) { return std::isnan(x) ? "-" : fmt::format("{:.3g}", factor * x); }

std::string candidates_table(const PredictionStory& story, const Prediction& told) {
  const std::string unit = story.objective_unit.empty() ? "" : " " + story.objective_unit;
  std::vector<std::vector<std::string>> table = {{"policy", "N", "S", "K", "U", "invalid", "rate", "95 % interval",
                                                  "lasts s", "place mm", "joints mrad", "objective" + unit, "spread"}};
  for (const CandidatePrediction& one : told.candidates) {
    table.push_back({one.policy, std::to_string(one.valid()), std::to_string(one.outcomes[0]),
                     std::to_string(one.outcomes[1]), std::to_string(one.outcomes[2]), std::to_string(one.outcomes[3]),
                     std::isnan(one.rate) ? "-" : fmt::format("{:.4f}", one.rate),
                     fmt::format("{:.4f} .. {:.4f}", one.low, one.high), cell(one.lasted.mean()), cell(one.place, 1e3),
                     cell(one.joints, 1e3), cell(one.objective.mean()), cell(one.objective.std())});
  }
  return text_table(table, 1);
}

std::string failures_table(const PredictionStory& story, const Prediction& told) {
  std::vector<std::vector<std::string>> table = {{"policy"}};
  table.front().insert(table.front().end(), story.requirements.begin(), story.requirements.end());
  std::uint64_t all = 0;
  for (const CandidatePrediction& one : told.candidates) {
    std::vector<std::string>& row = table.emplace_back(1, one.policy);
    for (const std::uint64_t count : one.violated) {
      row.push_back(std::to_string(count));
      all += count;
    }
  }
  return all == 0 ? "" : "\nKnown failures by the requirement that was violated first\n" + text_table(table, 1);
}

std::string invalid_text(const Prediction& told) {
  std::string out;
  for (const CandidatePrediction& one : told.candidates) {
    if (one.outcomes[3] == 0) continue;
    out += fmt::format("{}{}: {} invalid, the first: {}\n", out.empty() ? "\n" : "", one.policy, one.outcomes[3],
                       one.invalid_reason);
  }
  return out;
}

std::string verdict_text(const Prediction& told) {
  if (told.best < 0)
    return told.particles == 0 ? "No verdict: no block of particles came to its end in time.\n"
                               : "No verdict: no trace is valid.\n";
  std::string out = "Best: " + told.candidates[static_cast<std::size_t>(told.best)].policy + ".";
  const auto next = against_next(told);
  if (next && next->only_best + next->only_next == 0) {
    out += fmt::format(" {} succeeds in the same particles; how long traces last, then the objective's margin decided.",
                       next->policy);
  } else if (next) {
    out += fmt::format(" On the same particles it alone succeeds in {}, and {} alone in {} (McNemar: p = {:.2g}).",
                       next->only_best, next->policy, next->only_next, next->p_value);
  }
  return out + "\n";
}

struct CallSums {
  std::uint64_t fewest = 0, median = 0, most = 0, in_time = 0;
  double longest = 0;  // s
};

CallSums sums_of(const std::vector<Prediction>& calls) {
  CallSums out;
  std::vector<std::uint64_t> particles;
  for (const Prediction& one : calls) {
    particles.push_back(one.particles);
    out.in_time += one.in_time;
    out.longest = std::max(out.longest, one.seconds);
  }
  std::sort(particles.begin(), particles.end());
  out.fewest = particles.front(), out.median = particles[particles.size() / 2], out.most = particles.back();
  return out;
}

std::string times_text(const PredictionStory& story, const Prediction& told) {
  std::string out = fmt::format("{} particles of each candidate in {:.1f} ms on {} threads", told.particles,
                                1e3 * told.seconds, story.threads);
  const bool hurried = std::isfinite(story.deadline);
  if (hurried)
    out += fmt::format(", {} the deadline of {:g} ms", told.in_time ? "before" : "LATER THAN", 1e3 * story.deadline);
  if (hurried && told.particles > 0) out += fmt::format("; the same verdict without it: -n {}", told.particles);
  out += ".\n";
  if (story.calls.size() == 1) return out;
  const CallSums sums = sums_of(story.calls);
  return out + fmt::format("{} calls: {} particles in the median ({} .. {}), {} in time, the longest {:.1f} ms.\n",
                           story.calls.size(), sums.median, sums.fewest, sums.most, sums.in_time, 1e3 * sums.longest);
}

std::string followed_text(const PredictionStory& story) {
  if (!story.followed) return "";
  const auto& [verdict, ends, end_time] = *story.followed;
  if (ends.empty()) {
    return fmt::format("The robot's trace under {} had ended when the verdict was there, at {:g} s.\n", story.under,
                       verdict);
  }
  return fmt::format(
      "The robot went on under {} until the verdict was there, at {:g} s, and under the best from then on: "
      "{} at {:g} s.\n",
      story.under, verdict, ends, end_time);
}

nlohmann::ordered_json summary_json(const NumberSummary& of) {
  return {{"n", of.count()}, {"mean", json_of(of.mean())}, {"std", json_of(of.std())}, {"least", json_of(of.least())}};
}

nlohmann::ordered_json candidate_json(const PredictionStory& story, const CandidatePrediction& one) {
  nlohmann::ordered_json violated = nlohmann::ordered_json::object(), margins = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < story.requirements.size(); ++i) {
    violated[story.requirements[i]] = one.violated[i];
    margins[story.requirements[i]] = summary_json(one.margins[i]);
  }
  return {{"policy", one.policy},
          {"n", one.valid()},
          {"success", one.outcomes[0]},
          {"known_failure", one.outcomes[1]},
          {"unknown_failure", one.outcomes[2]},
          {"invalid", one.outcomes[3]},
          {"invalid_reason",
           one.invalid_reason.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(one.invalid_reason)},
          {"rate", json_of(one.rate)},
          {"interval", json_of(Interval{one.low, one.high})},
          {"lasted", summary_json(one.lasted)},
          {"place", json_of(one.place)},
          {"joints", json_of(one.joints)},
          {"objective", summary_json(one.objective)},
          {"violated", violated},
          {"margins", margins}};
}

}  // namespace

std::string prediction_text(const PredictionStory& story) {
  const Prediction& told = story.calls.front();
  return fmt::format(
      "{}: from {:g} s on, for {:g} s\nFrom what the nominal robot's sensors read under {}{}.\n\n{}{}\nlasts: mean "
      "time "
      "to the end. place, joints: root mean square about the mean, of the traces that\nlasted, at their end. "
      "objective: "
      "mean and standard deviation of its margin.\n{}\n{}{}{}",
      story.scenario, story.at, told.horizon, story.under,
      story.remembers ? ", and with what its controller remembers" : "; controllers start afresh",
      candidates_table(story, told), failures_table(story, told), invalid_text(told), verdict_text(told),
      times_text(story, told), followed_text(story));
}

std::string prediction_json(const PredictionStory& story) {
  const Prediction& told = story.calls.front();
  nlohmann::ordered_json out = {{"scenario", story.scenario},
                                {"under", story.under},
                                {"at", story.at},
                                {"horizon", told.horizon},
                                {"controllers_remember", story.remembers},
                                {"deadline", json_of(story.deadline)},
                                {"threads", story.threads},
                                {"particles", told.particles},
                                {"seconds", told.seconds},
                                {"in_time", told.in_time},
                                {"steps", told.steps}};
  out["best"] = nullptr;
  if (told.best >= 0) out["best"] = told.candidates[static_cast<std::size_t>(told.best)].policy;
  out["against_next"] = nullptr;
  if (const auto next = against_next(told)) {
    out["against_next"] = {{"policy", next->policy},
                           {"only_best", next->only_best},
                           {"only_next", next->only_next},
                           {"p_value", json_of(next->p_value)}};
  }
  out["candidates"] = nlohmann::ordered_json::array();
  for (const CandidatePrediction& one : told.candidates) out["candidates"].push_back(candidate_json(story, one));
  const CallSums sums = sums_of(story.calls);
  out["calls"] = {{"n", story.calls.size()},
                  {"in_time", sums.in_time},
                  {"particles", {sums.fewest, sums.median, sums.most}},
                  {"longest", sums.longest}};
  out["followed"] = nullptr;
  if (story.followed) {
    const bool went = !story.followed->ends.empty();
    out["followed"] = {{"verdict", story.followed->verdict}, {"ends", nullptr}, {"end_time", nullptr}};
    if (went) out["followed"]["ends"] = story.followed->ends;
    if (went) out["followed"]["end_time"] = story.followed->end_time;
  }
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace graze
