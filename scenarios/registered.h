#pragma once
// Components by name: those that come with the program, in the order in which they are told, and behind them those that
// a program of its own adds before main.

#include <cassert>
#include <string>
#include <vector>

#include "engine/settings/registry.h"

namespace graze {

/// Kind: WitnessKind, DistributionKind, ShapeForm. No two have one name.
template <class Kind>
struct Registration {
  explicit Registration(const Kind& kind) { enter(kind.name, kind); }
};

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

/// `own`, and behind them those that were registered, whose names are others.
template <class Kind>
std::vector<Kind> with_registered(std::vector<Kind> own) {
  for (const auto& [name, kind] : registry<Kind>()) {
    assert(kind_of(own, name) == nullptr && "a component of a built-in one's name");
    own.push_back(kind);
  }
  return own;
}

}  // namespace graze
