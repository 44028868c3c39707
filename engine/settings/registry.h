#pragma once
// Components by name (policies, trackers, back ends, witnesses, distributions, shapes), which enter themselves before
// main: by the files that define them, and by programs that have some of their own.

#include <cassert>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace graze {

/// Those of one kind, sorted by name, so that lists do not depend on link order. Constant once main has begun.
template <class Entry>
std::map<std::string, Entry>& registry() {
  static std::map<std::string, Entry> entries;
  return entries;
}

/// Of two of one name, which is a mistake of whoever wrote the second, the first stays.
template <class Entry>
void enter(const std::string& name, Entry entry) {
  [[maybe_unused]] const bool fresh = registry<Entry>().emplace(name, std::move(entry)).second;
  assert(fresh && "two components of one name");
}

template <class Entry>
std::vector<std::string> registered_names() {
  std::vector<std::string> names;
  for (const auto& [name, entry] : registry<Entry>()) names.push_back(name);
  return names;
}

}  // namespace graze
