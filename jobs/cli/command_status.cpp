// graze status: how far a campaign is, while it runs or afterwards.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/convergence.h"
#include "analysis/failures.h"
#include "analysis/text_table.h"
#include "archive/archive.h"
#include "archive/directory/campaign_directory.h"
#include "archive/directory/campaign_files.h"
#include "archive/directory/set_aside.h"
#include "archive/directory/unfinished.h"
#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "archive/outcomes.h"
#include "jobs/campaign/shard_rate.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/progress.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"
#include "jobs/cli/simulate.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct Counts {
  std::string policy;
  std::uint64_t done = 0, unfinished = 0;
  std::array<std::uint64_t, 4> by_outcome{};
  Convergence convergence;  // of the contact solver
};

struct Status {
  bool complete = false;
  bool packed = false;  // one file
  bool trust = false;   // needs_trust()
  Replacing replacing = Replacing::none;
  ParticleRange part;  // if it is one of several; of `particles`
  std::uint64_t particles = 0;
  std::string results_version;  // both of the program that began it
  BuildFacts build;
  double unconverged = 0;  // share of steps, above which a trace is flagged
  std::optional<std::string> writer;
  std::uint64_t done = 0, total = 0, shards = 0;
  std::vector<Counts> policies;
  std::vector<std::string> requirements;
  std::vector<std::uint64_t> violated;  // traces by the requirement that was violated first
  std::vector<UnfinishedTrace> unfinished;
  std::optional<double> rate;  // traces per second of the present writer; nothing: not known

  /// Traces that the present writer has still to do.
  std::uint64_t left() const { return total - std::min<std::uint64_t>(total, done + unfinished.size()); }
  std::optional<double> seconds_left() const {
    return rate ? std::optional(static_cast<double>(left()) / *rate) : std::nullopt;
  }
  std::uint64_t of(Outcome outcome) const {
    std::uint64_t sum = 0;
    for (const Counts& counts : policies) sum += counts.by_outcome[static_cast<std::size_t>(outcome)];
    return sum;
  }
};

Counts counts_of(const Archive& archive, const std::string& policy, Status& status) {
  Counts counts;
  counts.policy = policy;
  ConvergenceSum convergence;
  visit_outcomes(archive, policy, [&](std::span<const TraceOutcome> traces) {
    counts.done += traces.size();
    for (const TraceOutcome& trace : traces) {
      ++counts.by_outcome[static_cast<std::size_t>(trace.outcome)];
      if (trace.violated >= 0) ++status.violated[static_cast<std::size_t>(trace.violated)];
      convergence.add(trace);
    }
  });
  counts.convergence = convergence.total();
  for (const UnfinishedTrace& trace : status.unfinished) counts.unfinished += trace.policy == policy;
  return counts;
}

Status status_of(const fs::path& path) {
  Status out;
  out.packed = !fs::is_directory(path);
  if (!out.packed) {
    const Directory directory(path);
    out.writer = writer_of(directory);
    out.rate = writing_rate(directory);
    if (why_no_list(directory).empty()) out.unfinished = read_unfinished(directory);  // else a warning says so
    out.shards = shard_names(directory).size();
    out.replacing = interrupted_replacing(directory).what;
  }
  const Archive archive(path);
  warn(archive.warnings());
  const CampaignInfo& info = archive.info();
  out.complete = archive.complete();
  out.trust = needs_trust(info);
  out.part = info.part;
  out.particles = info.particles;
  out.results_version = info.results_version;
  out.build = info.build;
  out.unconverged = info.unconverged;
  out.total = info.part.count(info.particles) * info.policies.size();
  for (const auto& requirement : info.requirements) {
    if (!requirement.measure) out.requirements.push_back(requirement.name);
  }
  out.violated.resize(out.requirements.size());
  for (const std::string& policy : info.policies) {
    out.policies.push_back(counts_of(archive, policy, out));
    out.done += out.policies.back().done;
  }
  return out;
}

/// "upright 12, clears-curb 3, unknown 4"
std::string failures(const Status& status) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < status.requirements.size(); ++i) {
    if (status.violated[i] > 0)
      parts.push_back(fmt::format("{} {}", printable(status.requirements[i]), status.violated[i]));
  }
  const std::uint64_t unknown = status.of(Outcome::unknown_failure);
  if (unknown > 0) parts.push_back(fmt::format("unknown {}", unknown));
  const std::uint64_t invalid = status.of(Outcome::invalid);
  if (invalid > 0) parts.push_back(fmt::format("invalid {}", invalid));
  return parts.empty() ? "none" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string progress_of(const Status& status) {
  std::string out =
      fmt::format("  {} of {} traces ({:.1f} %)", status.done, status.total,
                  status.total ? 100.0 * static_cast<double>(status.done) / static_cast<double>(status.total) : 0.0);
  if (status.shards > 0) out += fmt::format(" in {} shard{}", status.shards, status.shards == 1 ? "" : "s");
  if (!status.writer || status.complete) return out + "\n";
  if (!status.rate) return out + "; rate and time left are not known\n";
  return out + fmt::format(", {:.1f} per second, about {} left\n", *status.rate, duration_text(*status.seconds_left()));
}

std::string state_of(const std::string& name, const Status& status) {
  const std::string resume = "'" + resume_command(name, status.trust) + "'";
  if (!status.writer && status.replacing == Replacing::stuck) {
    return std::string(status.complete ? "complete" : "stopped") + "; " + resume + " refuses it as it is (see above)";
  }
  if (!status.writer && status.replacing == Replacing::comes_back) {
    return "killed before its first shard; " + resume + " brings back what it replaced";
  }
  if (status.complete) return "complete";
  if (status.writer) return "running (" + *status.writer + ")";
  if (status.packed) return "packed before it was complete; a directory can go on, this file cannot";
  return "stopped; " + resume + " does the rest";
}

std::string text_of(const std::string& name, const Status& status) {
  const std::string state = state_of(name, status);
  std::string out = fmt::format("{}: {}\n", name, state);
  if (status.part.end > 0) {
    out +=
        fmt::format("  one part: particles {} to {} of {}\n", status.part.begin, status.part.end - 1, status.particles);
  }
  out += progress_of(status);
  out += fmt::format("  failures{}: {}\n", status.complete ? "" : " so far", failures(status));
  std::vector<std::vector<std::string>> table = {
      {"policy", "done", "success", "known failure", "unknown failure", "invalid", "unfinished"}};
  std::vector<NamedConvergence> convergence;
  for (const Counts& counts : status.policies) {
    convergence.push_back({counts.policy, counts.convergence});
    std::vector<std::string> row = {counts.policy, fmt::format("{}", counts.done)};
    for (const std::uint64_t n : counts.by_outcome) row.push_back(fmt::format("{}", n));
    row.push_back(fmt::format("{}", counts.unfinished));
    table.push_back(std::move(row));
  }
  out += "\n" + text_table(table, 1) + convergence_table(convergence, flag_rule(status.unconverged));
  if (status.unfinished.empty()) return out;
  return out + "\nUnfinished, " + why_unfinished(status.unfinished) + "; '" + resume_command(name, status.trust) +
         "' tries them again" + unfinished_text(status.unfinished, name, status.trust) + "\n";
}

nlohmann::ordered_json or_null(const std::optional<double>& number) {
  return number ? nlohmann::ordered_json(*number) : nlohmann::ordered_json();
}

std::string json_of(const Status& status) {
  nlohmann::ordered_json out;
  out["state"] = status.complete ? "complete" : status.writer ? "running" : "stopped";
  out["writer"] = status.writer ? nlohmann::ordered_json(*status.writer) : nlohmann::ordered_json();
  out["done"] = status.done;
  out["total"] = status.total;
  out["shards"] = status.shards;
  out["results_version"] = status.results_version;
  out["build"] = nlohmann::ordered_json::object();
  each_fact(status.build, [&](const char* name, const std::string& text) { out["build"][name] = text; });
  out["traces_per_second"] = or_null(status.rate);
  out["seconds_left"] = or_null(status.seconds_left());
  for (const Counts& counts : status.policies) {
    nlohmann::ordered_json& row = out["policies"][counts.policy];
    row["done"] = counts.done;
    for (std::size_t i = 0; i < counts.by_outcome.size(); ++i) {
      std::string key(outcome_name(static_cast<Outcome>(i)));
      std::replace(key.begin(), key.end(), ' ', '_');
      row[key] = counts.by_outcome[i];
    }
    row["unfinished"] = counts.unfinished;
    row["convergence"] = convergence_json(counts.convergence);
  }
  out["unconverged_limit"] = status.unconverged;
  out["violated_first"] = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < status.requirements.size(); ++i) {
    out["violated_first"][status.requirements[i]] = status.violated[i];
  }
  out["unfinished"] = nlohmann::ordered_json::array();
  for (const UnfinishedTrace& trace : status.unfinished) {
    out["unfinished"].push_back({{"policy", trace.policy}, {"particle", trace.particle}, {"reason", trace.reason}});
  }
  return out.dump(2) + "\n";
}

}  // namespace

void add_status(CLI::App& app, Action& action) {
  struct Arguments {
    std::string archive;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = add_verb(app, "status", "How far a campaign is, while it runs or afterwards",
                            "  graze status quadruped_curb.graze\n"
                            "  graze status quadruped_curb.graze --json\n");
  add_archive(*verb, arguments->archive);
  verb->add_flag("--json", arguments->json, "Print as JSON");
  verb->callback([arguments, &action] {
    action = [arguments] {
      return in_reading_child({arguments->archive}, [&] {
        const Status status = status_of(arguments->archive);
        std::cout << (arguments->json ? json_of(status) : text_of(arguments->archive, status));
        return kDone;
      });
    };
  });
}

}  // namespace graze
