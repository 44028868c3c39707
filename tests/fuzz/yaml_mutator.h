#pragma once
// Mutants of scenarios that are YAML still, and mostly scenarios: keys, values, units and subtrees of trees are
// changed, moved, or taken from other scenarios, where bytes at random would only ever try the parser.

#include <string>

#include "tests/fuzz/dice.h"

namespace graze::fuzz {

/// A mutant of `text`; the text itself if it is no YAML.
std::string mutated_yaml(const std::string& text, Dice& dice);

}  // namespace graze::fuzz
