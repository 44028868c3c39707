#pragma once
// Modules of the program, which it loads when it needs them.

#include <filesystem>

namespace graze {

/// Where the module of that name is: beside the program, or where it is installed.
std::filesystem::path program_module(const char* name);

}  // namespace graze
