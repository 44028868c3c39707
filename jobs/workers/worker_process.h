#pragma once
// A process that runs controllers, as the process that has started it sees it.

#include <sys/types.h>

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

class WorkerProcess {
 public:
  /// Starts this program anew, as a worker, and briefs it. It dies with this thread. `timeout`: s, longest time of one
  /// call of the controller. Throws WorkerDied, InputError, MachineError.
  WorkerProcess(const std::string& briefing, double timeout);
  /// Kills it, and what it has started.
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// What it answers. Throws WorkerDied, and Overtime if the simulator itself hangs there.
  WorkerMessage ask(const WorkerRequest& request);
  /// What it has printed, the last 4 kB.
  const std::string& output() const { return output_; }

 private:
  void start();
  WorkerMessage listen();
  void take_output();
  bool has_ended() const;
  [[noreturn]] void died();
  [[noreturn]] void hangs(LibraryCall call, double limit);
  void end();
  std::string where() const;

  const double timeout_;
  pid_t id_ = 0;  // 0: none that runs
  int status_ = 0;
  Descriptor socket_, printed_;
  LibraryCalls* calls_ = nullptr;  // shared with it
  std::string output_;
};

}  // namespace graze
