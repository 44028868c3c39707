#pragma once
// Files of lines that may be anybody's: read piece by piece, within limits.

#include <cstdint>
#include <functional>
#include <string>

namespace graze {

/// Calls `take` with each line of an open file, without its end; a last line that has none counts, too. What is longer
/// than a mebibyte is no line of ours and is left out, and so is what lies beyond `most_bytes` or cannot be read.
void for_each_line(int descriptor, std::uint64_t most_bytes, const std::function<void(const std::string&)>& take);

}  // namespace graze
