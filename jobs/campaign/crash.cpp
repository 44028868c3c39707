#include "jobs/campaign/crash.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "engine/library/library_use.h"
#include "engine/settings/signal_stack.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/campaign/say.h"

namespace graze {
namespace {

constexpr std::array<std::pair<int, const char*>, 5> kCrashes = {
    {{SIGSEGV, "SIGSEGV"}, {SIGBUS, "SIGBUS"}, {SIGFPE, "SIGFPE"}, {SIGILL, "SIGILL"}, {SIGABRT, "SIGABRT"}}};

std::array<char, 8192> advice{};   // a handler may not take memory
std::atomic<pid_t> process{0};     // that the message is for
std::atomic_flag crash_told;       // other threads may fall, too
std::atomic<bool> at_work{false};  // a MainAtWork lives

bool in_child() { return getpid() != process; }  // its parent reports

/// A name of a file on one line, whatever it is made of.
void say_name(const char* name) {
  std::array<char, 2> one{};
  for (; *name != '\0'; ++name) {
    const auto code = static_cast<unsigned char>(*name);
    one[0] = code < 0x20 || code == 0x7f ? '?' : *name;
    say_safely(one.data());
  }
}

[[noreturn]] void leave(const char* what) {
  while (crash_told.test_and_set()) pause();
  say_safely("graze: internal error: ");
  say_safely(what);
  say_safely(", in the program or a library that it uses, perhaps for want of memory");
  if (const char* const loaded = libraries_loaded()) {
    say_safely(", or in a thread of a controller that isolation: none has put into the program (");
    say_name(loaded);
    say_safely(")");
  }
  say_safely(advice.data());
  say_safely("\n");
  _exit(kMachineFailed);
}

/// A controller in the program itself has crashed. This runs in a handler: no memory is taken.
[[noreturn]] void leave_by_crash(const LibraryCallHere& here, const char* what) {
  while (crash_told.test_and_set()) pause();
  say_safely("graze: the controller ");
  say_name(here.file);
  say_safely(" crashed (");
  say_safely(what);
  say_safely(") in ");
  say_safely(name_of(here.call));
  if (!std::isnan(here.time)) {
    std::array<char, 32> time{};
    const auto end =
        std::to_chars(time.data(), time.data() + time.size() - 1, here.time, std::chars_format::general, 6);
    say_safely(" at ");
    if (end.ec == std::errc()) say_safely(time.data());
    say_safely(" s");
  }
  say_safely(
      ", in the program itself, where isolation: none has put it: that costs the whole campaign, and with isolation: "
      "process one particle");
  say_safely(advice.data());
  say_safely("\n");
  _exit(kMachineFailed);
}

void on_crash(int number, siginfo_t* info, void*) {
  if (in_child()) {
    std::signal(number, SIG_DFL);
    return;
  }
  const bool from_outside = info->si_code == SI_USER && info->si_pid != getpid();
  const LibraryCallHere here = library_call_here();
  for (const auto& [crash, name] : kCrashes) {
    if (crash != number) continue;
    if (here.call != LibraryCall::none && !from_outside) leave_by_crash(here, name);
    leave(name);
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

/// HDF5 1.10 leaves the program by exit(-1) if it finds no memory for an identifier (H5I_register). A thread that a
/// controller in the program itself has started may call exit(), whose code would look like a verdict.
[[maybe_unused]] void on_exit_of_library(int status, void*) {
  const LibraryCallHere here = library_call_here();
  if (here.call != LibraryCall::none && !in_child()) leave_by(here, status);
  if (status != -1 && at_work && !in_child()) leave(fmt::format("exit({}) before the work was done", status).c_str());
  if (status != -1) return;
  if (!in_child()) leave("exit(-1)");
  std::signal(SIGABRT, SIG_DFL);
  std::raise(SIGABRT);
}

}  // namespace

MainAtWork::MainAtWork() { at_work = true; }
MainAtWork::~MainAtWork() { at_work = false; }

void contain_crashes(const std::string& directory, bool trust) {
  process = getpid();
  if (!directory.empty()) {
    const std::string text = fmt::format("; {}: every shard on disk is kept, and 'graze resume {}{}' does the rest",
                                         printable(directory), shell_path(directory), trust ? " --trust" : "");
    std::snprintf(advice.data(), advice.size(), "%s", text.c_str());
  }
  SignalStack::give_to_main_thread();
  for (const auto& [number, name] : kCrashes) {
    struct sigaction action {
    }, before{};
    if (sigaction(number, nullptr, &before) != 0 || before.sa_handler != SIG_DFL) continue;
    action.sa_sigaction = on_crash;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigfillset(&action.sa_mask);
    sigaction(number, &action, nullptr);
  }
#ifdef __GLIBC__
  on_exit(on_exit_of_library, nullptr);  // each time: what was set last comes first, before a library's own end
#endif
}

}  // namespace graze
