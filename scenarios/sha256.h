#pragma once
// What tells two texts apart: of scenarios, and of files that must stay as they were written.

#include <string>

namespace graze {

/// 64 hexadecimal digits. Throws std::runtime_error if OpenSSL does not have the algorithm.
std::string sha256_of(const std::string& text);

}  // namespace graze
