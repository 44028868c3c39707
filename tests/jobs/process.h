#pragma once
// The program as a process of its own that a test looks at, sends signals to, and waits for.

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/jobs/program.h"

namespace graze::testing {

class Process {
 public:
  /// Starts graze in a folder; `prepare` runs in the new process before the program does.
  Process(
      const fs::path& folder, const std::string& arguments, const std::function<void()>& prepare = [] {})
      : folder_(folder) {
    std::istringstream words(arguments);
    std::vector<std::string> list = {GRAZE_PROGRAM};
    for (std::string word; words >> word;) list.push_back(word);
    std::vector<char*> argv;
    for (std::string& word : list) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string out = (folder / ".out").string(), err = (folder / ".err").string();
    std::array<int, 2> started{};
    if (pipe2(started.data(), O_CLOEXEC) != 0) return;
    id_ = fork();
    if (id_ != 0) {
      // Until the program itself runs, the process still has this one's signal handlers.
      close(started[1]);
      char none = 0;
      while (read(started[0], &none, 1) > 0) {
      }
      close(started[0]);
      return;
    }
    for (const int number : {SIGPIPE, SIGXFSZ}) std::signal(number, SIG_DFL);
    if (chdir(folder.c_str()) != 0) _exit(126);
    dup2(open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), STDOUT_FILENO);
    dup2(open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), STDERR_FILENO);
    prepare();
    execv(GRAZE_PROGRAM, argv.data());
    _exit(127);
  }
  ~Process() {
    if (id_ <= 0) return;
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal) const { kill(id_, signal); }
  std::string err() const { return read_file(folder_ / ".err"); }
  bool ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0;
  }
  /// Waits until something is so; fails the test if the program ends before that.
  void wait_until(const std::function<bool()>& so) const {
    while (!so()) {
      if (ended()) {
        ADD_FAILURE() << "the program has ended: " << err();
        return;
      }
      usleep(1000);
    }
  }
  /// True once the program does something of its own about a signal (Linux).
  bool catches(int signal) const {
    std::istringstream status(read_file("/proc/" + std::to_string(id_) + "/status"));
    for (std::string line; std::getline(status, line);) {
      if (line.rfind("SigCgt:", 0) == 0) return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1)) & 1;
    }
    return false;
  }
  Result wait() {
    int status = 0;
    waitpid(id_, &status, 0);
    id_ = 0;
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(folder_ / ".out"), err(), 0};
  }

 private:
  fs::path folder_;
  pid_t id_ = 0;
};

}  // namespace graze::testing
