#pragma once
// Code that is compiled once per instruction set stands in `namespace graze { inline namespace GRAZE_ISA_NAMESPACE {`,
// so that its builds do not clash in one binary. It includes neither Eigen nor standard containers: the linker may keep
// any one copy of an inline function, and a copy made of AVX-512 instructions must not reach the rest of the program.
//
// A room with kernels has a kernel.cpp, which is compiled once per instruction set (CMakeLists.txt, graze_kernels) and
// defines GRAZE_OF_ISA(find_…_kernel); its callers take the build of the instruction set in use by GRAZE_KERNEL
// (isa.h).

#if defined(GRAZE_ISA_AVX512)
#define GRAZE_ISA_NAMESPACE avx512
#define GRAZE_OF_ISA(name) name##_avx512
#elif defined(GRAZE_ISA_AVX2)
#define GRAZE_ISA_NAMESPACE avx2
#define GRAZE_OF_ISA(name) name##_avx2
#else
#define GRAZE_ISA_NAMESPACE portable
#define GRAZE_OF_ISA(name) name##_portable
#endif
