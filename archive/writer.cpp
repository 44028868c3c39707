// CampaignWriter: gathers traces and writes shards.
#include <algorithm>
#include <cassert>
#include <chrono>
#include <mutex>
#include <optional>
#include <utility>

#include "archive/archive.h"
#include "archive/directory/campaign_directory.h"
#include "archive/directory/shard.h"
#include "archive/directory/shard_queue.h"

namespace graze {
namespace {

using Clock = std::chrono::steady_clock;

// A shard is written when either is reached: what a crash can cost, and what memory may hold.
constexpr auto kShardAge = std::chrono::seconds(2);
constexpr auto kShardAgePerRank = std::chrono::milliseconds(2);  // docs/scaling.md
constexpr std::size_t kShardBytes = std::size_t{32} << 20;

}  // namespace

struct CampaignWriter::Impl {
  Impl(const std::filesystem::path& path, const CampaignInfo& facts, bool force)
      : directory(path, facts, force), buffer(facts.policies.size()) {}
  Impl(const std::filesystem::path& path, const CampaignInfo& facts, ExistingCampaign existing)
      : directory(path, facts, std::move(existing)), buffer(facts.policies.size()) {}
  Impl(const std::filesystem::path& path, const CampaignInfo& facts, CampaignMember member)
      : directory(path, facts, member),
        buffer(facts.policies.size()),
        age(std::max<Clock::duration>(kShardAge, member.ranks * kShardAgePerRank)) {}

  const CampaignInfo& info() const { return directory.info(); }

  /// Takes the buffer, if there is something in it and it is `due`.
  std::optional<ShardBuffer> take(bool always) {
    const bool due = always || buffer.bytes() >= kShardBytes || Clock::now() - last >= age;
    if (!due || buffer.empty()) return std::nullopt;
    last = Clock::now();
    return std::exchange(buffer, ShardBuffer(info().policies.size()));
  }

  CampaignDirectory directory;  // the queue's thread writes into it, and nobody else while that is busy
  std::mutex adding;
  ShardBuffer buffer;  // `adding` guards it
  Clock::duration age = kShardAge;
  Clock::time_point last = Clock::now();
  ShardQueue queue{[this](ShardBuffer shard) { directory.add_shard(std::move(shard)); }};
};

CampaignWriter::CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, bool force)
    : impl_(std::make_unique<Impl>(directory, info, force)) {}

CampaignWriter::CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, ExistingCampaign existing)
    : impl_(std::make_unique<Impl>(directory, info, std::move(existing))) {}

CampaignWriter::CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, CampaignMember member)
    : impl_(std::make_unique<Impl>(directory, info, member)) {}

CampaignWriter::~CampaignWriter() {
  try {
    if (auto rest = impl_->take(true)) impl_->queue.push(std::move(*rest));
    impl_->queue.drain();
  } catch (const std::exception&) {
    // An unfinished writer is destroyed while an error is handled already; the campaign stays incomplete.
  }
}

void CampaignWriter::append(int policy, std::vector<TraceRecord> traces, std::vector<double> values) {
  assert(policy >= 0 && static_cast<std::size_t>(policy) < impl_->info().policies.size());
  if (!impl_->info().store_values) values.clear();
  std::optional<ShardBuffer> due;
  {
    const std::lock_guard guard(impl_->adding);
    impl_->buffer.add(policy, std::move(traces), values, impl_->info().parameters.size());
    due = impl_->take(false);
  }
  if (due) impl_->queue.push(std::move(*due));  // outside of the lock: other threads go on adding
}

void CampaignWriter::flush() {
  std::optional<ShardBuffer> rest;
  {
    const std::lock_guard guard(impl_->adding);
    rest = impl_->take(true);
  }
  if (rest) impl_->queue.push(std::move(*rest));
  impl_->queue.drain();
  if (!impl_->queue.failed()) impl_->directory.keep_described();
}

void CampaignWriter::finish(bool complete, std::uint64_t answered_at) {
  flush();
  if (complete && !impl_->queue.failed()) impl_->directory.complete(answered_at);
}

void CampaignWriter::keep() { impl_->directory.keep_begun(); }

int CampaignWriter::shards() const {
  impl_->queue.drain();
  return impl_->directory.shards();
}

const std::filesystem::path& CampaignWriter::directory() const { return impl_->directory.path(); }

void CampaignWriter::add_unfinished(const UnfinishedTrace& trace) { impl_->directory.add_unfinished(trace); }

void CampaignWriter::check_in_place() const { impl_->directory.check_in_place(); }

}  // namespace graze
