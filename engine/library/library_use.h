#pragma once
// What a scenario says of a controller from outside, in a shared object (policy `library`) or in Python (policy
// `python`), and whether this process may run it. Such a controller is code that runs with the user's rights: none is
// run unless the user has said so (--trust), and none that must be isolated but in a process of its own.

#include <atomic>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/settings/description.h"
#include "engine/settings/settings.h"

namespace graze {

/// What this process may load: nothing; libraries with `isolation: none`; all.
enum class LibraryLoading { refused, in_process, all };

/// For the whole process; at first `refused`. In programs that call the simulator themselves: before the scenario is
/// read.
void allow_libraries(LibraryLoading what);
LibraryLoading libraries_allowed();
/// The user has asked for what this process may not load. Nothing is wrong with the machine, but no particle is to
/// blame either, so it ends a campaign as a MachineError does; programs return the exit code of invalid input.
class LibraryRefused : public MachineError {
 public:
  using MachineError::MachineError;
};
/// A call was cut short by what may not happen again: its particle is left unfinished, whoever is to blame.
class CallLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// Of a process that has ended by SIGKILL, which comes from outside nearly always.
inline constexpr const char* kKilled = "was killed (SIGKILL), by somebody or for want of the machine's memory,";
/// It has not returned by its limit on the clock.
class CallTimedOut : public CallLost {
 public:
  using CallLost::CallLost;
};
/// The nominal robot's URDF, which libraries are given (GrazeSetup::urdf). For the whole process.
void brief_libraries(std::string urdf);
std::string library_urdf();

/// A file of a controller, as it was when the scenario was read, or as its archive keeps it.
struct OutsideFile {
  std::string path;  // absolute
  std::string sha256;
};

/// What `library: {…}` or `python: {…}` says.
struct LibraryUse {
  Settings place;      // the map, for messages
  std::string file;    // absolute
  std::string sha256;  // of the file when the scenario was read, or as its archive keeps it
  bool isolated = true;
  double timeout = 0;                   // s, longest time of one call
  std::string class_name = {};          // of a controller in Python; empty: a shared object
  std::string interpreter = {};         // the same: a program on PATH, or a file
  std::string environment = {};         // the same: "Python 3.11.2, NumPy 1.24.2"; empty where nobody may ask
  std::vector<OutsideFile> files = {};  // the same: what it reads beside `file`

  bool loads_here() const {
    const LibraryLoading allowed = libraries_allowed();
    return allowed == LibraryLoading::all || (allowed == LibraryLoading::in_process && !isolated);
  }
  bool is_python() const { return !class_name.empty(); }
};

/// Of the map under `library`. Throws InputError if there is no such file.
LibraryUse read_library_use(const Described& own);
/// Of a whole policy, `{library: {…}, control: {…}}` or `{python: {…}, …}`; nothing if it is another.
std::optional<LibraryUse> library_use(const Settings& policy);
/// Whether a policy is one of these, and whether it must run in a process of its own. Reads no file.
bool is_from_outside(const Settings& policy);
bool is_isolated(const Settings& policy);
/// Throws InputError unless the files on the disk are the ones that were meant.
void check_library_file(const LibraryUse& use);

const Description& library_description();
/// The keys that both kinds have.
Key isolation_key();
Key timeout_key(std::string help);
/// A file that a setting names, relative to the scenario. `ending`: of files that may be meant. Throws InputError if
/// there is no such file.
OutsideFile read_outside_file(const Settings& typed, const std::string& ending = "");
/// The file under `file`, its SHA-256 and the keys above. `ending`: of files that may be meant. Throws InputError if
/// there is no such file.
LibraryUse read_outside_use(const Described& own, const std::string& ending);
/// The word of `isolation` for processes of its own.
inline constexpr const char* kOwnProcess = "process";

/// Where a library is called, for whoever watches this process from outside: a page that both share.
enum class LibraryCall : std::uint32_t { none, load, create, start, act, destroy };
const char* name_of(LibraryCall call);    // "act()"
inline constexpr double kSlowStart = 60;  // s more than its timeout, for loading and create()
/// Whether it is one of them: a page that a library has overwritten may hold anything.
bool is_call(LibraryCall call);
struct LibraryCalls {
  std::atomic<LibraryCall> inside{LibraryCall::none};
  std::atomic<std::uint64_t> count{0};  // calls that have returned
  std::atomic<double> time{0};          // s in the trace, of the call
  std::atomic<std::uint64_t> beats{0};  // grows several times a second as long as the process runs at all
};
/// Null, as at first: nobody watches. For the whole process.
void show_library_calls(LibraryCalls* page);
LibraryCalls* shown_library_calls();

/// The call into a library that this thread is in, for whoever must name it when the library ends the program there.
struct LibraryCallHere {
  LibraryCall call = LibraryCall::none;
  double time = 0;             // s in the trace; NaN: there is none
  const char* file = nullptr;  // name of the library
  double limit = 0;            // s on the clock, longest time of the call
};
/// May be asked in a handler of signals.
LibraryCallHere library_call_here();
/// The thread enters a call, or, with {}, has left it.
void show_call_here(const LibraryCallHere& call);
/// The libraries that this process has loaded ("walk.so, lift.so"), whose own threads are in no call; null: none. May
/// be asked in a handler of signals.
const char* libraries_loaded();
/// One more, by its name.
void add_loaded_library(const std::string& name);
/// Whether this process is a copy that a library has made of it by fork(). Known once libraries have been allowed.
bool is_forked_copy();

}  // namespace graze
