#pragma once
// The operating system as it is on its worst day. This test program defines open, write, rename, malloc and the like
// itself, so that Graze and all the libraries that it uses call these definitions: they count the calls that concern
// files below one folder, let chosen ones fail, end the process at one, or record what was changed. Each trial runs a
// verb of the program in a forked process; what happened there is told through memory that is shared.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace graze::faults {

enum class What {
  pass,    // nothing but counting
  fail,    // the chosen call fails
  shrink,  // the chosen call, if it writes, writes half of what it was given; the one after that fails
  kill,    // the process is killed before the chosen call, as by kill -9
  record,  // what is changed is recorded
};

/// What shall happen in a trial.
struct Plan {
  What what = What::pass;
  long at = 0;            // the chosen call, from 1
  bool for_good = false;  // from then on all calls fail
  int error = 5;          // what errno is then (EIO)
  long allocation = 0;    // the allocation of memory that fails, from 1; 0: none
  long thread = 0;        // the first thread that cannot be started, from 1, nor any after it; 0: all can
  bool paths = false;     // note the call path of each allocation
  long kill_after = -1;   // microseconds after which the process is killed from outside; -1: never
};

/// A change of the disk, in the order in which they were made. `path` is absolute. Inodes are those of a real disk and
/// may be used again after a file is gone.
struct Change {
  enum class Kind : std::uint32_t { create, make_directory, write, truncate, rename, link, unlink, sync };
  Kind kind;
  std::uint64_t inode = 0;   // of what is created, written, cut or synced
  std::uint64_t offset = 0;  // of a write; the new length of a truncate
  std::string path;          // what is created, removed, or renamed; empty for what is done to an open file
  std::string to;            // new name
  std::string data;          // of a write
};

/// How a verb ended.
struct Outcome {
  int code = 0;  // exit code; 128 + signal if it was killed
  std::string out, err;
  long calls = 0;      // that concerned files below the folder
  std::string failed;  // the call that failed or was killed at first: "rename /…/a.graze/campaign.h5.tmp"
  std::string failed_path;
  long allocations = 0;                   // of memory
  long threads = 0;                       // that were asked for
  std::vector<std::uint64_t> call_paths;  // of each allocation, if they were asked for
  std::vector<Change> changes;
};

/// Runs `graze ARGUMENTS` (words between blanks) in a folder. Calls that concern files below it count. A verb that has
/// not ended after a minute is killed: code 128 + SIGALRM.
Outcome run(const std::filesystem::path& folder, const std::string& arguments, const Plan& plan = {});

/// Whether malloc of this program can be made to fail: not with a sanitizer, which has its own.
bool can_exhaust_memory();

}  // namespace graze::faults
