// graze status: how far a campaign is, while it runs or afterwards.
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/text_table.h"
#include "archive/archive.h"
#include "archive/campaign_directory.h"
#include "archive/finished.h"
#include "jobs/commands.h"
#include "jobs/progress.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct Counts {
  std::string policy;
  std::uint64_t done = 0;
  std::array<std::uint64_t, 4> by_outcome{};
};

struct Status {
  bool complete = false;
  std::optional<std::string> writer;
  std::uint64_t done = 0, total = 0, shards = 0;
  std::vector<Counts> policies;
  double rate = 0;  // traces per second of the present writer; 0: not known
};

double seconds_since(fs::file_time_type time) {
  return std::chrono::duration<double>(fs::file_time_type::clock::now() - time).count();
}

Status status_of(const fs::path& path) {
  const Archive archive(path);
  const CampaignInfo& info = archive.info();
  Status out;
  out.complete = archive.complete();
  out.total = info.part.count(info.particles) * info.policies.size();
  for (const std::string& policy : info.policies) {
    const TraceTable table = archive.traces(policy);
    Counts& counts = out.policies.emplace_back();
    counts.policy = policy;
    counts.done = table.size();
    for (const Outcome outcome : table.outcome) ++counts.by_outcome[static_cast<std::size_t>(outcome)];
    out.done += counts.done;
  }
  if (!fs::is_directory(path)) return out;
  out.shards = shard_files(path).size();
  out.writer = writer_of(path);
  return out;
}

/// Traces per second since the present writer took the directory: what its shards hold, by their times.
void measure_rate(const fs::path& path, Status& status) {
  std::error_code error;
  const fs::file_time_type begin = fs::last_write_time(path / kLockFile, error);
  if (error || !status.writer) return;
  const CampaignInfo info = read_description(path);
  std::uint64_t fresh = 0;
  for (const fs::path& shard : shard_files(path)) {
    if (fs::last_write_time(shard, error) >= begin && !error) fresh += traces_in_shard(shard, info);
  }
  const double elapsed = seconds_since(begin);
  if (elapsed > 0) status.rate = static_cast<double>(fresh) / elapsed;
}

std::string text_of(const std::string& name, const Status& status) {
  const std::string state = status.complete ? "complete"
                            : status.writer ? "running (" + *status.writer + ")"
                                            : "stopped; 'graze resume " + name + "' does the rest";
  std::string out =
      fmt::format("{}: {}\n  {} of {} traces ({:.1f} %)", name, state, status.done, status.total,
                  status.total ? 100.0 * static_cast<double>(status.done) / static_cast<double>(status.total) : 0.0);
  if (status.shards > 0) out += fmt::format(" in {} shards", status.shards);
  if (status.rate > 0) {
    out += fmt::format(", {:.1f} per second, about {} left", status.rate,
                       duration_text(static_cast<double>(status.total - status.done) / status.rate));
  }
  std::vector<std::vector<std::string>> table = {
      {"policy", "done", "success", "known failure", "unknown failure", "invalid"}};
  for (const Counts& counts : status.policies) {
    std::vector<std::string> row = {counts.policy, fmt::format("{}", counts.done)};
    for (const std::uint64_t n : counts.by_outcome) row.push_back(fmt::format("{}", n));
    table.push_back(std::move(row));
  }
  return out + "\n\n" + text_table(table, 1);
}

std::string json_of(const Status& status) {
  nlohmann::ordered_json out;
  out["state"] = status.complete ? "complete" : status.writer ? "running" : "stopped";
  out["writer"] = status.writer ? nlohmann::ordered_json(*status.writer) : nlohmann::ordered_json();
  out["done"] = status.done;
  out["total"] = status.total;
  out["shards"] = status.shards;
  out["traces_per_second"] = status.rate;
  for (const Counts& counts : status.policies) {
    nlohmann::ordered_json& row = out["policies"][counts.policy];
    row["done"] = counts.done;
    for (std::size_t i = 0; i < counts.by_outcome.size(); ++i) {
      row[std::string(outcome_name(static_cast<Outcome>(i)))] = counts.by_outcome[i];
    }
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
  verb->add_option("archive", arguments->archive, "Campaign directory or packed file")->required();
  verb->add_flag("--json", arguments->json, "Print as JSON");
  verb->callback([arguments, &action] {
    action = [arguments] {
      Status status = status_of(arguments->archive);
      measure_rate(arguments->archive, status);
      std::cout << (arguments->json ? json_of(status) : text_of(arguments->archive, status));
      return kDone;
    };
  });
}

}  // namespace graze
