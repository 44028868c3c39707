#include "jobs/campaign/signals.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>

#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/campaign/say.h"
#include "jobs/workers/worker_process.h"

namespace graze {
namespace {

std::atomic<bool> stop{false};
std::atomic<int> first_signal{0};
std::atomic<long long> first_time{0};  // ns, of the first SIGINT or SIGTERM
std::string leaving;                   // set before the handlers are

static_assert(SIGXCPU < 65 && std::atomic<int>::is_always_lock_free && std::atomic<long long>::is_always_lock_free);

std::string name_of(int number) {
  switch (number) {
    case SIGINT:
      return "SIGINT";
    case SIGTERM:
      return "SIGTERM";
    case SIGHUP:
      return "SIGHUP";
    case SIGUSR1:
      return "SIGUSR1";
    case SIGXCPU:
      return "SIGXCPU";
    default:
      return fmt::format("signal {}", number);
  }
}

/// What is said of the first signal; by its number, made before the handlers are set.
std::array<std::string, 65> received;

/// A launcher passes a signal on that its processes got from the terminal already: not a second one.
constexpr long long kSameSignal = 300'000'000;  // ns

void on_signal(int number) {
  const int error = errno;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const long long time = now.tv_sec * 1'000'000'000LL + now.tv_nsec;
  int before = 0;
  if (first_signal.compare_exchange_strong(before, number)) say_safely(received[number].c_str());
  // A scheduler that has announced the end (SIGUSR1, SIGXCPU) or a terminal that is gone may send SIGTERM next.
  if (number == SIGINT || number == SIGTERM) {
    long long none = 0;
    if (!first_time.compare_exchange_strong(none, time) && time - none > kSameSignal) {
      say_safely(leaving.c_str());
      _exit(kMachineFailed);
    }
  }
  wait_for_stopped_workers_no_more();
  stop = true;
  errno = error;
}

void set_handler(int number, void (*handler)(int)) {
  struct sigaction action {
  }, before{};
  if (sigaction(number, nullptr, &before) != 0 || before.sa_handler == SIG_IGN) return;
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigfillset(&action.sa_mask);
  sigaction(number, &action, nullptr);
}

}  // namespace

const std::atomic<bool>& heed_signals(const std::string& directory, bool trust) {
  leaving =
      fmt::format("\ngraze: {}: stopped at once; every shard on disk is kept, and 'graze resume {}{}' does the rest\n",
                  printable(directory), shell_path(directory), trust ? " --trust" : "");
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGXCPU}) {
    const bool again = number == SIGINT || number == SIGTERM;
    received[number] =
        fmt::format("\ngraze: {}: the blocks under way are finished first; {} leaves at once\n", name_of(number),
                    number == SIGINT ? "Ctrl-C once more"
                    : again          ? "SIGTERM once more"
                                     : "Ctrl-C or SIGTERM");
  }
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGXCPU}) set_handler(number, on_signal);
  for (const int number : {SIGPIPE, SIGXFSZ}) set_handler(number, SIG_IGN);
  return stop;
}

std::string stop_signal() { return first_signal == 0 ? "" : name_of(first_signal); }

}  // namespace graze
