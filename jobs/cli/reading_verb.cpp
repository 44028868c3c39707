#include "jobs/cli/reading_verb.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <new>
#include <string>
#include <thread>

#include "archive/archive.h"
#include "archive/hdf5/reading_child.h"
#include "engine/settings/child_end.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/workers/controllers.h"

namespace graze {
namespace {

/// Whether the signal that has ended the child may be meant for the program: who sends one to both, as terminals and
/// schedulers do, ends this process in the next moment. Ctrl-C, which may be caught here, is never a controller's.
bool ends_us_too(int signal) {
  if (signal == SIGINT) return true;
  constexpr std::chrono::milliseconds kMoment(200);
  std::this_thread::sleep_for(kMoment);
  return false;
}

/// What a controller does that is in the program (pages and pictures simulate traces anew) ends the whole child, when
/// nothing is read any more. Signals that are meant for the program are nobody's fault. Empty: no controller did.
std::string blamed_controllers(const ReaderEnd& end) {
  if (!end.over || end.done || !controllers_trusted()) return "";
  std::string how;
  if (WIFEXITED(end.status)) {
    how = fmt::format("ended with exit code {}", WEXITSTATUS(end.status));
  } else {
    const int signal = WTERMSIG(end.status);
    for (const int meant : {SIGINT, SIGHUP, SIGTERM}) {
      if (signal == meant && ends_us_too(signal)) return "";
    }
    how = "was ended by " + signal_name(signal);
  }
  return fmt::format(
      "{}: the process that simulates traces anew for this {}, and not by itself: by a controller of the campaign's, "
      "which --trust lets run in it",
      end.file, how);
}

/// Whether its end was reached, by an exception or not.
struct EndOfChild {
  EndOfChild() = default;
  ~EndOfChild() { end_of_child(); }
  EndOfChild(const EndOfChild&) = delete;
  EndOfChild& operator=(const EndOfChild&) = delete;
};

/// `blamed`: what comes of it if a controller has ended the child.
int in_child(const std::vector<std::string>& archives, const std::function<int()>& act, double seconds_per_megabyte,
             const std::function<int(const std::string&)>& blamed) {
  if (may_not_fork()) return act();
  const ReadingLimits limits = reading_limits({archives.begin(), archives.end()}, seconds_per_megabyte);
  if (const std::optional<ReaderEnd> end = go_on_in_child(limits)) {
    if (const std::string why = blamed_controllers(*end); !why.empty()) return blamed(why);
    if (!WIFEXITED(end->status) && died_of_reading(*end)) throw InputError(death_text(*end, limits));
    return WEXITSTATUS(end->status);
  }
  const EndOfChild ends;
  try {
    return act();
  } catch (const std::bad_alloc&) {
    throw InputError(too_large_text());
  }
}

}  // namespace

int in_reading_child(const std::vector<std::string>& archives, const std::function<int()>& act,
                     double seconds_per_megabyte) {
  return in_child(archives, act, seconds_per_megabyte, [](const std::string& why) -> int {
    throw MachineError(why + "; without it no such trace is simulated");
  });
}

int in_page_child(const std::vector<std::string>& archives, const std::function<int()>& act,
                  double seconds_per_megabyte) {
  return in_child(archives, act, seconds_per_megabyte, [&](const std::string& why) {
    spdlog::error("{}; the page is made without such traces, as it is without --trust", why);
    distrust_controllers();
    const int code = in_reading_child(archives, act, seconds_per_megabyte);
    return code == kDone ? static_cast<int>(kMachineFailed) : code;
  });
}

}  // namespace graze
