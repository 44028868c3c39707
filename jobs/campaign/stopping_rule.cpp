#include "jobs/campaign/stopping_rule.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/archive.h"

namespace graze {
namespace {

// One counter holds three: successes, failures and invalid traces of a stretch, which is no longer than 2^20 particles.
// So one addition tells all, and no reader finds one of them without the others.
constexpr int kBits = 21;
constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;

std::uint64_t packed(Outcome outcome) {
  if (outcome == Outcome::success) return 1;
  return std::uint64_t{1} << (outcome == Outcome::invalid ? 2 * kBits : kBits);
}

RateCount rate_of(std::uint64_t packed) {
  return {packed & kMask, (packed & kMask) + (packed >> kBits & kMask), packed >> 2 * kBits};
}
std::uint64_t traces_of(std::uint64_t packed) { return rate_of(packed).valid + rate_of(packed).invalid; }

}  // namespace

void check_stopping_rule(const CampaignInfo& info) {
  const std::size_t looks = look_boundaries(info.particles).size();
  if (kFirstFreeCounter + looks * info.policies.size() <= kSharedCounters) return;
  throw InputError(fmt::format(
      "--until: {} policies and {} looks at up to {} particles are more than can be counted; ask for fewer policies or "
      "fewer particles (-n)",
      info.policies.size(), looks, info.particles));
}

StoppingRule::StoppingRule(Communicator& comm, const CampaignInfo& info)
    : comm_(comm),
      policies_(info.policies),
      confidence_(info.until.confidence),
      least_(info.until.least),
      questions_(questions_of(info)),
      looks_(look_boundaries(info.particles)),
      counts_(info.policies.size()) {
  check_stopping_rule(info);
}

void StoppingRule::note(ByStretch& counts, std::uint64_t particle, Outcome outcome) const {
  const auto look = std::upper_bound(looks_.begin(), looks_.end(), particle);
  if (look != looks_.end()) counts[static_cast<std::size_t>(look - looks_.begin())] += packed(outcome);
}

/// True if a stretch has ended by it, for this policy.
bool StoppingRule::add(int policy, const ByStretch& counts) {
  bool ended = false;
  for (const auto& [stretch, delta] : counts) {
    const std::uint64_t before = comm_.fetch_add(counter(stretch) + static_cast<std::size_t>(policy), delta);
    ended = ended || traces_of(before + delta) == width(stretch);
  }
  return ended;
}

bool StoppingRule::count(int policy, std::span<const TraceRecord> records) {
  ByStretch counts;
  for (const TraceRecord& record : records) note(counts, record.particle, record.outcome);
  // The worker that ends a stretch takes the look. Of two that end neighbouring ones at once, the later finds both
  // ended.
  return add(policy, counts) && answered_at() > 0;
}

void StoppingRule::count_finished(const Archive& archive) {
  for (std::size_t policy = 0; policy < policies_.size(); ++policy) {
    ByStretch counts;
    archive.scan(policies_[policy], 0, [&](const TraceRows& traces) {
      for (std::size_t i = 0; i < traces.size(); ++i) note(counts, traces.particle(i), traces.outcome(i));
    });
    add(static_cast<int>(policy), counts);
  }
}

std::uint64_t StoppingRule::answered_at() {
  const std::lock_guard lock(mutex_);
  while (answered_at_ == 0 && next_ < looks_.size() && look()) ++next_;
  return answered_at_;
}

std::string StoppingRule::state() {
  const std::uint64_t end = answered_at();  // takes due looks, on ranks that have not ended a stretch themselves
  const std::lock_guard lock(mutex_);
  if (end == 0 && next_ == 0) return "";
  return fmt::format("{} of {} answers after {} particles", answers_.answered, answers_.all,
                     end > 0 ? end : looks_[next_ - 1]);
}

/// The next look; false if particles before it have not all ended.
bool StoppingRule::look() {
  const std::vector<std::uint64_t> stretch = comm_.read(counter(next_), policies_.size());
  const auto ended = [&](std::uint64_t packed) { return traces_of(packed) == width(next_); };
  if (!std::all_of(stretch.begin(), stretch.end(), ended)) return false;
  for (std::size_t policy = 0; policy < policies_.size(); ++policy) {
    const RateCount more = rate_of(stretch[policy]);
    counts_[policy].success += more.success;
    counts_[policy].valid += more.valid;
    counts_[policy].invalid += more.invalid;
  }
  answers_ = count_answers(questions_, policies_, counts_, confidence_);
  if (looks_[next_] >= least_ && answers_.answered == answers_.all) answered_at_ = looks_[next_];
  return true;
}

}  // namespace graze
