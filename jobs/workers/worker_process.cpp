#include "jobs/workers/worker_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <random>
#include <utility>

#include "engine/settings/child_end.h"
#include "engine/settings/forked.h"
#include "engine/settings/pipe.h"
#include "simulation/watchdog.h"

namespace graze {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr double kSlowTaking = 60;         // s, for taking a message
constexpr std::size_t kMostOutput = 4096;  // bytes of what a controller prints that are kept
constexpr int kTickMilliseconds = 50;      // between looks at a worker
constexpr double kTick = kTickMilliseconds / 1000.0;
constexpr double kStall = 10;      // s for the next byte of an answer that has begun
constexpr double kHeadless = 0.5;  // s: far longer than a process takes to end all its threads
constexpr double kLeastWait = 2;   // s: shorter limits than that say nothing about a process as a whole
constexpr int kNotPlaced = 126, kNotStarted = 127;  // exit codes, of its descriptors and of execv()
constexpr double kLastWait = 5;                     // s, the same once the campaign has been asked to stop
std::atomic<bool> asked_to_stop{false};
constexpr const char* kNoProcess = "no process can be started for the controller";

[[noreturn]] void no_process(const char* what) {
  throw MachineError(fmt::format("{}: {}: {}", kNoProcess, what, std::strerror(errno)));
}

/// In the child, which may make few calls: closes all descriptors but these, so that there is room for theirs.
void close_others(std::array<int, 3> kept) {
  std::sort(kept.begin(), kept.end());
  unsigned first = 0;
  for (const int number : kept) {
    const auto next = static_cast<unsigned>(number);
    if (next > first) close_range(first, next - 1, 0);
    first = next + 1;
  }
  close_range(first, ~0U, 0);
}

/// Puts them where the worker knows them, and nothing else. False: that cannot be.
bool place_descriptors(int socket, int page, int printed) {
  close_others({socket, page, printed});
  constexpr int kAway = kWorkerPage + 1;  // so that none of them stands where another shall go
  socket = fcntl(socket, F_DUPFD, kAway), page = fcntl(page, F_DUPFD, kAway), printed = fcntl(printed, F_DUPFD, kAway);
  if (socket < 0 || page < 0 || printed < 0) return false;
  const int nothing = open("/dev/null", O_RDONLY);
  if (nothing < 0 || dup2(nothing, STDIN_FILENO) < 0) return false;
  if (dup2(printed, STDOUT_FILENO) < 0 || dup2(printed, STDERR_FILENO) < 0) return false;
  if (dup2(socket, kWorkerSocket) < 0 || dup2(page, kWorkerPage) < 0) return false;
  close_range(kAway, ~0U, 0);
  return true;
}

/// In the child: its descriptors at the numbers that it knows them by, nothing else open, a process group of its own,
/// usual signals, and death with its parent.
[[noreturn]] void become_worker(pid_t parent, int socket, int page, int printed) {
  die_with(parent);
  behave_as_started();
  if (!place_descriptors(socket, page, printed)) _exit(kNotPlaced);
  std::array<char, 6> name = {'g', 'r', 'a', 'z', 'e', '\0'};
  std::array<char, 7> verb = {'w', 'o', 'r', 'k', 'e', 'r', '\0'};
  std::array<char*, 3> arguments = {name.data(), verb.data(), nullptr};
  execv("/proc/self/exe", arguments.data());
  _exit(kNotStarted);
}

/// Where the controller's output goes.
Pipe output_pipe() {
  try {
    return {};
  } catch (const MachineError& error) {
    throw MachineError(std::string(kNoProcess) + ": " + error.what());
  }
}

std::uint64_t random_mark() {
  std::random_device random;
  return std::uint64_t{random()} << 32 | random();
}

/// s since `before`, which becomes now. No more than two ticks, so that a machine that was asleep makes nothing look
/// slow.
double time_since(SteadyClock::time_point& before) {
  const auto now = SteadyClock::now();
  return std::min(std::chrono::duration<double>(now - std::exchange(before, now)).count(), 2 * kTick);
}

/// Whether the thread that simulates has ended while others of its process go on: a system call of the controller's may
/// do that, or a filter for them.
bool main_thread_has_ended(pid_t id) {
  std::ifstream file(fmt::format("/proc/{}/stat", id));
  std::string text;
  std::getline(file, text);  // "ID (NAME) STATE …", and a name may have brackets, too
  const std::size_t bracket = text.rfind(')');
  return bracket != std::string::npos && bracket + 2 < text.size() && text[bracket + 2] == 'Z';
}

}  // namespace

/// Time that has passed in one and the same state of a worker, s.
class WorkerClock {
 public:
  void look(const LibraryCalls& calls, std::size_t arrived, bool headless) {
    const double passed = time_since(before_);
    call_ = calls.inside.load(std::memory_order_acquire);
    const std::uint64_t returned = calls.count.load(std::memory_order_acquire);
    const bool same_call = call_ != LibraryCall::none && std::exchange(count_, returned) == returned;
    inside_ = same_call ? inside_ + passed : 0;
    const std::uint64_t beats = calls.beats.load(std::memory_order_relaxed);
    still_ = std::exchange(beats_, beats) == beats ? still_ + passed : 0;
    stalled_ = std::exchange(arrived_, arrived) == arrived && arrived > 0 ? stalled_ + passed : 0;
    headless_ = headless ? headless_ + passed : 0;
  }
  LibraryCall call() const { return call_; }
  double inside() const { return inside_; }      // in this call
  double still() const { return still_; }        // without a sign of life
  double stalled() const { return stalled_; }    // since the last byte of a message that is not whole
  double headless() const { return headless_; }  // its main thread has ended, and the others have not

 private:
  SteadyClock::time_point before_ = SteadyClock::now();
  LibraryCall call_ = LibraryCall::none;
  std::uint64_t count_ = 0, beats_ = 0;
  std::size_t arrived_ = 0;
  double inside_ = 0, still_ = 0, stalled_ = 0, headless_ = 0;
};

void wait_for_stopped_workers_no_more() { asked_to_stop = true; }

WorkerProcess::WorkerProcess(const std::string& briefing, const WorkerPatience& patience)
    : patience_(patience), mark_(random_mark()) {
  try {
    start();
    say('b', briefing);
    const WorkerMessage word = listen();
    if (word.kind == static_cast<char>(WorkerWord::refusal)) throw InputError(word.bytes);
    if (word.kind != static_cast<char>(WorkerWord::ready)) throw MachineError(word.bytes);
    ready_ = true;
  } catch (const WorkerDied& died) {
    end();
    if (calls_) munmap(calls_, sizeof(LibraryCalls));
    throw MachineError(fmt::format("{}: {}", kNoProcess, died.what()));
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
  const timeval most{static_cast<time_t>(kSlowTaking), 0};
  setsockopt(ends[0], SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);  // one that is stopped takes nothing
  const Descriptor page(memfd_create("graze-controller", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!page || ftruncate(page.number(), sizeof(LibraryCalls)) != 0) no_process("shared memory");
  // Whoever reads a page that another has cut off dies of SIGBUS.
  if (fcntl(page.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) no_process("shared memory");
  void* const shared = mmap(nullptr, sizeof(LibraryCalls), PROT_READ | PROT_WRITE, MAP_SHARED, page.number(), 0);
  if (shared == MAP_FAILED) no_process("shared memory");
  calls_ = new (shared) LibraryCalls;
  Pipe printed = output_pipe();
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

/// A message with the next mark. If nobody takes it, listen() says why.
void WorkerProcess::say(char kind, const std::string& bytes) {
  if (send_word(socket_.number(), {kind, bytes, ++mark_})) return;
  if (errno == EAGAIN || errno == EWOULDBLOCK) lost(fmt::format("process took no message for {:g} s", kSlowTaking));
}

WorkerMessage WorkerProcess::ask(const WorkerRequest& request) {
  say('a', request.to_text());
  return listen();
}

/// Waits for its word.
WorkerMessage WorkerProcess::listen() {
  WorkerClock clock;
  while (true) {
    std::array<pollfd, 2> ends = {{{socket_.number(), POLLIN, 0}, {printed_.number(), POLLIN, 0}}};
    poll(ends.data(), ends.size(), kTickMilliseconds);
    if (ends[1].revents != 0) take_output();
    const bool ended = has_ended();  // before the last look at what it has said
    switch (inbox_.look(socket_.number(), mark_)) {
      case WorkerInbox::State::whole:
        take_output();
        return inbox_.take();
      case WorkerInbox::State::garbled:
        end();
        take_output();
        throw WorkerDied("something in the controller's process wrote into the simulator's socket");
      case WorkerInbox::State::closed:
        died();
      case WorkerInbox::State::part:
        break;
    }
    if (ended) died();
    clock.look(*calls_, inbox_.arrived(), main_thread_has_ended(id_));
    look_at_clock(clock);
  }
}

void WorkerProcess::look_at_clock(const WorkerClock& clock) {
  const LibraryCall call = clock.call();
  if (!is_call(call)) overwritten();
  if (clock.headless() > kHeadless) {
    const std::string place = where();
    end();
    take_output();
    throw WorkerDied(fmt::format("the controller ended the thread that simulates {}", place));
  }
  const bool slow = call != LibraryCall::start && call != LibraryCall::act;
  const double limit = patience_.call + (slow ? kSlowStart : 0);
  if (clock.inside() > limit) {
    const double time = calls_->time.load(std::memory_order_relaxed);
    lost(fmt::format("{}{} did not come back within {:g} s", name_of(call),
                     std::isnan(time) ? "" : fmt::format(" at {:.6g} s", time), limit));
  }
  const bool limited = patience_.frozen > 0;
  double still = std::max(patience_.frozen, kLeastWait);
  if (asked_to_stop) still = limited ? std::min(still, kLastWait) : kLastWait;
  if ((limited || asked_to_stop) && clock.still() > still) {
    lost(fmt::format("process did not run for {:g} s, as if it had been stopped", still));
  }
  if (clock.stalled() > kStall) lost(fmt::format("process began an answer and did not end it within {:g} s", kStall));
}

void WorkerProcess::take_output() {
  constexpr int kMostReads = 16;  // one that prints without end shall not keep us from looking at the clock
  std::array<char, 1 << 12> bytes;
  for (int reads = 0; printed_ && reads < kMostReads; ++reads) {
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

bool WorkerProcess::has_ended() const { return child_has_ended(id_); }

/// "in act() at 0.012 s".
std::string WorkerProcess::where() const {
  const LibraryCall call = calls_->inside.load(std::memory_order_acquire);
  if (call == LibraryCall::none) return "outside of the controller's functions";
  const double time = calls_->time.load(std::memory_order_relaxed);
  return std::isnan(time) ? fmt::format("in {}", name_of(call)) : fmt::format("in {} at {:.6g} s", name_of(call), time);
}

/// Waits for its end, and takes what it prints meanwhile.
bool WorkerProcess::ends_within(double seconds) {
  double waited = 0;
  auto before = SteadyClock::now();
  while (!has_ended()) {
    if (waited > seconds) return false;
    pollfd printed = {printed_.number(), POLLIN, 0};
    poll(&printed, 1, kTickMilliseconds / 10);
    if (printed.revents != 0) take_output();
    waited += time_since(before);
  }
  return true;
}

void WorkerProcess::overwritten() {
  end();
  take_output();
  throw WorkerDied("the controller has overwritten what its process shares with the simulator");
}

void WorkerProcess::died() {
  const LibraryCall call = calls_->inside.load(std::memory_order_acquire);
  if (!is_call(call)) overwritten();
  const std::string place = where();
  const bool itself = ends_within(kLeastWait);  // one that has closed its end is about to
  end();
  take_output();
  if (!status_) throw WorkerDied(fmt::format("the controller's process ended {}, and nobody knows how", place));
  const bool exited = WIFEXITED(*status_);
  const int code = exited ? WEXITSTATUS(*status_) : EXIT_SUCCESS;
  // A controller may end its process with the same codes, but does so within a call.
  const bool own = calls_->inside.load(std::memory_order_acquire) == LibraryCall::none;
  if (own && code == kWorkerStuck) throw Overtime{};
  if (!ready_ && own && code == kNotPlaced) {
    throw WorkerLost("its descriptors cannot be placed: too many open files (ulimit -n)");
  }
  if (!ready_ && own && code == kNotStarted) throw WorkerLost("this program cannot be run once more");
  if (!itself || (own && code == kWorkerUnheard)) {
    throw WorkerDied("the controller closed its process's connection to the simulator");
  }
  const int signal = WTERMSIG(*status_);
  if (!exited && signal == SIGKILL) throw WorkerLost(fmt::format("the controller {} {}", kKilled, place));
  if (signal == SIGBUS && !exited && call == LibraryCall::load) {
    throw WorkerLost(fmt::format("the controller crashed (SIGBUS) {}, as a file does that is cut short", place));
  }
  const std::string what = exited ? fmt::format("the controller ended its process with exit code {} {}", code, place)
                                  : fmt::format("the controller crashed ({}) {}", signal_name(signal), place);
  if (call == LibraryCall::load || call == LibraryCall::create) throw WorkerLost(what);
  throw WorkerDied(what);
}

void WorkerProcess::lost(const std::string& why) {
  end();
  take_output();
  throw WorkerLost("the controller's " + why);
}

std::string WorkerProcess::finish() {
  if (id_ == 0) return "";
  shutdown(socket_.number(), SHUT_WR);
  const double limit = std::max(patience_.call, kLeastWait);
  const bool itself = ends_within(limit);
  const LibraryCall call = calls_->inside.load(std::memory_order_acquire);
  end();
  take_output();
  const char* const where = call == LibraryCall::destroy ? "destroy()" : "process";
  if (!itself) return fmt::format("the controller's {} did not end within {:g} s and was killed", where, limit);
  const bool destroying = call == LibraryCall::destroy;
  if (!status_ || (WIFEXITED(*status_) && !destroying)) return "";
  const char* const when = destroying ? "in destroy()" : "at its end";
  if (WIFEXITED(*status_)) {
    return fmt::format("the controller ended its process with exit code {} {}", WEXITSTATUS(*status_), when);
  }
  const int signal = WTERMSIG(*status_);
  if (signal == SIGKILL) return fmt::format("the controller {} {}", kKilled, when);
  return fmt::format("the controller crashed ({}) {}", signal_name(signal), when);
}

void WorkerProcess::end() {
  if (id_ == 0) return;
  status_ = end_child(id_, true);
  id_ = 0;
}

}  // namespace graze
