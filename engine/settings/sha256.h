#pragma once
// What tells two texts or files apart: scenarios, controllers of the user's own, and what must stay as it was written.

#include <optional>
#include <string>

namespace graze {

/// 64 hexadecimal digits. Throws std::runtime_error if OpenSSL does not have the algorithm.
std::string sha256_of(const std::string& text);

/// Of a regular file; nothing if it cannot be read.
std::optional<std::string> sha256_of_file(const std::string& file);

}  // namespace graze
