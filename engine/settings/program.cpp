#include "engine/settings/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "engine/settings/child_end.h"
#include "engine/settings/forked.h"
#include "engine/settings/inputs.h"
#include "engine/settings/pipe.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostErrors = 64u << 10;  // bytes; no message repeats as many

/// The file on PATH that a shell would run by this name, or else one that may not be run; empty: there is none.
std::string found_on_path(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/bin:/usr/bin");
  std::string locked;
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path file = std::filesystem::path(folder.empty() ? "." : folder) / name;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) continue;
    if (access(file.c_str(), X_OK) == 0) return file.string();
    if (locked.empty()) locked = file.string();
  }
  return locked;
}

/// Why a file that is there cannot be run: a script may name an interpreter that is not.
std::string start_problem(const std::string& file, int error) {
  std::string first;
  if (error == ENOENT) std::getline(std::ifstream(file), first);
  if (!first.starts_with("#!")) return fmt::format("cannot be started: {}", std::strerror(error));
  return fmt::format("cannot be started: the interpreter in the first line of {}, '{}', is not there", file,
                     clipped(first, 80));
}

/// In the child: silent input, both outputs into pipes, a process group of its own, usual signals, and death with its
/// parent. Writes errno to `failed` if the program cannot be started.
[[noreturn]] void become(const char* file, char* const* arguments, pid_t parent, int out, int err, int failed) {
  die_with(parent);
  behave_as_started();
  dup2(open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  execv(file, arguments);
  const int error = errno;
  [[maybe_unused]] const ssize_t told = write(failed, &error, sizeof error);
  _exit(127);
}

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
    const std::string file = found_on_path(words[0]);
    run_.there = !file.empty();
    if (!run_.there) return std::move(run_);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const int error = start(file, arguments);
    out_.write = Descriptor();
    err_.write = Descriptor();
    if (error != 0) {
      run_.problem = start_problem(file, error);
      return std::move(run_);
    }
    listen();
    if (run_.problem.empty()) wait();
    kill_group();
    return std::move(run_);
  }

 private:
  /// 0 or errno.
  int start(const std::string& file, std::vector<char*>& arguments) {
    Pipe failed;  // which a program that starts closes
    const pid_t parent = getpid(), id = fork();
    if (id < 0) throw MachineError(fmt::format("no process can be started: {}", std::strerror(errno)));
    if (id == 0) {
      become(file.c_str(), arguments.data(), parent, out_.write.number(), err_.write.number(), failed.write.number());
    }
    id_ = id;
    failed.write = Descriptor();
    int error = 0;
    ssize_t got = 0;
    while ((got = read(failed.read.number(), &error, sizeof error)) < 0 && errno == EINTR) {
    }
    if (got != sizeof error) return 0;
    kill_group();
    return error;
  }

  /// Whether the program itself has ended, which stays to be waited for.
  bool has_ended() const { return child_has_ended(id_); }

  /// ms until the deadline, at least 0.
  int left() const {
    const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - Clock::now()).count();
    return static_cast<int>(std::clamp<long long>(rest, 0, 1'000'000));
  }

  /// Until both outputs end, or the program has and what it wrote is read: what it has started may hold them open.
  /// Nobody waits for a full pipe.
  void listen() {
    constexpr int kLook = 50;  // ms between looks whether it has ended
    while (run_.problem.empty() && (out_.read || err_.read)) {
      const bool over = has_ended();
      if (over) kill(-id_, SIGKILL);
      std::array<pollfd, 2> ends = {{{out_.read.number(), POLLIN, 0}, {err_.read.number(), POLLIN, 0}}};
      const int ready = poll(ends.data(), ends.size(), over ? 0 : std::min(left(), kLook));
      if (over && (ready == 0 || left() == 0)) return;
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
    while (!has_ended()) {
      if (left() == 0) return took_too_long();
      usleep(kPause);
    }
    const auto status = end_child(id_, true);  // with what it has left behind in its group
    id_ = 0;
    if (!status) {
      run_.problem = "ended, and nobody knows how: this process ignores SIGCHLD";
    } else if (WIFSIGNALED(*status)) {
      run_.problem = fmt::format("was ended by a signal: {}", strsignal(WTERMSIG(*status)));
    } else if (WIFEXITED(*status) && WEXITSTATUS(*status) != 0) {
      run_.problem = fmt::format("ended with exit code {}", WEXITSTATUS(*status));
    }
  }

  void took_too_long() { run_.problem = fmt::format("did not end within {:g} s", limits_.seconds); }

  void kill_group() {
    if (id_ <= 0) return;
    end_child(id_, true);
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
