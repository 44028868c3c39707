#pragma once
// Campaigns that stop once their questions are answered (--until). Outcomes are counted in the communicator's shared
// counters, by policy and by the stretch of particles between two looks (interim analyses); one takes place when all
// particles before it have ended, so that the answer and the number of particles depend on no thread, rank or order of
// work.

#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "analysis/sequential.h"
#include "archive/archive.h"
#include "jobs/campaign/communicator.h"

namespace graze {

/// The most particles of a campaign with --until if -n does not say.
inline constexpr std::uint64_t kMostParticles = 1'000'000;

/// Throws InputError if a communicator has too few counters for so many policies and looks at up to info.particles.
void check_stopping_rule(const CampaignInfo& info);

/// Methods may be called from any thread.
class StoppingRule {
 public:
  /// info.until: the questions; info.particles: the most particles. Throws as check_stopping_rule().
  StoppingRule(Communicator& comm, const CampaignInfo& info);

  /// Counts finished traces of a policy, each once in the whole communicator. True if the campaign is answered now.
  bool count(int policy, std::span<const TraceRecord> records);
  /// Counts what an archive holds already; one rank does it, and all wait for it.
  void count_finished(const Archive& archive);
  /// The number of particles that answered the questions; 0: not yet. Each rank finds the same.
  std::uint64_t answered_at();
  /// For a progress line: "2 of 3 answers after 512 particles"; empty before the first look.
  std::string state();

 private:
  using ByStretch = std::map<std::size_t, std::uint64_t>;  // packed counts
  void note(ByStretch& counts, std::uint64_t particle, Outcome outcome) const;
  bool add(int policy, const ByStretch& counts);
  bool look();
  std::uint64_t width(std::size_t stretch) const { return looks_[stretch] - (stretch > 0 ? looks_[stretch - 1] : 0); }
  std::size_t counter(std::size_t stretch) const { return kFirstFreeCounter + stretch * policies_.size(); }

  Communicator& comm_;
  const std::vector<std::string> policies_;
  const double confidence_;
  const std::uint64_t least_;
  const std::vector<Question> questions_;
  const std::vector<std::uint64_t> looks_;  // stretch i ends before particle looks_[i]
  std::mutex mutex_;                        // of what follows
  std::size_t next_ = 0;                    // the next look
  std::vector<RateCount> counts_;           // by policy, of all stretches before next_
  AnswerCount answers_;                     // at the last look
  std::uint64_t answered_at_ = 0;
};

}  // namespace graze
