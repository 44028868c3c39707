#pragma once
// Independent pieces of an analysis on all processors.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <future>
#include <thread>
#include <vector>

namespace graze {

/// Calls act(0) … act(n - 1), as many at once as there are processors. Throws what one of them threw, when all that had
/// begun have ended; the others are then not begun. `act` of one number must not touch what that of another writes, and
/// nothing here depends on the order in which they run.
template <class Act>
void at_once(std::size_t n, const Act& act) {
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < n; i = next++) act(i);
    } catch (...) {
      next = n;
      throw;
    }
  };
  std::vector<std::future<void>> helpers;
  const std::size_t most = std::min<std::size_t>(n, std::max(1u, std::thread::hardware_concurrency()));
  for (std::size_t i = 1; i < most; ++i) helpers.push_back(std::async(std::launch::async, work));
  work();  // if it throws, the futures still wait for their threads
  for (std::future<void>& helper : helpers) helper.get();
}

}  // namespace graze
