#pragma once
// What a scenario says of a controller in a shared object (policy `library`), and whether this process may load it. A
// shared object is code that runs with the user's rights: none is loaded unless the user has said so (--trust), and
// none that must be isolated but in a process of its own.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

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
/// The nominal robot's URDF, which libraries are given (GrazeSetup::urdf). For the whole process.
void brief_libraries(std::string urdf);
std::string library_urdf();

/// What `library: {…}` says.
struct LibraryUse {
  Settings place;      // the map, for messages
  std::string file;    // absolute
  std::string sha256;  // of the file when the scenario was read, or as its archive keeps it
  bool isolated = true;
  double timeout = 0;  // s, longest time of one call
  bool loads_here() const {
    const LibraryLoading allowed = libraries_allowed();
    return allowed == LibraryLoading::all || (allowed == LibraryLoading::in_process && !isolated);
  }
};

/// Of the map under `library`. Throws InputError if there is no such file.
LibraryUse read_library_use(const Described& own);
/// Of a whole policy, `{library: {…}, control: {…}}`; nothing if it is another.
std::optional<LibraryUse> library_use(const Settings& policy);
/// Throws InputError unless the file on the disk is the one that was meant.
void check_library_file(const LibraryUse& use);

const Description& library_description();
/// The word of `isolation` for processes of its own.
inline constexpr const char* kOwnProcess = "process";

/// Where a library is called, for whoever watches this process from outside: a page that both share.
enum class LibraryCall : std::uint32_t { none, load, create, start, act, destroy };
const char* name_of(LibraryCall call);  // "act()"
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
};
LibraryCallHere& library_call_here();
/// Whether this process is a copy that a library has made of it by fork(). Known once libraries have been allowed.
bool is_forked_copy();

}  // namespace graze
