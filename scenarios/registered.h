#pragma once
// Components by name: those that come with the program, in the order in which they are told, and behind them those that
// a program of its own adds before main.

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace graze {

/// Sorted by name, so that lists do not depend on link order. Kind: WitnessKind, DistributionKind, ShapeForm.
template <class Kind>
std::map<std::string, Kind>& registered() {
  static std::map<std::string, Kind> kinds;
  return kinds;
}

template <class Kind>
struct Registration {
  explicit Registration(const Kind& kind) { registered<Kind>().insert_or_assign(kind.name, kind); }
};

template <class Kind>
std::vector<Kind> with_registered(std::vector<Kind> own) {
  for (const auto& [name, kind] : registered<Kind>()) own.push_back(kind);
  return own;
}

template <class Kind>
std::vector<std::string> names_of(const std::vector<Kind>& kinds) {
  std::vector<std::string> out;
  for (const Kind& kind : kinds) out.push_back(kind.name);
  return out;
}

/// Nothing if there is none of that name.
template <class Kind>
const Kind* kind_of(const std::vector<Kind>& kinds, const std::string& name) {
  for (const Kind& kind : kinds) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

}  // namespace graze
