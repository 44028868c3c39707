#include "jobs/shard_rate.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "archive/campaign_directory.h"
#include "archive/lock.h"
#include "archive/manifest.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr double kSlack = 2;        // s: clocks of a network's machines differ, and file systems round
constexpr double kMuchLonger = 20;  // times the usual gap, and at least as many seconds: a jump or a pause

double seconds(fs::file_time_type time) { return std::chrono::duration<double>(time.time_since_epoch()).count(); }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::optional<double> rate_of(double begin, double now, std::vector<ShardTime> shards) {
  const auto in_future = [&](double time) { return time > now + kSlack; };
  if (in_future(begin)) return std::nullopt;
  if (std::any_of(shards.begin(), shards.end(), [&](const ShardTime& shard) { return in_future(shard.time); })) {
    return std::nullopt;
  }
  std::erase_if(shards, [&](const ShardTime& shard) { return shard.time < begin; });
  if (shards.empty()) return std::nullopt;
  std::sort(shards.begin(), shards.end(), [](const ShardTime& a, const ShardTime& b) { return a.time < b.time; });
  std::vector<double> gaps;
  double last = begin;
  for (const ShardTime& shard : shards) gaps.push_back(shard.time - std::exchange(last, shard.time));
  const double usual = median(gaps);
  if (now - last > usual) {  // the next shard is late
    gaps.push_back(now - last);
    shards.push_back({now, 0});
  }
  double traces = 0, time = 0;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (gaps[i] > kMuchLonger * std::max(usual, 1.0)) continue;
    traces += static_cast<double>(shards[i].traces);
    time += gaps[i];
  }
  if (traces <= 0 || time <= 0) return std::nullopt;
  return traces / time;
}

std::optional<double> writing_rate(const fs::path& directory) {
  if (!writer_of(directory)) return std::nullopt;
  std::error_code error;
  const double begin = seconds(fs::last_write_time(directory / kLockFile, error));
  if (error) return std::nullopt;
  std::vector<ShardTime> shards;
  for (const auto& [name, entry] : read_manifest(directory)) {
    const double time = seconds(fs::last_write_time(directory / kShardFolder / name, error));
    if (error) continue;
    ShardTime& shard = shards.emplace_back(ShardTime{time, 0});
    for (const ShardEntry::Traces& traces : entry.traces) shard.traces += traces.count;
  }
  return rate_of(begin, seconds(fs::file_time_type::clock::now()), std::move(shards));
}

}  // namespace graze
