#pragma once
// Files that may be anybody's are read in a child process: a seal tells accidents from whole files, but anyone who
// knows it can seal bytes on which the HDF5 library crashes, hangs or takes all memory. What it does there ends with
// the child, and the user gets a message that names the file. Under a debugger, and in a child already, all stays in
// one process.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace graze {

/// What a child may take.
struct ReadingLimits {
  std::uint64_t memory = 0;   // bytes of address space, beyond what the process has when it begins
  std::uint64_t seconds = 0;  // of processor time
};

/// More than any honest archive needs, by the bytes that the files, or those of a campaign directory, have on the disk:
/// 1.4 GB and twice the bytes; half a minute and `seconds_per_megabyte`.
ReadingLimits reading_limits(const std::vector<std::filesystem::path>& paths, double seconds_per_megabyte = 0.1);

/// While it lives, this process is inside the HDF5 library for that file.
class ReadingNote {
 public:
  explicit ReadingNote(const std::filesystem::path& file) noexcept;
  ~ReadingNote();
  ReadingNote(const ReadingNote&) = delete;
  ReadingNote& operator=(const ReadingNote&) = delete;
};

/// How a child ended.
struct ReaderEnd {
  int status = 0;       // as waitpid() gives it
  std::string file;     // that it was reading last
  bool inside = false;  // the library, when it ended
  bool over = false;    // the reading: end_of_reading() has been called
  bool done = false;    // what it was for: end_of_child() has been called
};

/// Forks: returns nothing in the child, which goes on with the limits in force and dies with its parent; in the parent,
/// how the child ended. To be called before there are threads. Throws MachineError if there can be no child.
std::optional<ReaderEnd> go_on_in_child(const ReadingLimits& limits);
/// Whether this process is such a child, or is watched by a debugger, which would lose sight of one.
bool may_not_fork();
/// In a child: there is nothing more to be read from the file, the limits go. Elsewhere nothing.
void end_of_reading();

/// In a child: whatever it is for has come to its end, an exception included. Elsewhere nothing.
void end_of_child() noexcept;

/// Whether a child that a signal ended died of what it read, and not of something else: then throws MachineError (it
/// was killed, or crashed without reading) or ends this process by the same signal (Ctrl-C, a closed pipe).
bool died_of_reading(const ReaderEnd& end);
/// What killed a child (a signal), as the user shall know it: "FILE: the HDF5 library crashed on it (SIGSEGV): …".
std::string death_text(const ReaderEnd& end, const ReadingLimits& limits);
/// In a child that found no memory: the same.
std::string too_large_text();

/// A file that cannot be read, and why.
struct Unreadable {
  std::size_t file;  // index
  std::string why;   // the whole message
};
/// Has children run `read` on each file, and returns those for which it throws or kills the child. What passes may then
/// be read by this process.
std::vector<Unreadable> unreadable(const std::vector<std::filesystem::path>& files,
                                   const std::function<void(const std::filesystem::path&)>& read);

}  // namespace graze
