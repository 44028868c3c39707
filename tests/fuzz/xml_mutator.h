#pragma once
// Mutants of URDF files that are XML still: attributes and elements are changed, moved, repeated and left out.

#include <string>

#include "tests/fuzz/dice.h"

namespace graze::fuzz {

/// A mutant of `text`; the text itself if it is no XML.
std::string mutated_xml(const std::string& text, Dice& dice);

}  // namespace graze::fuzz
