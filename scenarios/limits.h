#pragma once
// Bounds on scenarios, so that no file can exhaust memory or time. Each stands far above the largest scenario that was
// written: 3 objects, 10 requirements, 20 policies, 300 uncertain parameters.

#include <fmt/format.h>

#include <cstddef>
#include <vector>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

namespace graze {

/// Entries of `environment`, of robot.initial.joints, contact.pairs and contact.ignore: each is held against all parts.
inline constexpr std::size_t kMaxObjects = 2'000;
inline constexpr std::size_t kMaxJointEntries = 2'000;
inline constexpr std::size_t kMaxContactRules = 1'000;
/// Folders of robot.package_path: each mesh is looked for in all of them.
inline constexpr std::size_t kMaxFolders = 100;

/// Bytes of a CSV file, and columns of one whose columns have names.
inline constexpr std::size_t kMaxCsvBytes = 64u << 20;
inline constexpr std::size_t kMaxColumns = 10'000;
/// Heights of a heightfield: 2,000 by 2,000.
inline constexpr std::size_t kMaxHeights = 4'000'000;

/// Policies once `over` is multiplied out, its paths, and bytes of a policy's name, which stands in file names and
/// tables.
inline constexpr std::size_t kMaxPolicies = 1'000;
inline constexpr std::size_t kMaxOver = 20;
inline constexpr std::size_t kMaxPolicyName = 200;

/// Requirements, and predicates of the objective: each is evaluated at every step and has a column of the archive.
inline constexpr std::size_t kMaxRequirements = 1'000;

/// Comparisons of the globs of `uncertain` with parameters: some seconds.
inline constexpr std::size_t kMaxComparisons = 10'000'000;
/// Numbers that empirical distributions and choices keep: a parameter keeps its own.
inline constexpr std::size_t kMaxKeptNumbers = 10'000'000;
/// Parameters of one correlated group, and of all: factoring a matrix takes the cube of them.
inline constexpr std::size_t kMaxGroup = 500;
inline constexpr std::size_t kMaxCorrelated = 2'000;

/// Bytes of telemetry that one trace may keep: it is held in memory, for eight traces at a time on each thread.
inline constexpr double kMaxTraceBytes = 256e6;

/// Fails at `where` if there are more than `most`: "2001 objects; at most 2000".
inline void check_count(const Settings& where, std::size_t count, std::size_t most, const char* what) {
  if (count > most) where.fail(fmt::format("{} {}; at most {}", count, what, most));
}

/// Fails at `where` if a length or coordinate is beyond kMaxLength.
inline double checked_length(const Settings& where, double length) {
  if (const std::string problem = length_problem(length); !problem.empty()) where.fail(problem);
  return length;
}

/// The same of a joint's angle and kMaxAngle.
inline double checked_angle(const Settings& where, double angle) {
  if (const std::string problem = angle_problem(angle); !problem.empty()) where.fail(problem);
  return angle;
}

/// Where the number `i` of a list stands: its own place, or that of the whole if it is written as a text.
inline Settings item_place(const Settings& list, std::size_t i) {
  const std::vector<Settings> items = list.items();
  return list.is_list() && i < items.size() ? items[i] : list;
}

/// A list of `n` lengths or coordinates, none beyond kMaxLength.
inline std::vector<double> checked_lengths(const Settings& list, int n) {
  const std::vector<double> out = list.numbers(n, Quantity::length);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (!length_problem(out[i]).empty()) checked_length(item_place(list, i), out[i]);
  }
  return out;
}

}  // namespace graze
