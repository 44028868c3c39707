#pragma once
// Elements and attributes of a URDF that no reader asks for, and that look like misspelt ones. Extensions, which look
// like none, pass without a word.

#include <tinyxml2.h>

#include <string>

#include "engine/model/urdf_problems.h"

namespace graze {

/// Warns of each misspelt element and attribute in the links and joints of `robot`, with its line and what was meant;
/// and of a second element where a joint has one, which is ignored.
void check_spelling(const tinyxml2::XMLElement& robot, UrdfProblems& problems);

/// "; did you mean <limit> by <limits> in line 7?" where `parent` lacks its child `tag` and has one that looks like it;
/// else empty.
std::string misspelt_element(const tinyxml2::XMLElement& parent, const std::string& tag);

/// "; did you mean length by lenght="2"?" where `e` lacks the attribute and has one that looks like it; else empty.
std::string misspelt_attribute(const tinyxml2::XMLElement& e, const std::string& attribute);

}  // namespace graze
