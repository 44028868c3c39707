#pragma once
// Code that is compiled once per instruction set stands in `namespace graze { inline namespace GRAZE_ISA_NAMESPACE {`,
// so that its builds do not clash in one binary. It includes neither Eigen nor standard containers: the linker may keep
// any one copy of an inline function, and a copy made of AVX-512 instructions must not reach the rest of the program.

#if defined(GRAZE_ISA_AVX512)
#define GRAZE_ISA_NAMESPACE avx512
#define GRAZE_FIND_KERNEL find_kernel_avx512
#elif defined(GRAZE_ISA_AVX2)
#define GRAZE_ISA_NAMESPACE avx2
#define GRAZE_FIND_KERNEL find_kernel_avx2
#else
#define GRAZE_ISA_NAMESPACE portable
#define GRAZE_FIND_KERNEL find_kernel_portable
#endif
