#pragma once
// A campaign that --force replaces lies in a folder of its own directory until the new one has a shard. Whoever holds
// the directory's lock next finds out what a kill has left half done.

#include <filesystem>

namespace graze {

inline constexpr const char* kReplacingFolder = "replacing";  // not everything has been moved there, or back
inline constexpr const char* kReplacedFolder = "replaced";    // everything has

// All of these need the directory's lock.

/// Moves everything but the lock into kReplacedFolder. Throws InputError if the directory cannot be listed,
/// MachineError if something cannot be moved; all is in its place then.
void set_aside(const std::filesystem::path& directory);
/// Removes of a campaign without a shard what there is of it.
void remove_empty(const std::filesystem::path& directory);
/// Moves everything back, if something was set aside; what has come instead has no shard, and goes.
/// Returns whether anything was moved. Throws as set_aside().
bool put_back(const std::filesystem::path& directory);
/// Removes what was set aside.
void drop_set_aside(const std::filesystem::path& directory);
/// What a killed writer would have done next: put_back() if the new campaign has no shard, else drop_set_aside().
/// Returns whether an old campaign came back.
bool recover_set_aside(const std::filesystem::path& directory);

}  // namespace graze
