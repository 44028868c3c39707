#include "engine/library/python_process.h"

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
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/library/one_line.h"
#include "engine/library/python_use.h"
#include "engine/settings/child_end.h"
#include "engine/settings/forked.h"
#include "python_runner.h"

namespace graze {

namespace {

constexpr int kPythonTickMilliseconds = 50;  // between looks at a silent interpreter
constexpr double kPythonTick = kPythonTickMilliseconds / 1000.0;

/// The descriptors of the interpreter, by the numbers that the runner knows them by.
constexpr int kSocket = 3, kRunner = 5;  // the memory is 4
/// What it answers.
constexpr char kMade = 'k', kRaised = 'e', kWrongClass = 'c', kNoNumPy = 'n', kNotStarted = 'x';
/// Its answer to the control step of this number.
constexpr char done(unsigned request) { return static_cast<char>(0x80 | (request & 0x7f)); }

[[noreturn]] void nothing_left(const char* what) {
  throw MachineError(fmt::format("no Python can be started for the controller: {}: {}", what, std::strerror(errno)));
}

Descriptor memory_of(const char* name, std::size_t bytes) {
  Descriptor out(memfd_create(name, MFD_CLOEXEC));
  if (!out || ftruncate(out.number(), static_cast<off_t>(bytes)) != 0) nothing_left("shared memory");
  return out;
}

/// The text that the interpreter runs, as a file without a name.
Descriptor runner_file() {
  const std::string_view text = kPythonRunner;
  Descriptor out = memory_of("graze-runner", 0);
  if (write(out.number(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) nothing_left("memory");
  lseek(out.number(), 0, SEEK_SET);
  return out;
}

/// The environment with what makes Python's results repeatable: sets in one order, one thread in libraries of linear
/// algebra, whose sums depend on their number (unless the user says how many).
std::vector<std::string> python_variables() {
  std::vector<std::string> out;
  for (char** one = environ; *one != nullptr; ++one) {
    if (!std::string_view(*one).starts_with("PYTHONHASHSEED=")) out.emplace_back(*one);
  }
  out.emplace_back("PYTHONHASHSEED=0");
  for (const char* threads : {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"}) {
    if (std::getenv(threads) == nullptr) out.push_back(std::string(threads) + "=1");
  }
  return out;
}

std::vector<char*> pointers_to(std::vector<std::string>& words) {
  std::vector<char*> out;
  for (std::string& word : words) out.push_back(word.data());
  out.push_back(nullptr);
  return out;
}

/// What the child is given, made before the fork: a child of a program with threads allocates nothing.
struct PythonStart {
  pid_t parent;
  bool own_group;
  std::array<int, 3> descriptors;  // socket, memory, runner
  char* const* words;
  char* const* variables;
};

/// In the child. What it prints goes where errors go: standard output may be a table. Signals that are meant for the
/// campaign end no controller.
[[noreturn]] void become_python(const PythonStart& start) {
  die_with(start.parent);
  if (start.own_group) setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGXCPU}) std::signal(signal, SIG_IGN);
  for (const int signal : {SIGPIPE, SIGCHLD}) std::signal(signal, SIG_DFL);  // it may have children of its own
  const auto give_up = [&] {
    const std::array<char, 2> told = {kNotStarted, static_cast<char>(errno)};
    [[maybe_unused]] const ssize_t sent = write(start.descriptors[0], told.data(), told.size());
    _exit(127);
  };
  constexpr int kAway = kRunner + 1;  // so that none of them stands where another shall go
  std::array<int, 3> away{};
  for (std::size_t i = 0; i < away.size(); ++i) {
    away[i] = fcntl(start.descriptors[i], F_DUPFD, kAway);
    if (away[i] >= 0) continue;
    errno = EMFILE;  // EINVAL where the limit is below kAway
    give_up();
  }
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  for (std::size_t i = 0; i < away.size(); ++i) dup2(away[i], kSocket + static_cast<int>(i));
  close_range(kRunner + 1, ~0U, 0);
  execvpe(start.words[0], start.words, start.variables);
  const std::array<char, 2> told = {kNotStarted, static_cast<char>(errno)};
  [[maybe_unused]] const ssize_t sent = write(kSocket, told.data(), told.size());
  _exit(127);
}

std::string python_end_text(std::optional<int> known) {
  if (!known) return "ended its process, nobody knows how,";
  const int status = *known;
  if (!WIFSIGNALED(status)) return fmt::format("ended its process with exit code {}", WEXITSTATUS(status));
  const char* const name = sigabbrev_np(WTERMSIG(status));
  return fmt::format("crashed (SIG{})", name ? name : "?");
}

/// "walk.py: loading it raised …"
constexpr const char* kLoading = "loading it";

const char* python_name_of(LibraryCall call) {
  if (call == LibraryCall::create) return "__init__()";
  return call == LibraryCall::start ? "reset()" : call == LibraryCall::act ? "act()" : kLoading;
}

}  // namespace

PythonProcess::PythonProcess(const LibraryUse& use, const std::string& setup, std::size_t bytes)
    : name_(one_line(std::filesystem::path(use.file).filename().string())),
      interpreter_(use.interpreter),
      timeout_(use.timeout),
      bytes_(bytes) {
  try {
    start(setup);
    const double never = std::nan("");
    const char word = listen(never, timeout_ + kSlowStart);
    if (word == kNoNumPy) {
      throw PythonRefused("interpreter", fmt::format("{}: {}", name_, no_numpy_text(interpreter_)));
    }
    if (word == kWrongClass) throw PythonRefused("class", failure(never, "raised " + message()));
    if (word == kRaised) fail(never, "raised " + message());
    if (word != kMade) fail(never, "wrote into the socket that Graze listens to");
  } catch (...) {
    end();
    if (memory_) munmap(memory_, bytes_);
    throw;
  }
}

PythonProcess::~PythonProcess() {
  end();
  munmap(memory_, bytes_);
}

void PythonProcess::start(const std::string& setup) {
  const Descriptor shared = memory_of("graze-python", bytes_), runner = runner_file();
  void* const page = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, shared.number(), 0);
  if (page == MAP_FAILED) nothing_left("shared memory");
  memory_ = static_cast<std::byte*>(page);
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) nothing_left("a socket");
  socket_ = Descriptor(ends[0]);
  const Descriptor theirs(ends[1]);
  // -u: what is printed before a crash shall be seen. Nothing is imported from the folder that this program happens to
  // run in. The last word is there for those who look at a list of processes.
  std::vector<std::string> words = {
      interpreter_, "-u", "-c",
      std::string(kNotFromHere) + "exec(compile(open(5, encoding='utf-8').read(), '<graze>', 'exec'))", name_};
  std::vector<std::string> variables = python_variables();
  const std::vector<char*> word_list = pointers_to(words), variable_list = pointers_to(variables);
  own_group_ = shown_library_calls() == nullptr;  // else this is a worker process, whose group is ended as a whole
  const PythonStart start = {getpid(),
                             own_group_,
                             {theirs.number(), shared.number(), runner.number()},
                             word_list.data(),
                             variable_list.data()};
  id_ = fork();
  if (id_ < 0) {
    id_ = 0;
    nothing_left("fork");
  }
  if (id_ == 0) become_python(start);
  if (own_group_) setpgid(id_, id_);  // whoever of the two is first
  say(setup + "\n");
}

/// If nobody takes it, listen() says why.
void PythonProcess::say(const std::string& bytes) {
  const char* at = bytes.data();
  double waited = 0;
  for (std::size_t left = bytes.size(); left > 0;) {
    wait_for(POLLOUT, std::nan(""), timeout_ + kSlowStart, waited);  // it may be long, and the interpreter not listen
    const ssize_t sent = send(socket_.number(), at, left, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (sent < 0) break;
    at += sent;
    left -= static_cast<std::size_t>(sent);
  }
}

void PythonProcess::step(double time) {
  if (!is_owner()) {
    throw std::runtime_error(fmt::format(
        "{}: its interpreter belongs to the process that this one is a copy of by fork(), which goes on with it; make "
        "a controller of your own in the copy",
        name_));
  }
  const char request = 'a';
  while (send(socket_.number(), &request, 1, MSG_NOSIGNAL) < 0 && errno == EINTR) {
  }
  const char word = listen(time, timeout_);
  if (word == done(++requests_)) return;
  fail(time, word == kRaised ? "raised " + message() : "wrote into the socket that Graze listens to");
}

/// Waits until the socket can be read or written (`what`, as of poll()). Time is counted in ticks of this process, so
/// that a machine that was asleep does not make a call look slow, and added to `waited`.
void PythonProcess::wait_for(short what, double time, double limit, double& waited) {
  auto before = std::chrono::steady_clock::now();
  while (true) {
    pollfd end = {socket_.number(), what, 0};
    if (poll(&end, 1, kPythonTickMilliseconds) > 0) return;
    if (has_ended()) died(time);
    const auto now = std::chrono::steady_clock::now();
    waited += std::min(std::chrono::duration<double>(now - std::exchange(before, now)).count(), 2 * kPythonTick);
    if (waited > limit) hangs(time, limit);
  }
}

/// Waits for its word.
char PythonProcess::listen(double time, double limit) {
  double waited = 0;
  while (true) {
    wait_for(POLLIN, time, limit, waited);
    char word = 0;
    const ssize_t got = recv(socket_.number(), &word, 1, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) died(time);
    if (word == kNotStarted) not_started();
    return word;
  }
}

bool PythonProcess::has_ended() const { return child_has_ended(id_); }

/// "in act() at 0.012 s".
std::string PythonProcess::where(double time) const {
  const std::string call = python_name_of(static_cast<LibraryCall>(page().stage));
  return std::isnan(time) ? call : fmt::format("{} at {:.6g} s", call, time);
}

/// The memory is the controller's, too, and may hold anything.
std::string PythonProcess::message() const {
  const auto size = std::clamp<std::int64_t>(page().message_size, 0, sizeof page().message);
  return std::string(page().message, static_cast<std::size_t>(size));
}

void PythonProcess::fail(double time, const std::string& what) const { throw std::runtime_error(failure(time, what)); }

std::string PythonProcess::failure(double time, const std::string& what) const {
  return fmt::format("{}: {} {}", name_, where(time), one_line(what));
}

void PythonProcess::not_started() {
  unsigned char error = 0;
  if (recv(socket_.number(), &error, 1, 0) != 1) error = 0;
  errno = error;
  if (error == EMFILE || error == ENFILE) nothing_left("descriptors (ulimit -n)");
  throw PythonRefused("interpreter",
                      fmt::format("{}: the interpreter '{}' cannot be started: {}; name a program on PATH or a "
                                  "file under `interpreter`",
                                  name_, interpreter_, std::strerror(error)));
}

void PythonProcess::died(double time) {
  constexpr int kMostLooks = 500;  // 1 s, for one that has closed its end and is about to end
  for (int i = 0; i < kMostLooks && !has_ended(); ++i) usleep(2000);
  const bool ended = has_ended();
  end();
  if (!ended) fail(time, "closed the socket that Graze listens to");
  if (status_ && WIFSIGNALED(*status_) && WTERMSIG(*status_) == SIGKILL) {
    throw CallLost(fmt::format("{}: the controller {} in {}", name_, kKilled, where(time)));
  }
  throw std::runtime_error(fmt::format("{}: the controller {} in {}", name_, python_end_text(status_), where(time)));
}

/// Lets Python print where it is before it is ended.
void PythonProcess::hangs(double time, double limit) {
  kill(id_, SIGUSR1);
  usleep(200000);
  end();
  const std::string call = where(time);
  throw CallTimedOut(fmt::format("{}: {}{} did not come back within {:g} s", name_,
                                 call == kLoading ? "" : "the controller's ", call, limit));
}

bool PythonProcess::is_owner() const { return getpid() == owner_; }

void PythonProcess::end() noexcept {
  if (id_ > 0 && is_owner()) status_ = end_child(id_, own_group_);
  id_ = 0;
}

}  // namespace graze
