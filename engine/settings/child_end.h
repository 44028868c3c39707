#pragma once
// How children of this process end. A process that ignores SIGCHLD, as whoever started it may have arranged, never
// learns that: the system forgets them, and waitid() and waitpid() fail with ECHILD.

#include <sys/types.h>
#include <sys/wait.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <string>

namespace graze {

/// "SIGSEGV"
inline std::string signal_name(int signal) {
  const char* const name = sigabbrev_np(signal);
  return std::string("SIG") + (name != nullptr ? name : "?");
}

/// If SIGCHLD is ignored, from now on it is not. Other handlers stay. For the whole process.
inline void hear_of_children() {
  struct sigaction now {};
  if (sigaction(SIGCHLD, nullptr, &now) != 0) return;
  const bool ignored = (now.sa_flags & SA_SIGINFO) == 0 && now.sa_handler == SIG_IGN;
  if (!ignored && (now.sa_flags & SA_NOCLDWAIT) == 0) return;
  if (ignored) now.sa_handler = SIG_DFL;
  now.sa_flags &= ~SA_NOCLDWAIT;
  sigaction(SIGCHLD, &now, nullptr);
}

/// Whether a child has ended; it stays to be waited for. One that somebody else has waited for has ended, too.
inline bool child_has_ended(pid_t id) {
  siginfo_t info{};
  int result = 0;
  while ((result = waitid(P_PID, static_cast<id_t>(id), &info, WEXITED | WNOHANG | WNOWAIT)) != 0 && errno == EINTR) {
  }
  return result == 0 ? info.si_pid == id : errno == ECHILD;
}

/// Waits for a child's end. Returns its status as waitpid() gives it; nothing where it has ended and nobody knows how.
inline std::optional<int> wait_for_child(pid_t id) {
  int status = 0;
  while (waitpid(id, &status, 0) < 0) {
    if (errno != EINTR) return std::nullopt;
  }
  return status;
}

/// Kills a child, with its process group if it has one of its own, and waits for it. Whoever has been waited for is
/// left alone: its number may be another's by now.
inline std::optional<int> end_child(pid_t id, bool own_group) {
  siginfo_t info{};
  if (waitid(P_PID, static_cast<id_t>(id), &info, WEXITED | WNOHANG | WNOWAIT) != 0 && errno == ECHILD) {
    return std::nullopt;
  }
  if (own_group) kill(-id, SIGKILL);
  kill(id, SIGKILL);  // before it had a group
  return wait_for_child(id);
}

}  // namespace graze
