#pragma once
// Text as HDF5 and its readers want it.

#include <string>
#include <string_view>

namespace graze {

/// `text` as valid UTF-8 without NUL: each byte that cannot stand where it stands becomes U+FFFD.
std::string valid_utf8(std::string_view text);

}  // namespace graze
