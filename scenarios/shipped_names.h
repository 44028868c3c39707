#pragma once
// Names of scenarios that come with Graze.

#include <filesystem>
#include <optional>
#include <string>

namespace graze {

/// The scenario of a name ("pendulum", "pendulum.yaml") in the folder `scenarios` of a data folder; nothing: there is
/// none, there is no such folder, or it is no name but a path.
std::optional<std::string> scenario_in(const std::filesystem::path& data, const std::string& name);

}  // namespace graze
