#pragma once
// A first folder of one's own: a scenario with its robot, or a controller with a scenario that judges it, ready to run.

#include <filesystem>
#include <string>
#include <vector>

namespace graze {

/// What write_first_folder() can write: "quadruped", "arm", "policy-c", "policy-cpp", "policy-python".
const std::vector<std::string>& first_folders();

/// Whether one of them is a controller ("policy-…"), whose scenario runs with --trust alone.
bool is_first_controller(const std::string& name);

/// Writes one of them into a folder that is not there yet, or empty: scenario.yaml, the robot that it names, and of a
/// controller its source and, where it is compiled, Makefile and headers. `data`: the program's own (data_folder()).
/// Where it cannot write all, it leaves nothing. Throws InputError, MachineError.
void write_first_folder(const std::string& name, const std::filesystem::path& folder,
                        const std::filesystem::path& data);

}  // namespace graze
