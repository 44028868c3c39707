#pragma once
// Starting a process that may be killed from outside before it is ready.

#include <chrono>
#include <thread>

#include "engine/library/library_use.h"

namespace graze {

/// What `start` gives. Somebody may kill a process before it is ready, such as a system without memory, which `start`
/// throws as a Lost: it gets more chances, but for one that has not answered in its time.
template <typename Lost, typename Start>
auto with_chances(Start start) {
  constexpr int kChances = 3;
  for (int chance = 1;; ++chance) {
    try {
      return start();
    } catch (const Lost& lost) {
      if (chance == kChances || dynamic_cast<const CallTimedOut*>(&lost)) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100 * chance));
  }
}

}  // namespace graze
