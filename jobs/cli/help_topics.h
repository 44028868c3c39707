#pragma once
// `graze help TOPIC`: lists of what comes with the program, each component by its name, and the schema of a scenario.

#include <optional>
#include <string>
#include <vector>

namespace graze {

/// The topics, beside the verbs.
std::vector<std::string> help_topics();
/// What else is a topic: the components by name, and the singular of their kinds.
std::vector<std::string> component_topics();

/// What is told of a topic, of all components of that name; nothing if it is none.
std::optional<std::string> help_on(const std::string& topic);

}  // namespace graze
