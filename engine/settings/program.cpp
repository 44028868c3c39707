#include "engine/settings/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "engine/settings/inputs.h"
#include "engine/settings/pipe.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostErrors = 64u << 10;  // bytes; no message repeats as many

/// posix_spawn()'s settings: silent input, both outputs into pipes, a process group of its own, usual signals.
class SpawnSettings {
 public:
  SpawnSettings(const Pipe& out, const Pipe& err) {
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files, out.write.number(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&files, err.write.number(), STDERR_FILENO);
    posix_spawnattr_init(&attributes);
    sigset_t usual, none;
    sigemptyset(&usual);
    sigemptyset(&none);
    for (const int signal : {SIGPIPE, SIGINT, SIGTERM, SIGHUP}) sigaddset(&usual, signal);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  }
  ~SpawnSettings() {
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
};

class Program {
 public:
  explicit Program(const ProgramLimits& limits)
      : limits_(limits),
        deadline_(Clock::now() +
                  std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limits.seconds))) {}
  ~Program() { kill_group(); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  ProgramRun run(std::vector<std::string> words) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const int error = start(arguments);
    out_.write = Descriptor();
    err_.write = Descriptor();
    if (error != 0) {
      run_.there = error != ENOENT;
      run_.problem = fmt::format("cannot be started: {}", std::strerror(error));
      return std::move(run_);
    }
    listen();
    if (run_.problem.empty()) wait();
    kill_group();
    return std::move(run_);
  }

 private:
  int start(std::vector<char*>& arguments) {
    const SpawnSettings settings(out_, err_);
    pid_t id = 0;
    const int error = posix_spawnp(&id, arguments[0], &settings.files, &settings.attributes, arguments.data(), environ);
    if (error == 0) id_ = id;
    return error;
  }

  /// ms until the deadline, at least 0.
  int left() const {
    const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - Clock::now()).count();
    return static_cast<int>(std::clamp<long long>(rest, 0, 1'000'000));
  }

  /// Until both outputs end; nobody waits for a full pipe.
  void listen() {
    while (run_.problem.empty() && (out_.read || err_.read)) {
      std::array<pollfd, 2> ends = {{{out_.read.number(), POLLIN, 0}, {err_.read.number(), POLLIN, 0}}};
      const int ready = poll(ends.data(), ends.size(), left());
      if (ready == 0 && left() == 0) return took_too_long();
      if (ready <= 0) continue;
      if (ends[0].revents != 0) take(out_.read, run_.output, limits_.output + 1);
      if (ends[1].revents != 0) take(err_.read, run_.errors, kMostErrors);
      if (run_.output.size() > limits_.output) {
        run_.problem = fmt::format("printed more than {}", bytes_in_words(limits_.output));
      }
    }
  }

  static void take(Descriptor& end, std::string& into, std::size_t most) {
    std::array<char, 1 << 16> bytes;
    const ssize_t got = read(end.number(), bytes.data(), bytes.size());
    if (got > 0) into.append(bytes.data(), std::min(static_cast<std::size_t>(got), most - into.size()));
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) end = Descriptor();
  }

  void wait() {
    constexpr useconds_t kPause = 2000;  // us; who has closed its outputs is about to end
    int status = 0;
    while (true) {
      const pid_t ended = waitpid(id_, &status, WNOHANG);
      if (ended == id_) break;
      if (ended < 0 && errno != EINTR) break;
      if (left() == 0) return took_too_long();
      usleep(kPause);
    }
    kill(-id_, SIGKILL);  // what it has left behind in its group
    id_ = 0;
    if (WIFSIGNALED(status)) run_.problem = fmt::format("was ended by a signal: {}", strsignal(WTERMSIG(status)));
    if (WIFEXITED(status) && WEXITSTATUS(status) != 0) {
      run_.problem = fmt::format("ended with exit code {}", WEXITSTATUS(status));
    }
  }

  void took_too_long() { run_.problem = fmt::format("did not end within {:g} s", limits_.seconds); }

  void kill_group() {
    if (id_ <= 0) return;
    kill(-id_, SIGKILL);
    while (waitpid(id_, nullptr, 0) < 0 && errno == EINTR) {
    }
    id_ = 0;
  }

  const ProgramLimits limits_;
  const Clock::time_point deadline_;
  Pipe out_, err_;
  pid_t id_ = 0;  // 0: none that runs
  ProgramRun run_;
};

}  // namespace

ProgramRun run_program(const std::vector<std::string>& words, const ProgramLimits& limits) {
  return Program(limits).run(words);
}

}  // namespace graze
