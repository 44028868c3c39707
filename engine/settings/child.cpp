#include "engine/settings/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <optional>

#include "engine/settings/child_end.h"
#include "engine/settings/forked.h"
#include "engine/settings/limits.h"
#include "engine/settings/pipe.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

using Clock = std::chrono::steady_clock;

/// The first byte that a child writes: what follows.
constexpr char kOutput = 'o', kRefusal = 'r', kNoMemory = 'm', kOtherError = 'e';
constexpr int kClockFactor = 5;  // a busy machine

// The shadow memory of sanitizers is larger than any limit.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitMemory = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
constexpr bool kLimitMemory = false;
#else
constexpr bool kLimitMemory = true;
#endif
#else
constexpr bool kLimitMemory = true;
#endif

rlim_t address_space() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

/// Lowers a soft limit; the user's own stays if it is lower.
void lower_limit(decltype(RLIMIT_AS) which, rlim_t value) {
  rlimit limit{};
  getrlimit(which, &limit);
  limit.rlim_cur = std::min({limit.rlim_cur, limit.rlim_max, value});
  setrlimit(which, &limit);
}

void confine(pid_t parent, const ChildLimits& limits) {
  die_with(parent);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTERM, SIGINT, SIGHUP}) {
    std::signal(signal, SIG_DFL);  // the program's own handlers would tell the user of a crash
  }
  const int nothing = open("/dev/null", O_RDWR);
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, standard);
  lower_limit(RLIMIT_CORE, 0);
  lower_limit(RLIMIT_CPU, limits.seconds);
  if (kLimitMemory) lower_limit(RLIMIT_AS, address_space() + limits.memory);
}

void write_whole(int descriptor, const char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t written = write(descriptor, bytes, count);
    if (written < 0 && errno != EINTR) _exit(1);  // nobody listens
    if (written > 0) bytes += written, count -= static_cast<std::size_t>(written);
  }
}

[[noreturn]] void work_in_child(const std::function<std::string()>& work, int answer) {
  char kind = kOutput;
  std::string text;
  try {
    text = work();
  } catch (const InputError& error) {
    kind = kRefusal, text = error.what();
  } catch (const std::bad_alloc&) {
    kind = kNoMemory;
  } catch (const std::exception& error) {
    kind = kOtherError, text = error.what();
  } catch (...) {
    kind = kOtherError;
  }
  write_whole(answer, &kind, 1);
  write_whole(answer, text.data(), text.size());
  _exit(0);
}

std::string time_problem(const ChildLimits& limits) {
  return fmt::format("took more than {} s of processor time", limits.seconds);
}

/// Reads until the other end closes. Returns what is wrong.
std::string listen_to(int descriptor, const ChildLimits& limits, std::string& into) {
  const auto deadline = Clock::now() + std::chrono::seconds(kClockFactor * limits.seconds);
  std::array<char, 1 << 16> bytes;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd end = {descriptor, POLLIN, 0};
    const int ready = poll(&end, 1, static_cast<int>(std::max<long long>(0, left)));
    if (ready == 0) return time_problem(limits);
    if (ready < 0) continue;
    const ssize_t got = read(descriptor, bytes.data(), bytes.size());
    if (got == 0) return "";
    if (got < 0 && errno != EINTR && errno != EAGAIN) return std::strerror(errno);
    if (got > 0) into.append(bytes.data(), static_cast<std::size_t>(got));
    if (into.size() > limits.output) return fmt::format("makes more than {}", bytes_in_words(limits.output));
  }
}

std::string end_text(int status, const ChildLimits& limits) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU) return time_problem(limits);
    return "crashed (" + signal_name(signal) + ")";
  }
  return fmt::format("ended its process with code {}", WEXITSTATUS(status));
}

}  // namespace

ChildRun run_in_child(const std::function<std::string()>& work, const ChildLimits& limits) {
  Pipe answer;
  const pid_t parent = getpid();
  struct sigaction before {};
  sigaction(SIGCHLD, nullptr, &before);
  hear_of_children();
  const pid_t id = fork();
  if (id < 0) throw MachineError(fmt::format("no process can be started to read in: {}", std::strerror(errno)));
  if (id == 0) {
    confine(parent, limits);
    work_in_child(work, answer.write.number());
  }
  answer.write = Descriptor();
  ChildRun run;
  run.problem = listen_to(answer.read.number(), limits, run.output);
  if (!run.problem.empty()) kill(id, SIGKILL);
  const std::optional<int> status = wait_for_child(id);
  sigaction(SIGCHLD, &before, nullptr);
  if (!run.problem.empty()) return run;
  const bool ended = status && WIFEXITED(*status) && WEXITSTATUS(*status) == 0 && !run.output.empty();
  const char kind = ended ? run.output.front() : '\0';
  if (ended) run.output.erase(0, 1);
  if (kind == kRefusal) throw InputError(run.output);
  if (!ended) run.problem = status ? end_text(*status, limits) : "ended, and nobody knows how";
  if (kind == kNoMemory) run.problem = fmt::format("takes more than {} of memory", bytes_in_words(limits.memory));
  if (kind == kOtherError) run.problem = "fails: " + run.output;
  return run;
}

}  // namespace graze
