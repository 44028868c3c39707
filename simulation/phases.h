#pragma once
// Where a campaign's time goes.

#include <array>
#include <chrono>
#include <string_view>

namespace graze {

/// The parts of one step of a block, in order.
enum class Phase { bookkeeping, sensing, control, actuation, physics, digest, events, witnesses, records };
inline constexpr int kPhases = static_cast<int>(Phase::records) + 1;
inline constexpr std::array<std::string_view, kPhases> kPhaseNames = {
    "bookkeeping", "sensing", "control", "actuation", "physics", "digest", "events", "witnesses", "records"};

/// Seconds spent in each phase.
using PhaseSeconds = std::array<double, kPhases>;

/// Sums the time between calls of ended() by phase; does nothing unless told to (reading a clock costs about 25 ns).
class PhaseClock {
 public:
  /// `seconds`: where to add the times, or null.
  void begin(PhaseSeconds* seconds) {
    seconds_ = seconds;
    if (seconds_) last_ = Clock::now();
  }
  /// The phase that has just come to its end.
  void ended(Phase phase) {
    if (!seconds_) return;
    const Clock::time_point now = Clock::now();
    (*seconds_)[static_cast<int>(phase)] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  PhaseSeconds* seconds_ = nullptr;
  Clock::time_point last_;
};

}  // namespace graze
