#pragma once
// A campaign that --force replaces lies in a folder of its own directory until the new one has a shard. Whoever holds
// the directory's lock next finds out what a kill has left half done.

#include <string>

#include "archive/files/directory.h"

namespace graze {

inline constexpr const char* kReplacingFolder = "replacing";  // not everything has been moved there, or back
inline constexpr const char* kReplacedFolder = "replaced";    // everything has

// All of these but interrupted_replacing() and replacing_text() need the directory's lock.

/// Moves everything but the lock into kReplacedFolder. Throws InputError if the directory cannot be listed,
/// MachineError if something cannot be moved; all that can be moved is back in its place then.
void set_aside(const Directory& directory);
/// Removes of a campaign without a shard what there is of it. Does nothing if there is a shard.
void remove_begun(const Directory& directory);
/// Moves everything back, if something was set aside; what has come instead has no shard, and goes.
/// Returns whether anything was moved. Throws as set_aside().
bool put_back(const Directory& directory);
/// Removes what was set aside.
void drop_set_aside(const Directory& directory);
/// What a killed writer would have done next: put_back() if the new campaign has no shard, else drop_set_aside().
/// Returns whether an old campaign came back. Throws InputError, and changes nothing, if the state is `stuck`.
bool recover_set_aside(const Directory& directory);

/// What recover_set_aside() will do.
enum class Replacing {
  none,
  comes_back,  // the old campaign, from where it was set aside
  goes,        // what was set aside: the new campaign has a shard
  stuck,       // nothing: no kill leaves this, somebody has put things there, and either way some would be lost
};
struct ReplacingState {
  Replacing what = Replacing::none;
  std::string why = {};  // it is stuck, and what the user has to do: a whole message
};
/// Throws InputError.
ReplacingState interrupted_replacing(const Directory& directory);
/// For users, a whole message: what has happened to the directory, and what 'graze resume' does about it, or they have
/// to do; empty: nothing.
std::string replacing_text(const Directory& directory);

}  // namespace graze
