#pragma once
// `graze help` on what is written in a scenario file: a key, a path to one, a word that is a key's value, a map whose
// keys are names that the author gives.

#include <optional>
#include <string>
#include <vector>

namespace graze {

/// On `environment`, `uncertain`, `over`, `include`, `requirements`, `measures`, `units`; nothing for others.
std::optional<std::string> map_help(const std::string& topic, std::size_t width);

/// On a key ("step_height": of all that have it), a path that ends in one ("time.step", "policies.walk.gait.velocity")
/// or the path of a parameter, and on a word that is the value of a key ("sobol"). Nothing if it is none.
std::optional<std::string> key_help(const std::string& topic, std::size_t width);

/// The topics of both: names of keys, their paths, words, maps.
std::vector<std::string> key_topics();

}  // namespace graze
