#pragma once
// Which instruction set the lane kernels use: the best that the machine has, or what GRAZE_ISA says. All give the same
// bits; only speed differs.

#include <string>
#include <vector>

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

/// The build of `find` for an instruction set: GRAZE_KERNEL(chosen_isa(), find_lane_kernel, 8) calls
/// find_lane_kernel_avx512(8). All builds must be declared.
#if defined(GRAZE_X86_KERNELS)
#define GRAZE_KERNEL(isa, find, ...)                          \
  ((isa) == ::graze::Isa::avx512 ? find##_avx512(__VA_ARGS__) \
   : (isa) == ::graze::Isa::avx2 ? find##_avx2(__VA_ARGS__)   \
                                 : find##_portable(__VA_ARGS__))
#else
#define GRAZE_KERNEL(isa, find, ...) find##_portable(__VA_ARGS__)
#endif

}  // namespace graze
