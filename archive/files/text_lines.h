#pragma once
// Files of lines that may be anybody's: read piece by piece, within limits.

#include <cstdint>
#include <functional>
#include <string>

namespace graze {

/// Calls `take` with each line of an open file, without its end; a last line that has none counts, too. What is longer
/// than a mebibyte is no line of ours and is left out, and so is what lies beyond `most_bytes` or cannot be read.
void for_each_line(int descriptor, std::uint64_t most_bytes, const std::function<void(const std::string&)>& take);

/// Whether the last line of an open file has no end: it was cut off in its writing, and what is appended must begin a
/// line of its own.
bool ends_torn(int descriptor);

}  // namespace graze
