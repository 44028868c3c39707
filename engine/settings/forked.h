#pragma once
// What a process does first that was just forked. Only calls that a child of a program with threads may make.

#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>

namespace graze {

/// From now on it is killed when the thread of `parent` that forked it ends; ends now if that has happened already.
inline void die_with(pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
}

/// As a program expects to be started: in a process group of its own, no signal blocked, and those that this program
/// handles or ignores with their usual effect.
inline void behave_as_started() {
  setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int signal : {SIGPIPE, SIGINT, SIGTERM, SIGHUP, SIGXFSZ, SIGCHLD}) std::signal(signal, SIG_DFL);
}

}  // namespace graze
