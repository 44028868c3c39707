#include "jobs/campaign/sweep_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "archive/archive.h"
#include "archive/directory/unfinished.h"
#include "jobs/campaign/sealed_json.h"

namespace graze {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr SealedKind kKind = {"graze sweep", 1, "description of a sweep", std::size_t{1} << 26};

SweepPlan plan_of(const Json& json) {
  SweepPlan out;
  Sweep& sweep = out.sweep;
  json.at("scenario").get_to(sweep.scenario);
  json.at("policies").get_to(sweep.policies);
  json.at("particles").get_to(out.particles);
  for (const Json& one : json.at("axes")) {
    SweepAxis& axis = sweep.axes.emplace_back();
    one.at("path").get_to(axis.path);
    one.at("unit").get_to(axis.unit);
    one.at("numeric").get_to(axis.numeric);
    one.at("texts").get_to(axis.texts);
    one.at("values").get_to(axis.values);
    if (axis.texts.empty() || axis.texts.size() != axis.values.size()) throw InputError("an axis without its values");
  }
  if (sweep.axes.empty() || sweep.axes.size() > 2 || sweep.policies.empty() || out.particles == 0) {
    throw InputError("a sweep has one axis or two, policies and particles");
  }
  if (const Json& adaptive = json.at("adaptive"); !adaptive.is_null()) {
    sweep.adaptive = true;
    adaptive.at("width").get_to(sweep.rule.width);
    adaptive.at("level").get_to(sweep.rule.level);
    adaptive.at("least").get_to(sweep.rule.least);
    const SweepRule& rule = sweep.rule;
    if (!(rule.width > 0 && rule.width < 1 && rule.level > 0 && rule.level < 1 && rule.least > 0)) {
      throw InputError("an adaptive sweep whose numbers are out of range");
    }
  }
  number_points(sweep);
  return out;
}

/// Until the first violation of a requirement that decides; seen without one until its end.
Lifetime lifetime_of(const TraceRows& rows, std::size_t trace, std::size_t deciding) {
  Lifetime out{std::isfinite(rows.end_time(trace)) ? rows.end_time(trace) : 0, false};  // else forged
  const std::span<const double> violations = rows.first_violations(trace);
  for (std::size_t r = 0; r < std::min(deciding, violations.size()); ++r) {
    if (!std::isfinite(violations[r])) continue;
    out = {std::min(out.time, violations[r]), true};
  }
  return out;
}

}  // namespace

void number_points(Sweep& sweep) {
  std::size_t count = 1;
  for (const SweepAxis& axis : sweep.axes) count *= axis.texts.size();
  if (count > kMostSweepPoints) {
    throw InputError(fmt::format("--over: {} values in all; at most {}: larger steps, or one --over alone", count,
                                 kMostSweepPoints));
  }
  sweep.points.clear();
  for (std::size_t i = 0; i < count; ++i) {
    SweepPoint& point = sweep.points.emplace_back();
    std::size_t rest = i;
    for (const SweepAxis& axis : sweep.axes) {
      point.at.push_back(rest % axis.texts.size());
      rest /= axis.texts.size();
    }
    point.campaign = fmt::format("{:03}.graze", i);
    point.traces.resize(sweep.policies.size());
  }
}

void write_plan(const fs::path& folder, const SweepPlan& plan, const std::vector<CampaignInfo>& campaigns,
                const std::string& command_line) {
  const Sweep& sweep = plan.sweep;
  Json json = {{"scenario", sweep.scenario}, {"command_line", command_line}, {"particles", plan.particles},
               {"policies", sweep.policies}, {"adaptive", nullptr},          {"axes", Json::array()},
               {"points", Json::array()}};
  if (sweep.adaptive) {
    json["adaptive"] = {{"width", sweep.rule.width}, {"level", sweep.rule.level}, {"least", sweep.rule.least}};
  }
  for (const SweepAxis& axis : sweep.axes) {
    json["axes"].push_back({{"path", axis.path},
                            {"unit", axis.unit},
                            {"numeric", axis.numeric},
                            {"texts", axis.texts},
                            {"values", axis.values}});
  }
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {  // read_plan() numbers them itself
    const SweepPoint& point = sweep.points[i];
    Json one = {{"campaign", point.campaign}, {"scenario_sha256", campaigns.at(i).scenario_sha256}};
    for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
      one[sweep.axes[axis].path] = sweep.axes[axis].texts[point.at[axis]];
    }
    json["points"].push_back(std::move(one));
  }
  write_sealed(folder, kSweepFile, json, kKind);
}

bool is_sweep(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / kSweepFile, error);
}

SweepPlan read_plan(const fs::path& folder) {
  return read_sealed((folder / kSweepFile).string(), kKind, [](const Json& json) {
    SweepPlan out = plan_of(json);
    for (std::size_t i = 0; i < out.sweep.points.size(); ++i) {
      json.at("points").at(i).at("scenario_sha256").get_to(out.sweep.points[i].scenario);
    }
    return out;
  });
}

bool has_particles(const fs::path& campaign, std::uint64_t particles) {
  const Archive archive(campaign);
  return archive.complete() && archive.info().particles >= particles;
}

bool lacks_unfinished_only(const fs::path& campaign) {
  const std::uint64_t unfinished = read_unfinished(campaign).size();
  if (unfinished == 0) return false;
  const Archive archive(campaign);
  std::uint64_t finished = 0;
  for (const std::string& policy : archive.info().policies) {
    archive.scan(policy, 0, [&](const TraceRows& rows) { finished += rows.size(); });
  }
  return finished + unfinished == archive.info().particles * archive.info().policies.size();
}

std::uint64_t described_particles(const fs::path& campaign) {
  try {
    return Archive(campaign).info().particles;
  } catch (const InputError&) {
    return 0;
  }
}

void read_traces(const fs::path& folder, const Sweep& sweep, SweepPoint& point) {
  const Archive archive(folder / point.campaign);
  if (archive.info().policies != sweep.policies) {
    throw InputError(fmt::format("{}: its policies are not those of {}", (folder / point.campaign).string(),
                                 (folder / kSweepFile).string()));
  }
  if (archive.info().scenario_sha256 != point.scenario) {
    throw InputError(fmt::format("{}: its scenario is not that of this value in {}; were campaigns exchanged?",
                                 (folder / point.campaign).string(), (folder / kSweepFile).string()));
  }
  point.particles = archive.info().particles;
  point.lifetimes.assign(sweep.policies.size(), {});
  point.digests.assign(sweep.policies.size(), std::vector<std::uint64_t>(point.particles, 0));
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    std::vector<std::int8_t>& traces = point.traces[policy];
    traces.assign(point.particles, kNoTrace);
    archive.scan(sweep.policies[policy], kEndTime | kFirstViolations | kDigest, [&](const TraceRows& rows) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        traces.at(rows.particle(i)) = static_cast<std::int8_t>(rows.outcome(i));
        point.digests[policy][rows.particle(i)] = rows.digest(i);
        if (rows.outcome(i) == Outcome::invalid) continue;
        point.lifetimes[policy].push_back(lifetime_of(rows, i, archive.info().deciding()));
      }
    });
  }
}

}  // namespace graze
