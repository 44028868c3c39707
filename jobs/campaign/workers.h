#pragma once
// The threads of a process that simulate. One that hangs within a step of a trace cannot be ended; it is given up, and
// its work is handed on.

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "simulation/watchdog.h"

namespace graze {

class Workers {
 public:
  /// `watchdog`: longest time for one trace, s; 0: threads are never given up.
  explicit Workers(double watchdog);

  /// A thread that does `work` and shows its traces to `watch`. If it hangs in one, `hangs` is called from another
  /// thread, once; it may start a thread that goes on in its place. `work` may throw GivenUp, and nothing else.
  void start(std::shared_ptr<TraceWatch> watch, std::function<void()> work, std::function<void()> hangs);
  /// Waits for all threads but those that hang, and returns these. A process that has any cannot end in the usual way:
  /// they go on using what they were simulating with.
  std::vector<std::thread> wait();

 private:
  struct Worker {
    std::thread thread;
    long id = 0;  // the system's
    bool hangs = false;
  };
  void give_up(Worker& worker, const std::function<void()>& hangs);
  void ended();

  std::mutex mutex_;
  std::condition_variable all_ended_;
  int busy_ = 0;               // threads that neither ended nor hang
  std::list<Worker> workers_;  // `mutex_` guards them, but for the work itself
  std::unique_ptr<Watchdog> watchdog_;
};

}  // namespace graze
