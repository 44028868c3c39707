#pragma once
// `graze help TOPIC`: lists of what comes with the program, each component by its name, and the schema of a scenario.

#include <optional>
#include <string>
#include <vector>

#include "jobs/cli/wrapped_text.h"

namespace graze {

/// The topics, beside the verbs.
std::vector<std::string> help_topics();
/// What else is a topic: the components by name, the singular of their kinds, shipped scenarios, keys of a scenario.
std::vector<std::string> component_topics();

/// What is told of a topic, of all components of that name, in lines of at most `width` characters; nothing if it is
/// none.
std::optional<std::string> help_on(const std::string& topic, std::size_t width = kUnlimited);

}  // namespace graze
