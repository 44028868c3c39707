#pragma once
// How the program ends, and what it says on stderr.

#include <exception>
#include <string>
#include <vector>

namespace graze {

/// Exit codes (design: 0 done and every gate met; 1 a gate was missed; 2 invalid input; 3 incomplete or the machine
/// failed; 4 inconclusive at the requested confidence).
enum ExitCode { kDone = 0, kGateMissed = 1, kInvalidInput = 2, kMachineFailed = 3, kInconclusive = 4 };

/// Says on stderr what went wrong and returns the exit code for it.
ExitCode report_error(const std::exception_ptr& error);

/// Says on stderr what is good to know, a sentence each.
void warn(const std::vector<std::string>& sentences);

}  // namespace graze
