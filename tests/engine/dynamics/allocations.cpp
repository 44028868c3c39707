// A file of its own: the compiler must not see how memory is taken where it sees how it is given back.
#include "tests/engine/dynamics/allocations.h"

#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/sanitized.h"

namespace {
std::atomic<long> count = 0;
}  // namespace

long graze::testing::allocations() { return count; }

#if !GRAZE_SANITIZED
void* operator new(std::size_t size) {
  ++count;
  if (void* p = std::malloc(size > 0 ? size : 1)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#endif
