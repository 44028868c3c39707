#pragma once
// Traces as bytes, for another process of the same program on the same machine.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "simulation/trace.h"

namespace graze {

std::string bytes_of(const std::vector<TraceRecord>& records);
/// What bytes_of() has written, of these particles in this order. Throws std::runtime_error if it is something else:
/// the process may have been spoilt.
std::vector<TraceRecord> records_of(std::string_view bytes, const std::vector<std::uint32_t>& particles);

}  // namespace graze
