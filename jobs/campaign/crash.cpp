#include "jobs/campaign/crash.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "engine/library/library_use.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/campaign/say.h"

namespace graze {
namespace {

constexpr std::array<std::pair<int, const char*>, 5> kCrashes = {
    {{SIGSEGV, "SIGSEGV"}, {SIGBUS, "SIGBUS"}, {SIGFPE, "SIGFPE"}, {SIGILL, "SIGILL"}, {SIGABRT, "SIGABRT"}}};

std::array<char, 8192> advice{};  // a handler may not take memory
std::atomic<pid_t> process{0};    // that the message is for
std::atomic_flag crash_told;      // other threads may fall, too

bool in_child() { return getpid() != process; }  // its parent reports

[[noreturn]] void leave(const char* what) {
  while (crash_told.test_and_set()) pause();
  say_safely("graze: internal error: ");
  say_safely(what);
  say_safely(", in the program or a library that it uses, perhaps for want of memory");
  say_safely(advice.data());
  say_safely("\n");
  _exit(kMachineFailed);
}

void on_crash(int number) {
  if (in_child()) {
    std::signal(number, SIG_DFL);
    return;
  }
  for (const auto& [crash, name] : kCrashes) {
    if (crash == number) leave(name);
  }
}

/// A controller in the program itself has called exit(): a success that is none, were nobody to say so.
[[noreturn]] void leave_by(const LibraryCallHere& here, int status) {
  while (crash_told.test_and_set()) pause();
  const std::string when = std::isnan(here.time) ? "" : fmt::format(" at {:.6g} s", here.time);
  const std::string text = fmt::format(
      "graze: the controller {} called exit({}) in {}{}, which ends the whole program; with isolation: process it ends "
      "its own",
      printable(here.file), status, name_of(here.call), when);
  say_safely(text.c_str());
  say_safely(advice.data());
  say_safely("\n");
  _exit(kMachineFailed);
}

/// HDF5 1.10 leaves the program by exit(-1) if it finds no memory for an identifier (H5I_register).
[[maybe_unused]] void on_exit_of_library(int status, void*) {
  const LibraryCallHere here = library_call_here();
  if (here.call != LibraryCall::none && !in_child()) leave_by(here, status);
  if (status != -1) return;
  if (!in_child()) leave("exit(-1)");
  std::signal(SIGABRT, SIG_DFL);
  std::raise(SIGABRT);
}

}  // namespace

void contain_crashes(const std::string& directory) {
  process = getpid();
  if (!directory.empty()) {
    const std::string text = fmt::format("; {}: every shard on disk is kept, and 'graze resume {}' does the rest",
                                         printable(directory), shell_path(directory));
    std::snprintf(advice.data(), advice.size(), "%s", text.c_str());
  }
  for (const auto& [number, name] : kCrashes) {
    struct sigaction action {
    }, before{};
    if (sigaction(number, nullptr, &before) != 0 || before.sa_handler != SIG_DFL) continue;
    action.sa_handler = on_crash;
    sigfillset(&action.sa_mask);
    sigaction(number, &action, nullptr);
  }
#ifdef __GLIBC__
  on_exit(on_exit_of_library, nullptr);  // each time: what was set last comes first, before a library's own end
#endif
}

}  // namespace graze
