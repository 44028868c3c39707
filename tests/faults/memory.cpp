// malloc in place of the C library's: one allocation, or all from one on, find no memory. operator new and the
// libraries in C take theirs from here. Not with a sanitizer, which has an allocator of its own.
#include <execinfo.h>

#include <array>
#include <cerrno>
#include <cstdlib>

#include "tests/faults/board.h"
#include "tests/sanitized.h"

#if defined(__GLIBC__) && !GRAZE_SANITIZED
#define GRAZE_OWN_MALLOC 1
#else
#define GRAZE_OWN_MALLOC 0
#endif

namespace graze::faults {

bool can_exhaust_memory() { return GRAZE_OWN_MALLOC != 0; }

namespace {

thread_local bool inside = false;

/// Notes who asks for memory: a hash of the return addresses.
void note_call_path(long number) {
  if (number > static_cast<long>(Board::kPaths)) return;
  inside = true;
  std::array<void*, 14> frames{};
  const int depth = backtrace(frames.data(), static_cast<int>(frames.size()));
  std::uint64_t hash = 1;
  for (int i = 2; i < depth; ++i) hash = (hash ^ reinterpret_cast<std::uint64_t>(frames[i])) * 0x9e3779b97f4a7c15u;
  board->call_path[number - 1] = hash;
  inside = false;
}

/// Who asked for what is denied, for whoever looks for the cause of a failure (GRAZE_SHOW_FAULTS=1).
void show_call_path() {
  inside = true;
  std::array<void*, 40> frames{};
  backtrace_symbols_fd(frames.data(), backtrace(frames.data(), static_cast<int>(frames.size())), 2);
  inside = false;
}

/// Counts an allocation. True if it shall fail.
[[maybe_unused]] bool exhausted() {
  if (board == nullptr || inside || (!board->note_paths && board->allocation == 0)) return false;
  const long number = ++board->allocations;
  if (board->note_paths) note_call_path(number);
  const long at = board->allocation;
  if (at == 0 || number < at || (number > at && !board->for_good)) return false;
  if (!board->failed.exchange(true) && board->show) show_call_path();
  errno = ENOMEM;
  return true;
}

}  // namespace
}  // namespace graze::faults

#if GRAZE_OWN_MALLOC
extern "C" {

void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);

void* malloc(size_t size) { return graze::faults::exhausted() ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return graze::faults::exhausted() ? nullptr : __libc_calloc(count, size); }
void* realloc(void* old, size_t size) { return graze::faults::exhausted() ? nullptr : __libc_realloc(old, size); }
void* memalign(size_t alignment, size_t size) {
  return graze::faults::exhausted() ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  return graze::faults::exhausted() ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** to, size_t alignment, size_t size) {
  if (graze::faults::exhausted()) return ENOMEM;
  *to = __libc_memalign(alignment, size);
  return *to == nullptr ? ENOMEM : 0;
}

}  // extern "C"
#endif
