#pragma once
// Going on with a campaign that is on disk: `graze resume`, and each value of `graze sweep`.

#include <cstdint>
#include <string>
#include <vector>

#include "jobs/cli/simulate.h"

namespace graze {

struct ResumeArguments {
  std::string directory;
  std::uint64_t particles = 0;  // in all; 0: as many as before
  int threads = 0;
  double watchdog = 0;                // s
  std::vector<std::string> policies;  // globs of policies to add
  bool ignore_space = false, json = false, quiet = false;
  bool table = true;  // print it at the end
  bool all = false;   // simulate as many particles as are asked for, whatever answers the questions of --until sooner
};

/// Takes up the campaign in a directory, mends it, simulates what is missing. Throws InputError (no campaign, another
/// results version, …) and MachineError; returns what simulate_into() does.
ExitCode resume_campaign(const ResumeArguments& arguments, Start& start);

}  // namespace graze
