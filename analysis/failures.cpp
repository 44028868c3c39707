#include "analysis/failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <ostream>

#include "analysis/convergence.h"
#include "analysis/failure_table.h"
#include "analysis/json_of.h"
#include "analysis/text_table.h"
#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "archive/schema/culprit.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;

/// Looks at a window of particles at a time, for memory's sake.
void for_each_listed(const Archive& archive, Listed which, const std::vector<std::string>& policies,
                     const std::function<void(const Failure&)>& act) {
  constexpr std::uint64_t kWindow = std::uint64_t{1} << 20;
  const CampaignInfo& info = archive.info();
  for (const std::string& policy : policies) {
    for (std::uint64_t first = 0; first < info.particles; first += kWindow) {
      const auto wanted = [=](std::uint32_t particle) { return particle >= first && particle - first < kWindow; };
      const FailureTable table =
          which == Listed::failures ? failures_of(archive, policy, wanted) : flagged_traces_of(archive, policy, wanted);
      for (const FailureTable::Row& row : table.rows) act(describe_failure(table, row, policy, info));
    }
  }
}

std::string number(double x, const char* unit) { return std::isnan(x) ? "-" : fmt::format("{:.5g}{}", x, unit); }

std::string margin_text(const Failure& failure) {
  const std::string unit = failure.unit.empty() || failure.unit == "1" ? "" : " " + failure.unit;
  // No step fell into the window of what is judged, or the trace ended before.
  return std::isinf(failure.margin) ? "never judged" : number(failure.margin, unit.c_str());
}

constexpr std::size_t kMostText = 60;  // bytes

/// Reasons may be long: whole words of them.
std::string shortened(const std::string& text) {
  if (text.size() <= kMostText) return text;
  const std::size_t blank = text.rfind(' ', kMostText - 1);
  return blank == std::string::npos || blank < kMostText / 2 ? clipped(text, kMostText - 1)
                                                             : text.substr(0, blank) + " …";
}

/// Columns that culprits take: as wide as the longest name, of pairs twice that, but no wider than shortened() leaves
/// it.
std::size_t culprit_width(const CampaignInfo& info) {
  std::size_t longest = 0, widest = std::string("culprit").size();
  for (const auto* names : {&info.links, &info.actuator_names, &info.colliders}) {
    for (const std::string& name : *names) longest = std::max(longest, name.size());
  }
  const auto widen = [&](const CampaignInfo::RequirementRow& row, std::size_t before) {
    if (row.parts.empty() && before == 0) return;
    const std::size_t name = row.parts.empty() ? 0 : row.parts == "pairs" ? 2 * longest + 5 : longest;
    widest = std::max(widest, before + name);
  };
  for (const auto& requirement : info.requirements) widen(requirement, 0);
  for (const auto& leaf : info.leaves) widen(leaf, info.leaves.size() > 1 ? leaf.description.size() + 2 : 0);
  return std::min(widest, kMostText);
}

}  // namespace

Failure describe_failure(const FailureTable& table, const FailureTable::Row& row, const std::string& policy,
                         const CampaignInfo& info) {
  Failure out{policy, row.particle, row.outcome, "objective", row.time, row.margin};
  out.unconverged = row.unconverged;
  out.flagged = row.unconverged > info.unconverged;
  out.trust = needs_trust(info);
  if (row.outcome != Outcome::invalid) out.culprit = culprit_text(row.violated, row.culprit, info);
  if (row.outcome == Outcome::known_failure) {
    const auto& requirement = info.requirements[static_cast<std::size_t>(row.violated)];
    out.what = requirement.name;
    out.unit = requirement.unit;
  } else if (row.outcome == Outcome::invalid) {
    out.what = table.reasons[row.reason];
  } else if (row.culprit.leaf >= 0) {
    out.unit = info.leaves.at(static_cast<std::size_t>(row.culprit.leaf)).unit;  // of the witness that fell short
  }
  return out;
}

bool needs_trust(const CampaignInfo& info) {
  // The sums of the controllers' files are kept in place of the files (engine/library/library_use.h).
  return std::any_of(info.source.inputs.begin(), info.source.inputs.end(),
                     [](const auto& input) { return input.first.ends_with(".sha256"); });
}

std::string replay_command(const std::string& archive, const std::string& policy, std::uint32_t particle, bool trust) {
  return fmt::format("graze replay {} --particle {} {}{}", shell_path(archive), particle,
                     shell_option("--policy", policy), trust ? " --trust" : "");
}

std::string resume_command(const std::string& archive, bool trust) {
  return fmt::format("graze resume {}{}", shell_path(archive), trust ? " --trust" : "");
}

void WaysToFail::add(const TraceOutcome& trace) {
  if (trace.outcome == Outcome::success) return;
  Way& way = ways_[{trace.outcome, trace.violated}];
  way.first = way.traces == 0 ? trace.particle : std::min(way.first, trace.particle);
  ++way.traces;
}

std::vector<Failure> WaysToFail::firsts(const Archive& archive, const std::string& policy) const {
  std::map<std::uint32_t, std::uint64_t> traces;  // by the particle that stands for them
  for (const auto& [kind, way] : ways_) traces[way.first] = way.traces;
  if (traces.empty()) return {};
  const FailureTable table =
      failures_of(archive, policy, [&](std::uint32_t particle) { return traces.contains(particle); });
  std::vector<Failure> out;
  for (const FailureTable::Row& row : table.rows) {
    out.push_back(describe_failure(table, row, policy, archive.info()));
    out.back().alike = traces.at(row.particle);
  }
  return out;
}

std::string format_failures(const std::vector<Failure>& failures, const std::string& archive, const std::string& list,
                            std::size_t most) {
  if (failures.empty()) return "";
  std::string reasons;  // that do not fit into the table
  // How many went this way, then the one that stands for them: the others may have another culprit.
  std::vector<std::vector<std::string>> rows = {
      {"policy", "outcome", "what", "traces", "particle", "its culprit", "time", "margin", "replay"}};
  for (const Failure& failure : failures) {
    if (rows.size() > most) break;
    const bool others = failure.outcome == Outcome::invalid && failure.alike > 1;  // they may have other reasons
    const std::string what = (others ? "e.g. " : "") + failure.what;
    if (shortened(what) != what) {
      reasons += fmt::format("{}, particle {}: {}\n", failure.policy, failure.particle, printable(failure.what));
    }
    rows.push_back({failure.policy, std::string(outcome_name(failure.outcome)), shortened(what),
                    std::to_string(failure.alike), std::to_string(failure.particle), shortened(failure.culprit),
                    number(failure.time, " s"), margin_text(failure),
                    replay_command(archive, failure.policy, failure.particle, failure.trust)});
  }
  std::uint64_t traces = 0;
  for (const Failure& failure : failures) traces += failure.alike;
  std::string out = fmt::format("\nFailures, the first of each kind ('{}' lists all {})\n", list, traces);
  out += text_table(rows, rows[0].size());
  const std::size_t left = failures.size() - (rows.size() - 1);
  if (left > 0) out += fmt::format("… and {} more kinds\n", left);
  return out + reasons;
}

void list_traces(const Archive& archive, Listed which, const std::vector<std::string>& policies,
                 const std::string& name, bool flagged, std::ostream& out) {
  std::size_t policy = 6, what = 9;
  const std::size_t culprit = culprit_width(archive.info());
  for (const std::string& one : policies) policy = std::max(policy, one.size());
  for (const auto& one : archive.info().requirements) what = std::max(what, one.name.size());
  const auto line = [&](const std::string& mark, const std::string& replay, const auto&... cells) {
    return fmt::format("{:<{}}  {:>8}  {:<15}  {:<{}}  {:<{}}  {:>11}  {:>14}  ", cells...) +
           (flagged ? fmt::format("{:<7}  ", mark) : "") + replay + "\n";
  };
  out << line("flagged", "replay", "policy", policy, "particle", "outcome", "what", what, "culprit", culprit, "time",
              "margin");
  for_each_listed(archive, which, policies, [&](const Failure& failure) {
    out << line(failure.flagged ? percent(failure.unconverged) : "",
                replay_command(name, failure.policy, failure.particle, failure.trust), printable(failure.policy),
                policy, failure.particle, outcome_name(failure.outcome), printable(failure.what), what,
                shortened(printable(failure.culprit)), culprit, number(failure.time, " s"), margin_text(failure));
  });
}

std::string failure_json(const Failure& failure, const std::string& archive) {
  const bool known = failure.outcome == Outcome::known_failure, invalid = failure.outcome == Outcome::invalid;
  const Json json = {{"policy", failure.policy},
                     {"particle", failure.particle},
                     {"outcome", outcome_name(failure.outcome)},
                     {"requirement", known ? Json(failure.what) : Json(nullptr)},
                     {"reason", invalid ? Json(failure.what) : Json(nullptr)},
                     {"culprit", failure.culprit.empty() ? Json(nullptr) : Json(failure.culprit)},
                     {"time", json_of(failure.time)},
                     {"margin", json_of(failure.margin)},
                     {"unit", failure.unit},
                     {"alike", failure.alike},
                     {"unconverged", json_of(failure.unconverged)},
                     {"flagged", failure.flagged},
                     {"replay", replay_command(archive, failure.policy, failure.particle, failure.trust)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void list_traces_json(const Archive& archive, Listed which, const std::vector<std::string>& policies,
                      const std::string& name, std::ostream& out) {
  const char* comma = "";
  for_each_listed(archive, which, policies, [&](const Failure& failure) {
    out << comma << "\n    " << failure_json(failure, name);
    comma = ",";
  });
}

}  // namespace graze
