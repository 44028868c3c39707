#pragma once
// Whether the tests run under a sanitizer. That makes them five to twenty times slower, and it is there for the memory
// that they touch, not for their figures: random trials may be fewer.

#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define GRAZE_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define GRAZE_SANITIZED 1
#endif
#endif
#ifndef GRAZE_SANITIZED
#define GRAZE_SANITIZED 0
#endif

namespace graze::test {

/// How many random trials to make of `all`: a tenth under a sanitizer.
constexpr int trials(int all) { return GRAZE_SANITIZED != 0 ? (all + 9) / 10 : all; }

/// Whether the `i`th of many cases that run the same code is tried: each, but one of `stride` under a sanitizer.
constexpr bool tried(std::size_t i, std::size_t stride) { return GRAZE_SANITIZED == 0 || i % stride == 0; }

}  // namespace graze::test
