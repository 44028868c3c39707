#pragma once

#include <unistd.h>

#include <cstring>

namespace graze {

/// Writes to standard error what a signal handler may: no memory is taken, nothing is buffered.
inline void say_safely(const char* text) {
  if (write(STDERR_FILENO, text, std::strlen(text)) < 0) return;  // nobody listens
}

}  // namespace graze
