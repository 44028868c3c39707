#include "analysis/convergence.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/json_of.h"
#include "analysis/number_words.h"
#include "analysis/text_table.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t whole(double count) { return count > 0 ? static_cast<std::uint64_t>(count) : 0; }  // NaN: 0

std::string change_text(double change) { return std::isnan(change) ? "-" : fmt::format("{:.2g}", change); }

double share_of(std::uint64_t some, std::uint64_t all) { return static_cast<double>(some) / static_cast<double>(all); }

bool says(const Convergence& c) { return c.unconverged_steps > 0 || c.braked_steps > 0; }

constexpr Outcome kOutcomes[] = {Outcome::success, Outcome::known_failure, Outcome::unknown_failure, Outcome::invalid};

std::vector<std::string> table_row(const NamedConvergence& one, bool braked, bool flagged) {
  const Convergence& c = one.convergence;
  std::vector<std::string> row = {one.name,
                                  std::to_string(c.steps),
                                  std::to_string(c.unconverged_steps),
                                  percent(share_of(c.unconverged_steps, c.steps)),
                                  fmt::format("{} of {}", c.unconverged_traces, c.traces),
                                  c.unconverged_steps > 0 ? change_text(c.median_change) : "-",
                                  c.unconverged_steps > 0 ? change_text(c.largest_change) : "-"};
  if (braked) {
    row.push_back(std::to_string(c.braked_steps));
    row.push_back(c.braked_steps > 0 ? change_text(c.most_braked) : "-");
  }
  if (!flagged) return row;
  for (const Outcome outcome : kOutcomes) row.push_back(std::to_string(c.flagged_in(outcome)));
  row.push_back(c.first_flagged ? std::to_string(*c.first_flagged) : "-");
  return row;
}

}  // namespace

std::uint64_t Convergence::flagged_valid() const {
  return flagged_in(Outcome::success) + flagged_in(Outcome::known_failure) + flagged_in(Outcome::unknown_failure);
}

void ConvergenceSum::add(std::uint32_t particle, Outcome outcome, const SolverLog& log, bool flagged) {
  if (!log.tells()) return;
  const std::uint64_t unconverged = whole(log.unconverged_steps), braked = whole(log.braked_steps);
  ++sum_.traces;
  sum_.steps += whole(log.steps);
  sum_.braked_steps += braked;
  sum_.braked_traces += braked > 0;
  sum_.most_braked = std::max(sum_.most_braked, std::isnan(log.most_braked) ? 0.0 : log.most_braked);
  if (unconverged == 0) return;
  sum_.unconverged_steps += unconverged;
  ++sum_.unconverged_traces;
  sum_.largest_change = std::max(sum_.largest_change, log.largest_residual);
  if (!std::isnan(log.median_residual)) medians_.add(log.median_residual, unconverged);
  if (!flagged) return;
  ++sum_.flagged[static_cast<std::size_t>(outcome)];
  sum_.first_flagged = std::min(sum_.first_flagged.value_or(particle), particle);
}

Convergence ConvergenceSum::total() const {
  Convergence out = sum_;
  // A bin's middle may lie above all that is in it.
  out.median_change = medians_.median();
  if (out.median_change > out.largest_change) out.median_change = out.largest_change;
  return out;
}

std::string percent(double share) {
  return share < 0.995 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.3g} %", 100 * share);
}

std::string steps_text(std::uint64_t some, std::uint64_t all) {
  return fmt::format("{} of {} steps ({})", some, all, percent(share_of(some, all)));
}

std::string flag_rule(double limit) { return fmt::format("more than {:.3g} % of them", 100 * limit); }

std::string convergence_table(std::span<const NamedConvergence> all, const std::string& rule) {
  const auto any = [&](const auto& has) {
    return std::any_of(all.begin(), all.end(), [&](const NamedConvergence& one) { return has(one.convergence); });
  };
  if (!any(says)) return "";
  const bool braked = any([](const Convergence& c) { return c.braked_steps > 0; });
  const bool flagged = any([](const Convergence& c) { return c.flagged_all() > 0; });
  std::vector<std::vector<std::string>> rows = {
      {"policy", "steps", "unconverged", "share", "in traces", "by (median), m/s", "by (most), m/s"}};
  if (braked) rows[0].insert(rows[0].end(), {"braked", "by (most), m/s"});
  if (flagged) rows[0].insert(rows[0].end(), {"flagged S", "flagged K", "flagged U", "flagged invalid", "first"});
  for (const NamedConvergence& one : all) {
    if (says(one.convergence)) rows.push_back(table_row(one, braked, flagged));
  }
  const std::string why = flagged ? fmt::format(" (flagged: traces with {})", rule) : "";
  return fmt::format("\nSteps whose contacts did not converge{}\n", why) + text_table(rows, 1);
}

std::string convergence_sentence(const Convergence& c, double limit) {
  std::vector<std::string> parts;
  if (c.unconverged_steps > 0) {
    parts.push_back(
        fmt::format("contacts of {}, in {} of {} traces, did not converge, by {} m/s at the median and {} m/s at most",
                    steps_text(c.unconverged_steps, c.steps), c.unconverged_traces, c.traces,
                    change_text(c.median_change), change_text(c.largest_change)));
  }
  if (c.braked_steps > 0) {
    parts.push_back(fmt::format("{} were braked, by {} m/s at most", steps_text(c.braked_steps, c.steps),
                                change_text(c.most_braked)));
  }
  if (c.flagged_all() > 0) {
    parts.push_back(fmt::format("{} FLAGGED ({}): {} S, {} K, {} U, {} invalid",
                                counted(c.flagged_all(), "trace is", "traces are"), flag_rule(limit),
                                c.flagged_in(Outcome::success), c.flagged_in(Outcome::known_failure),
                                c.flagged_in(Outcome::unknown_failure), c.flagged_in(Outcome::invalid)));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

Json convergence_json(const Convergence& c) {
  if (c.traces == 0) return nullptr;
  const bool some = c.unconverged_steps > 0;
  return {{"traces", c.traces},
          {"steps", c.steps},
          {"unconverged_steps", c.unconverged_steps},
          {"unconverged_traces", c.unconverged_traces},
          {"median_change", some ? json_of(c.median_change) : Json(nullptr)},
          {"largest_change", some ? json_of(c.largest_change) : Json(nullptr)},
          {"braked_steps", c.braked_steps},
          {"braked_traces", c.braked_traces},
          {"most_braked", json_of(c.most_braked)},
          {"flagged",
           {{"all", c.flagged_all()},
            {"success", c.flagged_in(Outcome::success)},
            {"known_failure", c.flagged_in(Outcome::known_failure)},
            {"unknown_failure", c.flagged_in(Outcome::unknown_failure)},
            {"invalid", c.flagged_in(Outcome::invalid)},
            {"first_particle", c.first_flagged ? Json(*c.first_flagged) : Json(nullptr)}}}};
}

std::string solver_lines(const SolverLog& log, double limit) {
  std::string out;
  const std::uint64_t steps = whole(log.steps);
  if (log.unconverged_steps > 0) {
    out += fmt::format("contact    {} did not converge; last change {} m/s at the median, {} m/s at most\n",
                       steps_text(whole(log.unconverged_steps), steps), change_text(log.median_residual),
                       change_text(log.largest_residual));
  }
  if (log.braked_steps > 0) {
    out += fmt::format("contact    {} were braked, by {} m/s at most\n", steps_text(whole(log.braked_steps), steps),
                       change_text(log.most_braked));
  }
  if (log.flagged(limit)) {
    out +=
        fmt::format("FLAGGED    more than {:.3g} % of its steps did not converge (contact.unconverged)\n", 100 * limit);
  }
  return out;
}

Json solver_json(const SolverLog& log, double limit) {
  if (!log.tells()) return nullptr;
  const bool some = log.unconverged_steps > 0;
  return {{"steps", json_of(log.steps)},
          {"unconverged_steps", json_of(log.unconverged_steps)},
          {"median_change", some ? json_of(log.median_residual) : Json(nullptr)},
          {"largest_change", some ? json_of(log.largest_residual) : Json(nullptr)},
          {"braked_steps", json_of(log.braked_steps)},
          {"most_braked", json_of(log.most_braked)},
          {"mean_sweeps", json_of(log.mean_sweeps)},
          {"most_sweeps", json_of(log.most_sweeps)},
          {"flagged", log.flagged(limit)}};
}

}  // namespace graze
