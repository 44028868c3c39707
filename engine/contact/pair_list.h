#pragma once
// A list of what is known of pairs of colliders, kept in their order so that walks over it are the same in every run.

#include <algorithm>
#include <utility>
#include <vector>

namespace graze {

/// The entry of the pair (a, b) in a list that is sorted by its entries' `a`, then `b`; a fresh one, put in its place,
/// if there is none. Others move when one is put in: references to entries do not outlive the call.
template <class Entry>
Entry& entry_of_pair(std::vector<Entry>& sorted, int a, int b) {
  const auto before = [](const Entry& x, const std::pair<int, int>& y) { return std::pair(x.a, x.b) < y; };
  const auto place = std::lower_bound(sorted.begin(), sorted.end(), std::pair(a, b), before);
  if (place != sorted.end() && place->a == a && place->b == b) return *place;
  Entry fresh{};
  fresh.a = a;
  fresh.b = b;
  return *sorted.insert(place, fresh);
}

}  // namespace graze
