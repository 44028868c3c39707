#pragma once
// Bounds on settings files and on what they name, so that no file can exhaust memory, time or the stack. Each stands
// far above anything that was written for a robot; a file that meets one is of another kind, or hostile.

#include <cstddef>
#include <string>
#include <string_view>

namespace graze {

/// Bytes of one settings file. Long scenarios have 10 kB.
inline constexpr std::size_t kMaxBytes = 16u << 20;
/// Values of a tree once aliases are expanded, and of all files that it includes: 300 bytes of memory each.
inline constexpr std::size_t kMaxNodes = 1u << 20;
/// Nesting of maps and lists, and of includes: recursion stays shallow.
inline constexpr int kMaxDepth = 64;
/// Files that one scenario may include.
inline constexpr int kMaxIncludes = 64;
/// Bytes of a key: keys are names, paths and globs, and stand in every message.
inline constexpr std::size_t kMaxKeyBytes = 1000;

/// Bytes of a glob, and plain patterns that its braces stand for: both multiply the work of a comparison.
inline constexpr std::size_t kMaxGlobBytes = 1000;
inline constexpr std::size_t kMaxAlternatives = 1000;

/// Bytes of any file that a scenario names, unless its reader says less.
inline constexpr std::size_t kMaxInputBytes = 64u << 20;
/// Bytes of all of them together: a campaign keeps them in memory and in its archive. Robots with meshes for each link
/// have 25 MB.
inline constexpr std::size_t kMaxAllInputBytes = 512u << 20;

/// "16 MiB", "1000 bytes": a bound in a message.
std::string bytes_in_words(std::size_t bytes);

/// What is wrong with the size of a glob, for a message; empty: nothing.
std::string glob_problem(std::string_view pattern);

}  // namespace graze
