#pragma once
// Which instruction set the lane kernels use: the best that the machine has, or what GRAZE_ISA says. All give the same
// bits; only speed differs.

#include <string>
#include <vector>

#include "engine/lane_physics/kernel.h"

namespace graze {

enum class Isa { portable, avx2, avx512 };

std::string isa_name(Isa isa);  // "avx512", "avx2", "portable"

/// Those that this program was built with and this machine can run, slowest first.
std::vector<Isa> available_isas();

/// The one in use: the fastest available, or that of the environment variable GRAZE_ISA. Throws InputError if the
/// variable names none of the available ones.
Isa chosen_isa();

/// One line for `graze --version`: "lanes: 8 x double, avx512 (available: portable, avx2, avx512)".
std::string isa_report();

/// The kernel of an available instruction set. `lanes`: 8; for comparison also 1, and 4 with avx2.
const LaneKernel& kernel_of(Isa isa, int lanes = 8);

}  // namespace graze
