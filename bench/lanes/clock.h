#pragma once
// Processor time of this thread, s: what others do on the machine does not count.

#include <time.h>

namespace graze::bench {

inline double now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Seconds per call of `work`, which is called in batches until `seconds` have passed.
template <class Work>
double time_of(double seconds, int batch, Work work) {
  long calls = 0;
  const double begin = now();
  double elapsed = 0;
  while (elapsed < seconds) {
    for (int i = 0; i < batch; ++i) work();
    calls += batch;
    elapsed = now() - begin;
  }
  return elapsed / static_cast<double>(calls);
}

}  // namespace graze::bench
