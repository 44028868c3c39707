#pragma once
// Traces as bytes, for another process of the same program on the same machine.

#include <string>
#include <string_view>
#include <vector>

#include "simulation/trace.h"

namespace graze {

std::string bytes_of(const std::vector<TraceRecord>& records);
/// What bytes_of() has written. Throws MachineError if it is something else.
std::vector<TraceRecord> records_of(std::string_view bytes);

}  // namespace graze
