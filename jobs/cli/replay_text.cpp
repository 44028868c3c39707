// A replay as people read it, and as JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/convergence.h"
#include "analysis/event_text.h"
#include "analysis/json_of.h"
#include "analysis/text_table.h"
#include "archive/files/utf8.h"
#include "archive/schema/culprit.h"
#include "archive/schema/kept.h"
#include "engine/settings/units.h"
#include "jobs/campaign/replay.h"
#include "simulation/results_epoch.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;
using graze::json_of;
using Rows = std::vector<std::vector<std::string>>;

constexpr std::size_t kFewParameters = 12, kFewEvents = 20;

std::string with_unit(double x, const std::string& unit) {
  return std::isnan(x) ? "-"
                       : fmt::format("{:.6g}{}{}", x, unit.empty() || unit == "1" ? "" : " ", unit == "1" ? "" : unit);
}

/// Choices that are not the nominal one first, then by standard deviations.
std::vector<const ReplayedParameter*> by_deviation(const std::vector<ReplayedParameter>& parameters) {
  std::vector<const ReplayedParameter*> out;
  for (const ReplayedParameter& parameter : parameters) out.push_back(&parameter);
  const auto rank = [](const ReplayedParameter* p) {
    if (std::isnan(p->deviations)) return !p->value_label.empty() && p->value != p->nominal ? HUGE_VAL : -1.0;
    return std::abs(p->deviations);
  };
  std::stable_sort(out.begin(), out.end(), [&](const auto* a, const auto* b) { return rank(a) > rank(b); });
  return out;
}

std::string parameter_table(const Replay& replay, bool all) {
  const std::vector<const ReplayedParameter*> parameters = by_deviation(replay.file.parameters);
  if (parameters.empty()) return "\nNothing is uncertain: the particle is the nominal robot\n";
  const std::size_t shown = all ? parameters.size() : std::min(parameters.size(), kFewParameters);
  Rows rows = {{"parameter", "value", "nominal", "from nominal", "std from mean", "distribution"}};
  for (std::size_t i = 0; i < shown; ++i) {
    const ReplayedParameter& p = *parameters[i];
    const bool choice = !p.value_label.empty();
    rows.push_back({p.name, choice ? p.value_label : with_unit(p.value, p.unit),
                    choice ? p.nominal_label : with_unit(p.nominal, p.unit),
                    choice || std::isinf(p.nominal) ? "" : fmt::format("{:+.3g}", p.value - p.nominal),
                    std::isnan(p.deviations) ? "" : fmt::format("{:+.2f}", p.deviations),
                    rounded_numbers(p.distribution)});
  }
  const std::string title =
      shown == parameters.size()
          ? "All parameters of the particle, the farthest from the mean of their distribution first"
          : fmt::format(
                "Parameters of the particle, the {} of {} farthest from the mean of their distribution (--all: every "
                "one)",
                shown, parameters.size());
  return "\n" + title + "\n" + text_table(rows, 6);
}

/// What fabrication made of the particle, where that is not nominal.
std::string derived_table(const Replay& replay) {
  Rows rows = {{"of the robot", "value", "nominal", "deviation"}};
  for (const ReplayedNumber& n : replay.file.derived) {
    if (n.value == n.nominal) continue;
    rows.push_back({n.name, with_unit(n.value, n.unit), with_unit(n.nominal, n.unit),
                    fmt::format("{:+.3g}", n.value - n.nominal)});
  }
  return rows.size() == 1 ? ""
                          : "\nWhat fabrication made of the particle, where it is not nominal\n" + text_table(rows, 1);
}

/// The part of a requirement's witness; empty: none, or only one is possible.
std::string culprit_of(const ReplayFile& file, const std::vector<int>& parts, std::size_t requirement) {
  return requirement < parts.size() ? culprit_text(static_cast<int>(requirement), {-1, parts[requirement]}, file.info)
                                    : "";
}

std::string by(const std::string& culprit) { return culprit.empty() ? "" : " by " + printable(culprit); }

/// Of a trace in which no step fell into the window: such a margin is infinite, and says nothing.
bool never_judged(const ReplayFile& file, const ReplayedRequirement& requirement, double margin) {
  const Window window{requirement.from, requirement.to};
  return std::isinf(margin) && !window.opens({file.info.step, file.trace.end_time});
}

std::string margin_table(const Replay& replay) {
  const TraceRecord& trace = replay.file.trace;
  Rows rows = {{"requirement", "margin", "by", "violated at", "what"}};
  for (std::size_t i = 0; i < replay.file.requirements.size(); ++i) {
    const ReplayedRequirement& requirement = replay.file.requirements[i];
    const double first = trace.first_violations[i];
    rows.push_back(
        {requirement.name,
         never_judged(replay.file, requirement, trace.margins[i]) ? "never judged"
                                                                  : with_unit(trace.margins[i], requirement.unit),
         culprit_of(replay.file, trace.margin_parts, i),
         std::isnan(first) ? replay.file.kept(i) == "undecided" ? "undecided" : "-" : fmt::format("{:g} s", first),
         (requirement.measure ? "measure: " : "") + requirement.description});
  }
  return rows.size() == 1
             ? ""
             : "\nMargins: the least value of each requirement's witness\n" + text_table(rows, rows[0].size());
}

/// Events, and where requirements were first violated, in order of time.
std::vector<std::string> story(const Replay& replay) {
  const TraceRecord& trace = replay.file.trace;
  std::vector<std::pair<double, std::string>> lines;
  for (const Event& event : trace.events) lines.emplace_back(event.time, event_text(event, replay.file.info));
  for (std::size_t i = 0; i < trace.first_violations.size(); ++i) {
    const ReplayedRequirement& requirement = replay.file.requirements[i];
    if (std::isnan(trace.first_violations[i])) continue;
    lines.emplace_back(
        trace.first_violations[i],
        fmt::format("{}: {}{} ({})", requirement.measure ? "measure not kept" : "VIOLATED", requirement.name,
                    by(culprit_of(replay.file, trace.violation_parts, i)), requirement.description));
  }
  std::stable_sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> out;
  for (const auto& [time, text] : lines) out.push_back(fmt::format("{:9.4f} s  {}", time, text));
  return out;
}

/// The last few lines before the trace's (first) violation, or before its end.
std::string event_list(const Replay& replay, bool all) {
  const std::vector<std::string> lines = story(replay);
  if (lines.empty()) return "";
  std::size_t end = lines.size();
  for (std::size_t i = lines.size(); i-- > 0;) {
    if (lines[i].find("  VIOLATED: ") != std::string::npos) end = i + 1;
  }
  const bool cut = !all && lines.size() > kFewEvents;
  if (!cut) end = lines.size();
  const std::size_t begin = cut && end > kFewEvents ? end - kFewEvents : 0;
  if (cut) end = std::max(end, std::min(lines.size(), kFewEvents));
  std::string out = cut ? fmt::format("\nEvents {} to {} of {} (--all: every one)\n", begin + 1, end, lines.size())
                        : fmt::format("\nAll {} events\n", lines.size());
  for (std::size_t i = begin; i < end; ++i) out += lines[i] + "\n";
  return out;
}

std::string outcome_line(const Replay& replay) {
  const TraceRecord& trace = replay.file.trace;
  std::string out = fmt::format("outcome    {}", outcome_name(trace.outcome));
  if (trace.outcome == Outcome::known_failure) {
    const auto i = static_cast<std::size_t>(trace.violated);
    out += fmt::format(": {} was violated first{}, at {:g} s", replay.file.requirements[i].name,
                       by(culprit_of(replay.file, trace.violation_parts, i)), trace.first_violations[i]);
  } else if (trace.outcome == Outcome::unknown_failure) {
    out += ": nothing was violated, but the objective was not met";
  } else if (trace.outcome == Outcome::invalid) {
    out += ": " + trace.invalid_reason;
  }
  return out + "\n";
}

std::string end_lines(const Replay& replay) {
  const TraceRecord& trace = replay.file.trace;
  const CampaignInfo& info = replay.file.info;
  if (std::isnan(trace.end_time)) return "";
  if (trace.outcome == Outcome::invalid && trace.end_time == 0) return "end        it never began\n";
  const bool cut = cut_short(trace.outcome, trace.end_time, info);
  std::string out = fmt::format("end        {:g} s after {} steps of {:g} s{}\n", trace.end_time,
                                std::llround(trace.end_time / info.step), info.step,
                                cut ? fmt::format("; the violation ended it before its {:g} s", info.end) : "");
  if (std::isnan(trace.objective_margin)) return out;
  const std::string culprit = culprit_text(-1, trace.objective_culprit, info);
  const int leaf = trace.objective_culprit.leaf;
  const std::string unit = leaf < 0 ? "" : info.leaves.at(static_cast<std::size_t>(leaf)).unit;
  const char* const met = cut ? "not met, the trace was cut short" : trace.objective_margin >= 0 ? "met" : "not met";
  if (std::isinf(trace.objective_margin)) {
    // What has no predicate has no margin; one that has was cut short before its time, or its window held no step.
    const char* const why = info.leaves.empty() ? "" : "; it was never judged";
    return out + fmt::format("objective  {}: {}{}\n", info.objective, met, why);
  }
  return out + fmt::format("objective  {}: {}, margin {}{}\n", info.objective, met,
                           with_unit(trace.objective_margin, unit),
                           culprit.empty() ? "" : " (" + printable(culprit) + ")");
}

/// What the archive's program was built with, where that differs from this one.
std::string build_lines(const CampaignInfo& then) {
  std::string out;
  for (const std::string& line : build_differences(then.build, build_facts())) {
    out += (out.empty() ? "built with " : "           ") + printable(line) + "\n";
  }
  return out;
}

std::string verdict_lines(const Replay& replay) {
  const std::string digest = fmt::format("{:#018x}", replay.file.trace.digest);
  std::string out;
  if (const CampaignInfo& then = replay.archived_info; then.results_version != results_version()) {
    out += fmt::format("versions   the archive is of results version {}, this program is {}\n",
                       then.results_version.empty() ? "unknown" : then.results_version, results_version());
  }
  if (!replay.archived)
    return out + fmt::format("digest     {}: NOT VERIFIED, the archive holds no such trace\n", digest);
  if (replay.differences.empty() && replay.file.info.q_names.empty()) {
    return out + "digest     of nothing, as nothing moves; what the archive tells of the trace is the same\n";
  }
  if (replay.differences.empty()) {
    return out + fmt::format("digest     {}, as in the archive: the same trace, bit for bit\n", digest);
  }
  out += "digest     DIFFERENT: this is not the trace of the archive\n";
  for (const std::string& line : replay.differences) out += "           " + line + "\n";
  return out + build_lines(replay.archived_info);
}

Json json_of(const ReplayedParameter& p) {
  Json out = {{"name", p.name},
              {"unit", p.unit},
              {"nominal", json_of(p.nominal)},
              {"value", json_of(p.value)},
              {"deviations", json_of(p.deviations)},
              {"distribution", p.distribution}};
  if (!p.value_label.empty()) out["value_label"] = p.value_label;
  if (!p.nominal_label.empty()) out["nominal_label"] = p.nominal_label;
  return out;
}

Json json_of(const BuildFacts& build) {
  Json out = Json::object();
  each_fact(build, [&](const char* name, const std::string& text) { out[name] = text; });
  return out;
}

Json json_of_verification(const Replay& replay) {
  Json out = {
      {"verdict", replay.file.verification},  {"digest", fmt::format("{:#018x}", replay.file.trace.digest)},
      {"archived_digest", nullptr},           {"differences", replay.differences},
      {"results_version", results_version()}, {"archived_results_version", replay.archived_info.results_version},
      {"build", json_of(build_facts())},      {"archived_build", json_of(replay.archived_info.build)}};
  if (replay.archived) out["archived_digest"] = fmt::format("{:#018x}", replay.archived->digest);
  return out;
}

}  // namespace

std::string format_replay(const Replay& replay, bool all) {
  const ReplayFile& file = replay.file;
  std::string out =
      fmt::format("{}: particle {} under policy {}\n\n", file.info.scenario_name, file.trace.particle, file.policy);
  out += outcome_line(replay) + end_lines(replay) + solver_lines(file.trace.solver, file.info.unconverged) +
         verdict_lines(replay);
  return out + margin_table(replay) + parameter_table(replay, all) + (all ? derived_table(replay) : "") +
         event_list(replay, all);
}

std::string replay_json(const Replay& replay, const std::vector<std::string>& exported) {
  const ReplayFile& file = replay.file;
  const TraceRecord& trace = file.trace;
  Json out = {{"campaign", file.info.scenario_name},
              {"archive", file.archive},
              {"particle", trace.particle},
              {"policy", file.policy},
              {"outcome", outcome_name(trace.outcome)},
              {"violated", nullptr},
              {"invalid_reason", trace.invalid_reason},
              {"end_time", json_of(trace.end_time)},
              {"convergence", solver_json(trace.solver, file.info.unconverged)},
              {"objective",
               {{"name", file.info.objective},
                {"margin", json_of(trace.objective_margin)},
                {"culprit", culprit_text(-1, trace.objective_culprit, file.info)}}},
              {"verification", json_of_verification(replay)},
              {"requirements", Json::array()},
              {"parameters", Json::array()},
              {"derived", Json::array()},
              {"events", Json::array()},
              {"exported", exported}};
  if (trace.violated >= 0) out["violated"] = file.requirements[static_cast<std::size_t>(trace.violated)].name;
  for (std::size_t i = 0; i < file.requirements.size(); ++i) {
    const ReplayedRequirement& one = file.requirements[i];
    out["requirements"].push_back({{"name", one.name},
                                   {"description", one.description},
                                   {"unit", one.unit},
                                   {"measure", one.measure},
                                   {"kept", file.kept(i).empty() ? Json(nullptr) : Json(file.kept(i))},
                                   {"margin", json_of(trace.margins[i])},
                                   {"margin_culprit", culprit_of(file, trace.margin_parts, i)},
                                   {"violation_culprit", culprit_of(file, trace.violation_parts, i)},
                                   {"first_violation", json_of(trace.first_violations[i])}});
  }
  for (const ReplayedParameter* parameter : by_deviation(file.parameters))
    out["parameters"].push_back(json_of(*parameter));
  for (const ReplayedNumber& n : file.derived) {
    out["derived"].push_back({{"name", n.name}, {"unit", n.unit}, {"nominal", n.nominal}, {"value", n.value}});
  }
  for (const Event& event : trace.events) {
    out["events"].push_back({{"time", event.time},
                             {"kind", event_kind_name(event.kind)},
                             {"text", event_text(event, file.info)},
                             {"impulse", json_of(event.impulse)}});
  }
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace graze
