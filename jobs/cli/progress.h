#pragma once
// Progress of a campaign on stderr: one line that rewrites itself on a terminal, plain lines now and then in a log.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "jobs/campaign/campaign.h"

namespace graze {

/// "12 s", "3 min 20 s", "2 h 05 min".
std::string duration_text(double seconds);

/// Reports from a thread of its own until it is destroyed.
class ProgressReport {
 public:
  ProgressReport(Communicator& comm, std::uint64_t total_traces, bool quiet, StoppingRule* rule = nullptr);
  ~ProgressReport();

  /// One line: done, rate, time left, outcomes so far.
  std::string line() const;
  double seconds() const;

 private:
  void loop();
  Communicator& comm_;
  const std::uint64_t total_;
  StoppingRule* const rule_;  // of a campaign that ends by its answers: `total_` is the most then
  const bool terminal_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace graze
