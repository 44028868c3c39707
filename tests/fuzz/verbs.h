#pragma once
// The program's verbs inside a fuzz target: as main() runs them, with nothing printed.

#include <string>
#include <vector>

namespace graze::fuzz {

/// Runs `graze WORDS…`. True if it went through, false if it ended with a message (InputError, MachineError); anything
/// else that a verb throws gets out, and is a crash.
bool run_verb(const std::vector<std::string>& words);

}  // namespace graze::fuzz
