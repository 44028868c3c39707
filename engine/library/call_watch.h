#pragma once
// Calls into the libraries that this process has loaded, watched on the clock: where they run in the program itself,
// one that does not come back keeps its thread for ever.

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "engine/library/library_use.h"

namespace graze {

/// While it lives a thread of its own looks at the calls that all other threads are in, several times a second.
class CallWatch {
 public:
  /// `hung`: called with a call that has not returned within its limit; it does not return itself. Time in which this
  /// process was stopped does not count.
  explicit CallWatch(std::function<void(const LibraryCallHere&)> hung);
  ~CallWatch();
  CallWatch(const CallWatch&) = delete;
  CallWatch& operator=(const CallWatch&) = delete;

 private:
  void watch();

  std::function<void(const LibraryCallHere&)> hung_;
  std::mutex mutex_;
  std::condition_variable end_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace graze
