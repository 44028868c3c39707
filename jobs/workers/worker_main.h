#pragma once

namespace graze {

/// Whether the program was started as a worker: by itself, and with the descriptors of one.
bool started_as_worker(int argc, char** argv);

/// The process that runs controllers for another one: reads its briefing, then simulates what it is asked for until
/// nobody asks any more. Returns the exit code.
int work_for_parent();

}  // namespace graze
