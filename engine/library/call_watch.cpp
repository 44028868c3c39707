#include "engine/library/call_watch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <set>
#include <utility>

namespace graze {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kLook{50};
constexpr double kLongestLook = 0.5;  // s: a longer pause was not the call's

/// What a thread is in. Nothing of it is made or destroyed, so that handlers of signals may ask.
struct ThreadCall {
  std::atomic<LibraryCall> call{LibraryCall::none};
  std::atomic<double> time{0};
  std::atomic<const char*> file{nullptr};
  std::atomic<double> limit{0};
  std::atomic<std::uint64_t> entered{0};  // calls so far
};
constinit thread_local ThreadCall mine;

struct Threads {
  std::mutex changing;
  std::set<const ThreadCall*> in_calls;
};
/// Never destroyed: threads end behind static objects.
Threads& threads() {
  static auto& all = *new Threads;
  return all;
}

/// A thread that has been in a call, as long as it lives.
struct Enrolled {
  Enrolled() {
    const std::lock_guard lock(threads().changing);
    threads().in_calls.insert(&mine);
  }
  ~Enrolled() {
    const std::lock_guard lock(threads().changing);
    threads().in_calls.erase(&mine);
  }
  Enrolled(const Enrolled&) = delete;
  Enrolled& operator=(const Enrolled&) = delete;
};

LibraryCallHere copy_of(const ThreadCall& thread) {
  return {thread.call.load(std::memory_order_acquire), thread.time.load(std::memory_order_relaxed),
          thread.file.load(std::memory_order_relaxed), thread.limit.load(std::memory_order_relaxed)};
}

}  // namespace

LibraryCallHere library_call_here() { return copy_of(mine); }

void show_call_here(const LibraryCallHere& call) {
  static thread_local const Enrolled enrolled;
  mine.time.store(call.time, std::memory_order_relaxed);
  mine.file.store(call.file, std::memory_order_relaxed);
  mine.limit.store(call.limit, std::memory_order_relaxed);
  mine.entered.store(mine.entered.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  mine.call.store(call.call, std::memory_order_release);
}

CallWatch::CallWatch(std::function<void(const LibraryCallHere&)> hung)
    : hung_(std::move(hung)), thread_([this] { watch(); }) {}

CallWatch::~CallWatch() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  end_.notify_one();
  thread_.join();
}

void CallWatch::watch() {
  struct Seen {
    std::uint64_t entered = 0;
    double since = 0;  // s
  };
  std::map<const ThreadCall*, Seen> seen;
  Clock::time_point before = Clock::now();
  std::unique_lock lock(mutex_);
  while (!end_.wait_for(lock, kLook, [this] { return ended_; })) {
    const Clock::time_point now = Clock::now();
    const double passed = std::min(std::chrono::duration<double>(now - before).count(), kLongestLook);
    before = now;
    const std::lock_guard all(threads().changing);
    for (const ThreadCall* const thread : threads().in_calls) {
      Seen& one = seen[thread];
      const LibraryCallHere call = copy_of(*thread);
      const std::uint64_t entered = thread->entered.load(std::memory_order_relaxed);
      const bool same = call.call != LibraryCall::none && entered == one.entered;
      one = {entered, same ? one.since + passed : 0};
      if (same && one.since >= call.limit) hung_(call);
    }
  }
}

}  // namespace graze
