#include "jobs/workers/worker_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <new>
#include <vector>

#include "engine/settings/forked.h"
#include "engine/settings/pipe.h"
#include "simulation/watchdog.h"

namespace graze {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr double kSlowStart = 60;          // s more, for loading and create()
constexpr std::size_t kMostOutput = 4096;  // bytes of what a controller prints that are kept
constexpr int kTickMilliseconds = 50;      // between looks at a worker
constexpr double kTick = kTickMilliseconds / 1000.0;

[[noreturn]] void no_process(const char* what) {
  throw MachineError(fmt::format("no process can be started for the controller: {}: {}", what, std::strerror(errno)));
}

/// In the child: its descriptors at the numbers that it knows them by, nothing else open, a process group of its own,
/// usual signals, and death with its parent.
[[noreturn]] void become_worker(pid_t parent, int socket, int page, int printed) {
  die_with(parent);
  behave_as_started();
  constexpr int kAway = 10;  // so that none of them stands where another shall go
  socket = fcntl(socket, F_DUPFD, kAway), page = fcntl(page, F_DUPFD, kAway), printed = fcntl(printed, F_DUPFD, kAway);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(printed, STDOUT_FILENO);
  dup2(printed, STDERR_FILENO);
  dup2(socket, kWorkerSocket);
  dup2(page, kWorkerPage);
  close_range(kWorkerPage + 1, ~0U, 0);
  std::array<char, 6> name = {'g', 'r', 'a', 'z', 'e', '\0'};
  std::array<char, 7> verb = {'w', 'o', 'r', 'k', 'e', 'r', '\0'};
  std::array<char*, 3> arguments = {name.data(), verb.data(), nullptr};
  execv("/proc/self/exe", arguments.data());
  _exit(127);
}

std::string signal_name(int signal) {
  const char* const name = sigabbrev_np(signal);
  return fmt::format("SIG{}", name ? name : "?");
}

}  // namespace

WorkerProcess::WorkerProcess(const std::string& briefing, double timeout) : timeout_(timeout) {
  try {
    start();
    send_word(socket_.number(), 'b', briefing);  // if nobody takes it, listen() says why
    const WorkerMessage word = listen();
    if (word.kind == static_cast<char>(WorkerWord::refusal)) throw InputError(word.bytes);
    if (word.kind != static_cast<char>(WorkerWord::ready)) throw MachineError(word.bytes);
  } catch (...) {
    end();
    if (calls_) munmap(calls_, sizeof(LibraryCalls));
    throw;
  }
}

WorkerProcess::~WorkerProcess() {
  end();
  munmap(calls_, sizeof(LibraryCalls));
}

void WorkerProcess::start() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) no_process("a socket");
  socket_ = Descriptor(ends[0]);
  const Descriptor theirs(ends[1]);
  const Descriptor page(memfd_create("graze-controller", MFD_CLOEXEC));
  if (!page || ftruncate(page.number(), sizeof(LibraryCalls)) != 0) no_process("shared memory");
  void* const shared = mmap(nullptr, sizeof(LibraryCalls), PROT_READ | PROT_WRITE, MAP_SHARED, page.number(), 0);
  if (shared == MAP_FAILED) no_process("shared memory");
  calls_ = new (shared) LibraryCalls;
  Pipe printed;
  const pid_t parent = getpid();
  id_ = fork();
  if (id_ < 0) {
    id_ = 0;
    no_process("fork");
  }
  if (id_ == 0) become_worker(parent, theirs.number(), page.number(), printed.write.number());
  setpgid(id_, id_);  // whoever of the two is first
  printed_ = std::move(printed.read);
  fcntl(printed_.number(), F_SETFL, O_NONBLOCK);
}

WorkerMessage WorkerProcess::ask(const WorkerRequest& request) {
  send_word(socket_.number(), 'a', request.to_text());
  return listen();
}

/// Waits for its word. Time in a call is counted in ticks of this process, so that a machine that was asleep does not
/// make a call look slow.
WorkerMessage WorkerProcess::listen() {
  double inside = 0;  // s in one and the same call
  std::uint64_t count = 0;
  auto before = SteadyClock::now();
  while (true) {
    std::array<pollfd, 2> ends = {{{socket_.number(), POLLIN, 0}, {printed_.number(), POLLIN, 0}}};
    poll(ends.data(), ends.size(), kTickMilliseconds);
    if (ends[1].revents != 0) take_output();
    if (ends[0].revents != 0) {
      auto word = receive_word(socket_.number());
      take_output();
      if (!word) died();
      return std::move(*word);
    }
    if (has_ended()) died();
    const auto now = SteadyClock::now();
    const double passed = std::chrono::duration<double>(now - std::exchange(before, now)).count();
    const LibraryCall call = calls_->inside.load(std::memory_order_acquire);
    const std::uint64_t returned = calls_->count.load(std::memory_order_acquire);
    inside = call == LibraryCall::none || std::exchange(count, returned) != returned
                 ? 0
                 : inside + std::min(passed, 2 * kTick);
    const bool slow = call != LibraryCall::start && call != LibraryCall::act;
    const double limit = timeout_ + (slow ? kSlowStart : 0);
    if (inside > limit) hangs(call, limit);
  }
}

void WorkerProcess::take_output() {
  std::array<char, 1 << 12> bytes;
  while (printed_) {
    const ssize_t got = read(printed_.number(), bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return;
    if (got == 0) {
      printed_ = Descriptor();
      return;
    }
    output_.append(bytes.data(), static_cast<std::size_t>(got));
    if (output_.size() > kMostOutput) output_.erase(0, output_.size() - kMostOutput);
    if (static_cast<std::size_t>(got) < bytes.size()) return;
  }
}

bool WorkerProcess::has_ended() const {
  siginfo_t info{};
  return waitid(P_PID, static_cast<id_t>(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == id_;
}

/// "in act() at 0.012 s".
std::string WorkerProcess::where() const {
  const LibraryCall call = calls_->inside.load(std::memory_order_acquire);
  if (call == LibraryCall::none) return "outside of the controller's functions";
  const double time = calls_->time.load(std::memory_order_relaxed);
  return std::isnan(time) ? fmt::format("in {}", name_of(call)) : fmt::format("in {} at {:.6g} s", name_of(call), time);
}

void WorkerProcess::died() {
  const std::string place = where();
  end();
  take_output();
  if (WIFEXITED(status_) && WEXITSTATUS(status_) == kWorkerStuck) throw Overtime{};
  if (WIFEXITED(status_)) {
    throw WorkerDied(fmt::format("the controller ended its process with exit code {} {}", WEXITSTATUS(status_), place));
  }
  const int signal = WTERMSIG(status_);
  const char* const perhaps = signal == SIGKILL ? ", perhaps for want of memory," : "";
  throw WorkerDied(fmt::format("the controller crashed ({}){} {}", signal_name(signal), perhaps, place));
}

void WorkerProcess::hangs(LibraryCall call, double limit) {
  const double time = calls_->time.load(std::memory_order_relaxed);
  end();
  take_output();
  throw WorkerDied(fmt::format("the controller's {}{} did not come back within {:g} s", name_of(call),
                               std::isnan(time) ? "" : fmt::format(" at {:.6g} s", time), limit));
}

void WorkerProcess::end() {
  if (id_ > 0) {
    // One that has closed its end is about to end; its own status tells more than ours.
    for (int i = 0; i < 100 && !has_ended(); ++i) {
      pollfd gone = {socket_.number(), POLLIN, 0};
      if (poll(&gone, 1, 0) == 0 || recv(socket_.number(), &gone, 1, MSG_PEEK | MSG_DONTWAIT) != 0) break;
      usleep(2000);
    }
    kill(-id_, SIGKILL);
    kill(id_, SIGKILL);  // before it had a group
    while (waitpid(id_, &status_, 0) < 0 && errno == EINTR) {
    }
    id_ = 0;
  }
}

}  // namespace graze
