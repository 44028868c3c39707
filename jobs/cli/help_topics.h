#pragma once
// `graze help TOPIC`: lists of what comes with the program.

#include <optional>
#include <string>
#include <vector>

namespace graze {

/// The topics, beside the verbs.
const std::vector<std::string>& help_topics();

/// What is told of a topic; nothing if it is none.
std::optional<std::string> help_on(const std::string& topic);

}  // namespace graze
