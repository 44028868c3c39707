#pragma once
// A first controller of one's own: source, scenario, robot and, where it is compiled,
// Makefile and headers, ready to be judged.

#include <filesystem>
#include <string>
#include <vector>

namespace graze {

/// "policy-c", "policy-cpp", "policy-python".
const std::vector<std::string>& controller_templates();

/// Writes one of them into a folder that is not there yet, or empty. `data`: the program's own (data_folder()). Throws
/// InputError, MachineError.
void write_controller_template(const std::string& name, const std::filesystem::path& folder,
                               const std::filesystem::path& data);

}  // namespace graze
