#pragma once
// A process that runs controllers, as the process that has started it sees it.

#include <sys/types.h>

#include <optional>
#include <stdexcept>
#include <string>

#include "engine/library/library_use.h"
#include "engine/settings/regular_file.h"
#include "jobs/workers/worker_channel.h"

namespace graze {

/// The process has ended, or had to be ended, by the fault of what it was doing. what(): "crashed (SIGSEGV) in act() at
/// 0.012 s".
class WorkerDied : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// The same, but the clock or somebody else has decided it, or no particle had begun: none is to blame.
class WorkerLost : public WorkerDied {
 public:
  using WorkerDied::WorkerDied;
};

/// From now on a process that does not run at all is waited for some seconds only: the campaign has been asked to stop.
/// May be called by a signal's handler.
void wait_for_stopped_workers_no_more();

/// How long the process is waited for, s.
struct WorkerPatience {
  double call;    // longest time of one call of the controller, but for loading and create()
  double frozen;  // longest time that it may not run at all (stopped by a signal); 0: any
};

class WorkerClock;

class WorkerProcess {
 public:
  /// Starts this program anew, as a worker, and briefs it. It dies with this thread. Throws InputError, MachineError.
  WorkerProcess(const std::string& briefing, const WorkerPatience& patience);
  /// Kills it, if it still runs, and what it has started.
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// What it answers. Throws WorkerDied, and Overtime if the simulator itself hangs there.
  WorkerMessage ask(const WorkerRequest& request);
  /// Lets it end in order: the controller's destroy() and exit handlers run. Returns what went wrong in that, or
  /// nothing. For one that has died: does nothing.
  std::string finish();
  /// What it has printed, the last 4 kB.
  const std::string& output() const { return output_; }

 private:
  void start();
  void say(char kind, const std::string& bytes);
  WorkerMessage listen();
  void look_at_clock(const WorkerClock& clock);
  void take_output();
  bool has_ended() const;
  bool ends_within(double seconds);
  [[noreturn]] void died();
  [[noreturn]] void overwritten();
  [[noreturn]] void lost(const std::string& why);
  void end();
  std::string where() const;

  const WorkerPatience patience_;
  pid_t id_ = 0;               // 0: none that runs
  std::optional<int> status_;  // how it has ended, if anybody knows
  bool ready_ = false;         // has been briefed; before, no library was loaded
  Descriptor socket_, printed_;
  WorkerInbox inbox_;
  std::uint64_t mark_;             // of the last message to it
  LibraryCalls* calls_ = nullptr;  // shared with it
  std::string output_;
};

}  // namespace graze
