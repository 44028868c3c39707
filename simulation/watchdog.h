#pragma once
// A trace that takes too long is a matter of the machine, not of the robot: it is cut off between two steps, and a
// thread that does not come back from a step is given up. Time is counted in ticks of the watchdog's own thread, so
// that neither a clock that jumps nor a process that was suspended for an hour makes a trace look slow.

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "engine/lanes/block.h"

namespace graze {

/// Thrown between two steps of a block one of whose traces takes too long. Not a std::exception: no policy shall catch
/// it by accident.
struct Overtime {};
/// Thrown in a thread that was given up when it does come back: somebody else has its work now.
struct GivenUp {};

/// Thrown between two steps of a block once the time is over that its thread was given.
struct PastDeadline {};

/// Where one thread shows what it simulates, and is told to stop.
class TraceWatch {
 public:
  // For the thread that simulates.

  void enter();
  /// Between enter() and leave() the thread touches nothing that others may take over. Throws GivenUp.
  void leave();
  /// A trace begins or ends in a lane.
  void begin(int lane) { since_[lane].store(now_.load(std::memory_order_relaxed), std::memory_order_relaxed); }
  void end(int lane) { since_[lane].store(kIdle, std::memory_order_relaxed); }
  /// From now on check() throws PastDeadline after this time; max(): never.
  void stop_at(std::chrono::steady_clock::time_point deadline) { deadline_ = deadline; }
  /// Throws Overtime if a trace has been cut off, PastDeadline if the time is over.
  void check() const {
    if (cut_.load(std::memory_order_relaxed)) throw Overtime{};
    if (deadline_ != kNever && std::chrono::steady_clock::now() >= deadline_) throw PastDeadline{};
  }

  /// Tells `teller`, if there is one, now and then how many steps more were done since it was told last: a block can
  /// take minutes. `steps`: of all particles of the block so far.
  void count(std::uint64_t steps) {
    constexpr std::uint64_t kPortion = 512;  // between looks at the clock
    if (!teller || steps - seen_ < kPortion) return;
    seen_ = steps;
    tell_now_and_then();
  }
  /// Another block begins.
  void begin_block() { seen_ = told_of_block_ = 0; }
  /// What the teller was told since this was called last.
  std::uint64_t take_told() { return std::exchange(told_, 0); }
  std::function<void(std::uint64_t)> teller;

  // For the watchdog.

  /// The tick that it is now, for traces that begin before the first look.
  void set_tick(std::uint32_t now) { now_.store(now, std::memory_order_relaxed); }
  enum class Finding { well, cut, stuck };
  /// At tick `now`: cuts off what began `limit` ticks ago or earlier; abandons the thread (once) if it has not heeded
  /// that for `grace` ticks.
  Finding look(std::uint32_t now, std::uint32_t limit, std::uint32_t grace);

 private:
  void tell_now_and_then();

  static constexpr std::uint32_t kIdle = 0;
  static constexpr auto kNever = std::chrono::steady_clock::time_point::max();
  std::array<std::atomic<std::uint32_t>, kLanes> since_{};  // tick at which the trace of each lane began
  std::atomic<std::uint32_t> now_{1};
  std::atomic<bool> cut_{false};
  std::mutex mutex_;  // guards the rest
  bool inside_ = false, given_up_ = false;
  std::uint32_t cut_at_ = 0;
  // The thread's own.
  std::chrono::steady_clock::time_point deadline_ = kNever;
  std::uint64_t seen_ = 0, told_of_block_ = 0, told_ = 0;
  std::chrono::steady_clock::time_point told_at_ = std::chrono::steady_clock::now();
};

/// The shortest limit that a watchdog keeps, s: ten of its shortest ticks.
inline constexpr double kShortestWatchdog = 0.01;

/// Looks at threads now and then, on a thread of its own.
class Watchdog {
 public:
  /// `seconds`: longest time for one trace, at least kShortestWatchdog (less counts as that). It looks twenty times
  /// within that, at least once a second and no more than once a millisecond, and cuts a trace off at the first look
  /// after its time is over; what does not heed the cut for as long again, but no more than a minute, is stuck.
  /// 0: never looks.
  explicit Watchdog(double seconds);
  /// Ends the looking.
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Looks at one more thread. `stuck` is called if it is given up, from the watchdog's thread, and again at the next
  /// look if it throws; it may call add().
  void add(std::shared_ptr<TraceWatch> watch, std::function<void()> stuck);

 private:
  struct Watched {
    std::shared_ptr<TraceWatch> watch;
    std::function<void()> stuck;
    bool untold = false;  // it is stuck, and `stuck` has not come to its end yet
  };
  void loop();
  static void tell(Watched& one);
  void look_at_all();

  const double tick_;  // s
  const std::uint32_t limit_, grace_;
  std::atomic<std::uint32_t> now_{1};
  std::mutex mutex_;  // guards the rest
  std::condition_variable wake_;
  bool done_ = false;
  std::list<Watched> watched_;  // grows at its end only
  std::thread thread_;
};

}  // namespace graze
