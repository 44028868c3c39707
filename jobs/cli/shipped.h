#pragma once
// Scenarios that come with the program can be called by their names alone, wherever it is installed.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace graze {

/// The folder of robots and scenarios that belongs to this program: $GRAZE_DATA; share/graze beside the folder that it
/// is installed in; data/ of the source tree that it was built in. Empty: there is none.
std::filesystem::path data_folder();

/// The folder of the documentation that belongs to this program: share/doc/graze beside the folder that it is installed
/// in; docs/ of the source tree that it was built in. Empty: there is none.
std::filesystem::path docs_folder();

/// Names of its scenarios, without ".yaml", sorted.
std::vector<std::string> shipped_scenarios();

/// The shipped scenario of a name ("pendulum", "pendulum.yaml"); nothing: there is none, or it is no name but a path.
std::optional<std::string> shipped_scenario(const std::string& name);

/// What is meant by a scenario's file as given: the file itself if it is there, is "-" or names a folder; else the
/// shipped scenario of that name ("pendulum", "pendulum.yaml"), if there is one; else the file, which is missing.
/// Throws InputError with the nearest shipped scenario if no file here is near the name.
std::string scenario_file(const std::string& given);

/// Whether a name ends as a robot's does: .urdf or .xacro.
bool is_robot_file(const std::string& name);
/// "box.yaml" of "robots/box.urdf": what a first scenario of a robot may be called.
std::string scenario_of_robot(const std::string& robot);
/// Throws InputError if a robot is there where a scenario is meant, with the command that writes one.
void refuse_robot_file(const std::string& given);

}  // namespace graze
