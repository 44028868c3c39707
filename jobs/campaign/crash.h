#pragma once
// The last line of defence: libraries in C that find no memory, and files that make them fall, end in a signal. The
// user gets a message, the exit code of a machine that failed, and is told how a campaign goes on.

#include <string>

namespace graze {

/// From now on SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT (std::terminate), exit(-1), and exit() while a MainAtWork
/// lives, end this process with a message and exit code 3, and so does exit() within a call into a controller, which is
/// named; `directory` can be resumed then, if it is not empty (`trust`: with --trust). Other threads whose stack may
/// overflow need a SignalStack; the calling one, the main thread, gets its own. Child processes die by them as ever.
/// Not where somebody else (a sanitizer, a debugger's hooks) handles them.
void contain_crashes(const std::string& directory = "", bool trust = false);

/// main() has not come to its end: whatever calls exit() meanwhile has not done what the program is for.
class MainAtWork {
 public:
  MainAtWork();
  ~MainAtWork();
  MainAtWork(const MainAtWork&) = delete;
  MainAtWork& operator=(const MainAtWork&) = delete;
};

}  // namespace graze
