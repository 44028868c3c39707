#include "jobs/cli/gnuplot.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string_view>
#include <vector>

#include "archive/files/utf8.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr const char* kPackage = "Debian's package gnuplot-nox has it (apt-get install gnuplot-nox)";

[[noreturn]] void fail_starting(int error) {
  if (error == ENOENT) {
    throw MachineError(
        fmt::format("gnuplot: is not there (no program of that name on PATH), and graze plot draws with "
                    "it; {}",
                    kPackage));
  }
  throw MachineError(fmt::format("gnuplot: cannot be started: {}; {}", std::strerror(error), kPackage));
}

/// Both ends of a pipe; other programs that are started do not get them.
struct PipeEnds {
  int read = -1, write = -1;
  PipeEnds() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) fail_starting(errno);
    read = ends[0];
    write = ends[1];
  }
  ~PipeEnds() {
    shut(read);
    shut(write);
  }
  PipeEnds(const PipeEnds&) = delete;
  PipeEnds& operator=(const PipeEnds&) = delete;
  static void shut(int& end) {
    if (end >= 0) close(end);
    end = -1;
  }
};

/// Writing to a gnuplot that has gone fails, and does not end this program.
class NoPipeSignal {
 public:
  NoPipeSignal() { sigaction(SIGPIPE, &ignore_, &before_); }
  ~NoPipeSignal() { sigaction(SIGPIPE, &before_, nullptr); }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  static struct sigaction ignoring() {
    struct sigaction out {};
    out.sa_handler = SIG_IGN;
    return out;
  }
  struct sigaction ignore_ = ignoring(), before_{};
};

/// The environment, with a locale in which numbers have points.
std::vector<char*> plain_environment() {
  static char plain[] = "LC_ALL=C.UTF-8";
  std::vector<char*> out;
  for (char** one = environ; *one != nullptr; ++one) {
    const std::string_view text(*one);
    if (!text.starts_with("LC_ALL=") && !text.starts_with("GNUPLOT") && !text.starts_with("GNUTERM=")) {
      out.push_back(*one);
    }
  }
  out.push_back(plain);
  out.push_back(nullptr);
  return out;
}

pid_t start_gnuplot(const PipeEnds& in, const PipeEnds& out, const PipeEnds& err) {
  static char name[] = "gnuplot", defaults[] = "-d", from_pipe[] = "-";
  std::array<char*, 4> arguments = {name, defaults, from_pipe, nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, in.read, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, out.write, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, err.write, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t broken_pipe;
  sigemptyset(&broken_pipe);
  sigaddset(&broken_pipe, SIGPIPE);
  posix_spawnattr_setsigdefault(&attributes, &broken_pipe);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  std::vector<char*> environment = plain_environment();
  pid_t id = 0;
  const int error = posix_spawnp(&id, name, &files, &attributes, arguments.data(), environment.data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) fail_starting(error);
  return id;
}

/// Gives the script and takes what comes, at the same time: neither side waits for the other's full pipe.
class Conversation {
 public:
  Conversation(std::string_view script, PipeEnds& in, PipeEnds& out, PipeEnds& err)
      : script_(script), in_(in), out_(out), err_(err) {
    fcntl(in.write, F_SETFL, O_NONBLOCK);
  }
  std::string drawn, said;

  void hold() {
    while (out_.read >= 0 || err_.read >= 0) {
      std::array<pollfd, 3> ends = {{{in_.write, POLLOUT, 0}, {out_.read, POLLIN, 0}, {err_.read, POLLIN, 0}}};
      if (poll(ends.data(), ends.size(), -1) < 0 && errno != EINTR) break;
      if (ends[0].revents != 0) tell();
      if (ends[1].revents != 0) take(out_.read, drawn);
      if (ends[2].revents != 0) take(err_.read, said);
    }
  }

 private:
  void tell() {
    const ssize_t n = write(in_.write, script_.data(), script_.size());
    if (n > 0) script_.remove_prefix(static_cast<std::size_t>(n));
    const bool gone = n < 0 && errno != EAGAIN && errno != EINTR;
    if (gone || script_.empty()) PipeEnds::shut(in_.write);
  }
  static void take(int& end, std::string& into) {
    std::array<char, 65536> bytes;
    const ssize_t n = read(end, bytes.data(), bytes.size());
    if (n > 0) into.append(bytes.data(), static_cast<std::size_t>(n));
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) PipeEnds::shut(end);
  }

  std::string_view script_;
  PipeEnds &in_, &out_, &err_;
};

int wait_for(pid_t id) {
  int status = 0;
  while (waitpid(id, &status, 0) < 0) {
    if (errno != EINTR) return -1;
  }
  return status;
}

/// The first line that says something.
std::string complaint(const std::string& said) {
  for (std::size_t begin = 0; begin < said.size();) {
    const std::size_t end = std::min(said.find('\n', begin), said.size());
    const std::string line = said.substr(begin, end - begin);
    if (line.find_first_not_of(" \t^") != std::string::npos && !line.starts_with("gnuplot>")) {
      return printable(clipped(line.substr(line.find_first_not_of(' ')), 300));
    }
    begin = end + 1;
  }
  return "it drew nothing, and said nothing";
}

bool whole(std::string_view drawn) {
  const std::string_view end = drawn.substr(drawn.size() - std::min<std::size_t>(drawn.size(), 16));
  return end.find("</svg>") != std::string_view::npos || end.find("IEND") != std::string_view::npos;
}

}  // namespace

std::string drawn_by_gnuplot(const std::string& script, const std::string& what) {
  const NoPipeSignal guard;
  PipeEnds in, out, err;
  const pid_t id = start_gnuplot(in, out, err);
  PipeEnds::shut(in.read);
  PipeEnds::shut(out.write);
  PipeEnds::shut(err.write);
  Conversation talk(script, in, out, err);
  talk.hold();
  const int status = wait_for(id);
  if (status == 0 && whole(talk.drawn)) return std::move(talk.drawn);
  if (status > 0 && WIFSIGNALED(status)) {
    throw MachineError(fmt::format("{}: gnuplot was ended by {}", what, strsignal(WTERMSIG(status))));
  }
  throw MachineError(
      fmt::format("{}: gnuplot failed: {}; graze plot needs gnuplot 5.4 or later with its terminals svg "
                  "and pngcairo: {}",
                  what, complaint(talk.said), kPackage));
}

void check_gnuplot(bool png) {
  drawn_by_gnuplot(
      fmt::format("set terminal {} size 40,30 noenhanced\nplot [0:1][0:1] x notitle\n", png ? "pngcairo" : "svg"),
      png ? "a PNG file" : "an SVG file");
}

}  // namespace graze
