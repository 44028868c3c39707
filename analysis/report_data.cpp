#include "analysis/report_data.h"

#include <fmt/format.h>

#include <cmath>

#include "analysis/number_words.h"
#include "analysis/report_families.h"
#include "analysis/report_margins.h"

namespace graze {
namespace {

constexpr std::size_t kMostWays = 500;  // lines of the breakdown: reasons of invalid traces may be very many

Json rows_of(const std::vector<CampaignInfo::RequirementRow>& rows) {
  Json out = Json::array();
  for (const auto& row : rows) {
    out.push_back({{"name", row.name}, {"description", row.description}, {"unit", row.unit}, {"measure", row.measure}});
  }
  return out;
}

Json ways_json(const ReportInput& input) {
  Json out = Json::array();
  for (const FailureWay& way : input.ways) {
    if (out.size() == kMostWays) break;
    out.push_back(
        {{"policy", way.policy},
         {"outcome", outcome_name(way.outcome)},
         {"what", way.what},
         {"culprit", way.culprit},
         {"traces", way.traces},
         {"earliest", short_number(way.earliest)},
         {"earliest_particle", way.earliest_particle},
         {"worst", short_number(way.worst)},
         {"unit", way.unit},
         {"worst_particle", way.worst_particle},
         {"typical_particle", way.typical_particle},
         {"replay", replay_command(input.score.archive, way.policy, way.earliest_particle, input.score.trust)}});
  }
  return out;
}

Json families_json(const CampaignInfo& info, const ReportInput& input) {
  std::vector<std::string> policies;
  for (const PolicyScore& policy : input.score.policies) policies.push_back(policy.policy);
  Json out = Json::array();
  for (const PolicyFamily& family : policy_families(info, policies)) {
    Json axes = Json::array(), members = Json::array();
    for (const PolicyFamily::Axis& axis : family.axes) {
      axes.push_back({{"key", axis.key}, {"unit", axis.unit}, {"numeric", axis.numeric}});
    }
    for (const PolicyFamily::Member& member : family.members) {
      members.push_back({{"policy", member.policy}, {"labels", member.labels}, {"values", member.values}});
    }
    out.push_back({{"name", family.name}, {"axes", axes}, {"members", members}});
  }
  return out;
}

Json margins_json(const Archive& archive, const ReportSample& sample) {
  Json out = Json::array();
  for (const MarginHistogram& one : margin_histograms(archive, sample)) {
    Json policies = Json::array();
    for (const MarginHistogram::Counts& counts : one.policies) {
      policies.push_back({{"policy", counts.policy}, {"bins", counts.bins}, {"unjudged", counts.unjudged}});
    }
    out.push_back({{"name", one.name},
                   {"unit", one.unit},
                   {"measure", one.measure},
                   {"edges", numbers(one.edges, NumberForm::plain)},
                   {"policies", policies}});
  }
  return out;
}

Json traces_json(const ReportSample& sample, NumberForm form) {
  Json policies = Json::array();
  for (const SampledTraces& traces : sample.policies) {
    Json margins = Json::array();
    for (const std::vector<double>& column : traces.margins) margins.push_back(numbers(column, form));
    policies.push_back({{"policy", traces.policy},
                        {"outcome", traces.outcome},
                        {"end", numbers(traces.end, form)},
                        {"objective", numbers(traces.objective, form)},
                        {"margins", margins}});
  }
  return {{"first", sample.first}, {"count", sample.count}, {"policies", policies}};
}

Json parameters_json(const CampaignInfo& info, const ReportSample& sample, NumberForm form) {
  Json out = Json::array();
  for (std::size_t k = 0; k < sample.values.size(); ++k) {
    const CampaignInfo::ParameterRow& row = info.parameters[k];
    out.push_back({{"name", row.name},
                   {"unit", row.unit},
                   {"distribution", row.distribution},
                   {"nominal", short_number(row.nominal)},
                   {"labels", row.labels},
                   {"values", numbers(sample.values[k], form)}});
  }
  return out;
}

/// What heads the page: how many traces rest on contacts that did not converge.
Json page_notes(const Score& score) {
  Json out = Json::array();
  std::uint64_t flagged = 0;
  for (const PolicyScore& policy : score.policies) flagged += policy.convergence.flagged_all();
  if (flagged == 0) return out;
  out.push_back(fmt::format("{} flagged: contacts of {} did not converge ('{}' lists them).",
                            graze::counted(flagged, "trace is", "traces are"),
                            fmt::format("more than {:.3g} % of the steps", 100 * score.unconverged),
                            score.flagged_command));
  return out;
}

}  // namespace

ReportInput read_report(const Archive& archive, const std::string& name, const std::vector<std::string>& policies) {
  return {score(archive, name, policies), failure_ways(archive, policies), sample_traces(archive, policies)};
}

Json campaign_json(const CampaignInfo& info, const std::string& archive) {
  return {{"name", info.scenario_name},
          {"archive", archive},
          {"command", info.command_line},
          {"started", info.start_time},
          {"program", info.program_version + " (" + info.program_revision + ")"},
          {"results_version", info.results_version},
          {"scenario_sha256", info.scenario_sha256},
          {"physics", info.physics},
          {"design", info.design},
          {"seed", info.seed},
          {"particles", info.particles},
          {"parameters", info.parameters.size()},
          {"step", info.step},
          {"control", info.control},
          {"end", info.end},
          {"objective", info.objective},
          {"leaves", rows_of(info.leaves)},
          {"requirements", rows_of(info.requirements)},
          {"colliders", info.colliders},
          {"policies", info.policies}};
}

Json report_data(const Archive& archive, const ReportInput& input, NumberForm form) {
  const CampaignInfo& info = archive.info();
  return {{"kind", "report"},
          {"campaign", campaign_json(info, input.score.archive)},
          {"score", Json::parse(score_json(input.score))},
          {"ways", ways_json(input)},
          {"ways_left_out", input.ways.size() - std::min(input.ways.size(), kMostWays)},
          {"families", families_json(info, input)},
          {"margins", margins_json(archive, input.sample)},
          {"traces", traces_json(input.sample, form)},
          {"parameters", parameters_json(info, input.sample, form)},
          {"channels", Json::array()},
          {"trajectories", Json::array()},
          {"notes", page_notes(input.score)},
          {"sections", Json::array()}};
}

std::string script_json(const Json& data) {
  const std::string text = data.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string out;
  out.reserve(text.size() + text.size() / 64);
  for (const char c : text) {
    switch (c) {  // stand in strings only, where an escape means the same
      case '<':
        out += "\\u003c";
        break;
      case '>':
        out += "\\u003e";
        break;
      case '&':
        out += "\\u0026";
        break;
      default:
        out += c;
    }
  }
  return out;
}

}  // namespace graze
