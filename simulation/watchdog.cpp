#include "simulation/watchdog.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>

namespace graze {
namespace {

/// Seconds between two looks: fine enough for the limit, and rare enough to cost nothing.
double tick_for(double seconds) { return std::clamp(seconds / 20, kShortestWatchdog / 10, 1.0); }

std::uint32_t ticks(double seconds, double tick) {
  constexpr double kMost = 1e9;  // some thirty years of whole seconds
  return static_cast<std::uint32_t>(std::min(std::ceil(seconds / tick), kMost));
}

}  // namespace

void TraceWatch::tell_now_and_then() {
  constexpr auto kBetween = std::chrono::milliseconds(500);  // rarely: other ranks are told over a network
  const auto now = std::chrono::steady_clock::now();
  if (now - told_at_ < kBetween) return;
  told_at_ = now;
  const std::uint64_t more = seen_ - std::exchange(told_of_block_, seen_);
  told_ += more;
  teller(more);
}

void TraceWatch::enter() {
  const std::lock_guard lock(mutex_);
  for (std::atomic<std::uint32_t>& since : since_) since.store(kIdle, std::memory_order_relaxed);
  cut_ = false;
  inside_ = true;
}

void TraceWatch::leave() {
  const std::lock_guard lock(mutex_);
  if (given_up_) throw GivenUp{};
  inside_ = false;
}

TraceWatch::Finding TraceWatch::look(std::uint32_t now, std::uint32_t limit, std::uint32_t grace) {
  const std::lock_guard lock(mutex_);
  now_.store(now, std::memory_order_relaxed);
  if (!inside_ || given_up_) return Finding::well;
  if (cut_) {
    if (now - cut_at_ < grace) return Finding::cut;
    given_up_ = true;
    return Finding::stuck;
  }
  for (const std::atomic<std::uint32_t>& lane : since_) {
    const std::uint32_t since = lane.load(std::memory_order_relaxed);
    if (since == kIdle || now - since <= limit) continue;  // <=: the tick in which it began was not a whole one
    cut_ = true;
    cut_at_ = now;
    return Finding::cut;
  }
  return Finding::well;
}

Watchdog::Watchdog(double seconds)
    : tick_(tick_for(seconds)), limit_(ticks(seconds, tick_)), grace_(ticks(std::min(seconds, 60.0), tick_)) {
  if (seconds > 0) thread_ = std::thread([this] { loop(); });
}

Watchdog::~Watchdog() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Watchdog::add(std::shared_ptr<TraceWatch> watch, std::function<void()> stuck) {
  const std::lock_guard lock(mutex_);
  watch->set_tick(now_);
  watched_.push_back({std::move(watch), std::move(stuck)});
}

void Watchdog::loop() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, std::chrono::duration<double>(tick_), [this] { return done_; })) {
    lock.unlock();
    look_at_all();
    lock.lock();
  }
}

void Watchdog::tell(Watched& one) {
  try {
    one.stuck();
    one.untold = false;
  } catch (const std::exception&) {
    // No memory or no thread now: at the next look.
  }
}

void Watchdog::look_at_all() {
  ++now_;
  std::unique_lock lock(mutex_);
  for (auto one = watched_.begin(); one != watched_.end(); ++one) {  // what is added meanwhile moves nobody
    lock.unlock();
    if (one->watch->look(now_, limit_, grace_) == TraceWatch::Finding::stuck) one->untold = true;
    if (one->untold) tell(*one);
    lock.lock();
  }
}

}  // namespace graze
