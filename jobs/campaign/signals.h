#pragma once
// Signals that ask a campaign to stop: Ctrl-C, the end of a terminal, a scheduler's pre-emption or time limit.

#include <atomic>
#include <string>

namespace graze {

/// From now on SIGINT, SIGTERM, SIGHUP, SIGUSR1 and SIGXCPU set the flag that is given back, unless they were ignored
/// before (nohup); the first of them is acknowledged on stderr. A second SIGINT or SIGTERM leaves the program at once
/// with exit code 3, saying that `directory` can be resumed; `trust`: by a command with --trust.
/// A closed pipe and a file that may not grow (SIGPIPE, SIGXFSZ) no longer end the program; the write that they are
/// about fails.
const std::atomic<bool>& heed_signals(const std::string& directory, bool trust = false);

/// "SIGTERM": what set the flag first; empty if nothing did.
std::string stop_signal();

}  // namespace graze
