// pthread_create in place of the C library's: from one thread on the system has none left, as for a user who has as
// many as `ulimit -u` lets be.
#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>

#include "tests/faults/board.h"

using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);

extern "C" int pthread_create(pthread_t* id, const pthread_attr_t* attributes, void* (*begin)(void*), void* argument) {
  using graze::faults::board;
  if (board != nullptr) {
    const long number = ++board->threads;
    if (board->thread != 0 && number >= board->thread) return EAGAIN;
  }
  static const auto create = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
  return create(id, attributes, begin, argument);
}
