#pragma once
// Other programs that the user has installed, run for what they print.

#include <cstddef>
#include <string>
#include <vector>

namespace graze {

struct ProgramLimits {
  double seconds;      // from its start to its end
  std::size_t output;  // bytes of its standard output
};

/// What came of a program.
struct ProgramRun {
  bool there = true;    // false: no program of that name on PATH
  std::string problem;  // empty: it ended with exit code 0; else "ended with exit code 2", "did not end within 60 s", …
  std::string output;  // its standard output
  std::string errors;  // what it printed to standard error, its first 64 kB
};

/// Runs the program words[0] of PATH with the other words as its arguments, without a shell and with nothing on its
/// standard input. It has a process group of its own, which is killed when the program has ended, takes longer or
/// prints more than it may; the program itself is killed with the thread that runs it. What it leaves behind outside of
/// its group is not waited for. Throws MachineError where the system has no pipes or processes left.
ProgramRun run_program(const std::vector<std::string>& words, const ProgramLimits& limits);

}  // namespace graze
