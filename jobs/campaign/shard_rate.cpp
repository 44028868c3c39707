#include "jobs/campaign/shard_rate.h"

#include <algorithm>
#include <ctime>
#include <utility>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/manifest.h"
#include "archive/files/lock.h"

namespace graze {
namespace {

constexpr double kSlack = 2;        // s: clocks of a network's machines differ, and file systems round
constexpr double kMuchLonger = 20;  // times the usual gap, and at least as many seconds: a jump or a pause

double seconds(const std::timespec& time) {
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

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

std::optional<double> writing_rate(const Directory& directory) {
  if (!writer_of(directory)) return std::nullopt;
  const struct stat lock = directory.status(kLockFile);
  if (lock.st_mode == 0) return std::nullopt;
  std::vector<ShardTime> shards;
  const auto folder = directory.find(kShardFolder);
  for (const auto& [name, entry] : read_manifest(directory)) {
    if (!folder) break;
    const struct stat file = folder->status(name);
    if (file.st_mode == 0) continue;
    ShardTime& shard = shards.emplace_back(ShardTime{seconds(file.st_mtim), 0});
    for (const ShardEntry::Traces& traces : entry.traces) shard.traces += traces.count;
  }
  std::timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return rate_of(seconds(lock.st_mtim), seconds(now), std::move(shards));
}

}  // namespace graze
