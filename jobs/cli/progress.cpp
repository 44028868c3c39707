#include "jobs/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "archive/files/utf8.h"

namespace graze {

std::string duration_text(double seconds) {
  if (!std::isfinite(seconds)) return "?";
  const auto s = static_cast<long long>(std::llround(seconds));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
}

ProgressReport::ProgressReport(Communicator& comm, std::uint64_t total_traces, bool quiet, StoppingRule* rule)
    : comm_(comm), total_(total_traces), rule_(rule), terminal_(isatty(STDERR_FILENO) != 0) {
  if (!quiet) thread_ = std::thread([this] { loop(); });
}

ProgressReport::~ProgressReport() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  wake_.notify_all();
  thread_.join();
  std::fprintf(stderr, terminal_ ? "\r\x1b[K%s\n" : "%s\n", printable(line()).c_str());
}

double ProgressReport::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

std::string ProgressReport::line() const {
  const double elapsed = seconds();
  const CampaignProgress progress = progress_of(comm_);
  const std::uint64_t done = progress.traces;
  if (total_ == 0) return "all traces are there already";
  const double rate = static_cast<double>(done) / elapsed;
  std::string text =
      fmt::format("{}{}{} traces, {:.3g} traces/s, {:.3g} particle-steps/s, ", done, rule_ ? " of at most " : "/",
                  total_, rate, static_cast<double>(progress.steps) / elapsed);
  if (rule_) {
    const std::string state = rule_->state();
    text += state.empty() ? "no look yet" : state;
  } else {
    text += done == total_ ? fmt::format("done in {}", duration_text(elapsed))
                           : fmt::format("{} left", duration_text(static_cast<double>(total_ - done) / rate));
  }
  text += fmt::format("; S {} K {} U {}", progress.success, progress.known, progress.unknown);
  if (progress.invalid > 0) text += fmt::format(" invalid {}", progress.invalid);
  return text;
}

void ProgressReport::loop() {
  const auto period = terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(10000);
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, period, [this] { return done_; })) {
    std::fprintf(stderr, terminal_ ? "\r\x1b[K%s" : "%s\n", printable(line()).c_str());
    std::fflush(stderr);
  }
}

}  // namespace graze
