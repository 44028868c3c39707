#include "jobs/reading_verb.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <csignal>
#include <new>

#include "archive/archive.h"
#include "archive/reading_child.h"

namespace graze {
namespace {

bool is_crash(int signal) {
  for (const int one : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP}) {
    if (signal == one) return true;
  }
  return false;
}

/// What a child that a signal ended means here.
int after_death(const ReaderEnd& end, const ReadingLimits& limits) {
  const int signal = WTERMSIG(end.status);
  if (signal == SIGXCPU || (is_crash(signal) && end.inside)) throw InputError(death_text(end, limits));
  if (signal == SIGKILL) {
    throw MachineError(fmt::format(
        "{}: the process that read it was killed (SIGKILL), by the system if there is no memory left", end.file));
  }
  if (is_crash(signal)) {
    throw MachineError(fmt::format("internal error: signal {} after '{}' had been read", signal, end.file));
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
  return 128 + signal;
}

}  // namespace

int in_reading_child(const std::vector<std::string>& archives, const std::function<int()>& act,
                     double seconds_per_megabyte) {
  if (may_not_fork()) return act();
  const ReadingLimits limits = reading_limits({archives.begin(), archives.end()}, seconds_per_megabyte);
  if (const std::optional<ReaderEnd> end = go_on_in_child(limits)) {
    return WIFEXITED(end->status) ? WEXITSTATUS(end->status) : after_death(*end, limits);
  }
  try {
    return act();
  } catch (const std::bad_alloc&) {
    throw InputError(too_large_text());
  }
}

}  // namespace graze
