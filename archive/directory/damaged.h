#pragma once
// The folder damaged/ of a campaign directory: a repair moves there what has the name of a campaign's file and is
// none, or not a whole one. So nothing is lost of which it is not known what it is.

#include <string>

#include "archive/files/directory.h"

namespace graze {

/// Moves what has a name in a folder (the directory, or one in it) into damaged/, under a name that is free there.
/// Needs the directory's lock. Throws InputError as why_not_put_aside(), MachineError if it cannot be moved.
void put_aside(const Directory& directory, const Directory& folder, const std::string& name);
/// What has the name damaged/ and is no directory, in a message; empty: nothing is in the way of put_aside().
std::string why_not_put_aside(const Directory& directory);

}  // namespace graze
