#pragma once
// What `graze doctor` finds: one line of its table each.

#include <string>
#include <utility>
#include <vector>

namespace graze {

/// note: a campaign runs all the same, and the user should know. broken: one does not.
enum class Health { good, note, broken };

struct Finding {
  std::string group, name;  // "machine", "processors"
  Health health = Health::good;
  std::string text;         // what was found
  std::string advice = {};  // how to get what is missing; empty: nothing is
  /// The same as numbers, for --json: name (with its unit) and value.
  std::vector<std::pair<std::string, double>> numbers = {};
};

}  // namespace graze
