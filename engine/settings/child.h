#pragma once
// Work on files that may be anybody's, by libraries that were not made for such: in a child process, whose crash, hang
// or hunger ends the child alone.

#include <cstddef>
#include <functional>
#include <string>

namespace graze {

struct ChildLimits {
  unsigned seconds;    // of processor time; of the clock, five times as many
  std::size_t memory;  // bytes of address space beyond what the process has; not under sanitizers
  std::size_t output;  // bytes of what it returns
};

/// How a child ended.
struct ChildRun {
  std::string problem;  // empty: all went well; else "crashed (SIGSEGV)", "took more than 30 s of processor time", …
  std::string output;   // what `work` returned
};

/// Forks, and returns what `work` returns in the child. An InputError that it throws there is thrown here. The child
/// has neither standard input nor output, and dies with its parent. `work` may not use what other threads of this
/// process hold. Throws MachineError where the system has no process or pipe left.
ChildRun run_in_child(const std::function<std::string()>& work, const ChildLimits& limits);

}  // namespace graze
