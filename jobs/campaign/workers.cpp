#include "jobs/campaign/workers.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "engine/settings/signal_stack.h"

namespace graze {

Workers::Workers(double watchdog) : watchdog_(std::make_unique<Watchdog>(watchdog)) {}

void Workers::start(std::shared_ptr<TraceWatch> watch, std::function<void()> work, std::function<void()> hangs) {
  const std::lock_guard lock(mutex_);
  Worker& worker = workers_.emplace_back();
  watchdog_->add(std::move(watch), [this, &worker, hangs = std::move(hangs)] { give_up(worker, hangs); });
  worker.thread = std::thread([this, &worker, work = std::move(work)] {
    {
      const std::lock_guard here(mutex_);
      worker.id = syscall(SYS_gettid);
    }
    try {
      const SignalStack stack;
      work();
    } catch (const GivenUp&) {
      return;  // whatever belongs to the campaign may be gone
    }
    ended();
  });
  ++busy_;  // before the thread can come to its end: that needs the mutex
}

void Workers::ended() {
  const std::lock_guard lock(mutex_);
  --busy_;
  all_ended_.notify_all();
}

void Workers::give_up(Worker& worker, const std::function<void()>& hangs) {
  hangs();
  const std::lock_guard lock(mutex_);
  worker.hangs = true;
  setpriority(PRIO_PROCESS, static_cast<id_t>(worker.id), 19);  // of the thread: it shall not slow down the others
  --busy_;
  all_ended_.notify_all();
}

std::vector<std::thread> Workers::wait() {
  {
    std::unique_lock lock(mutex_);
    all_ended_.wait(lock, [this] { return busy_ == 0; });
  }
  watchdog_.reset();
  std::vector<std::thread> hanging;
  for (Worker& worker : workers_) {
    if (worker.hangs) {
      hanging.push_back(std::move(worker.thread));
    } else if (worker.thread.joinable()) {  // it could be started
      worker.thread.join();
    }
  }
  return hanging;
}

}  // namespace graze
