#pragma once
// Random choices of the mutators, from the seed that libFuzzer gives: the same seed makes the same mutant.

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace graze::fuzz {

class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}

  /// 0 … n - 1; 0 for n = 0.
  std::size_t below(std::size_t n) { return n == 0 ? 0 : engine_() % n; }
  bool one_in(std::size_t n) { return below(n) == 0; }
  template <typename T>
  const T& of(const std::vector<T>& items) {
    return items[below(items.size())];
  }

 private:
  std::mt19937 engine_;
};

}  // namespace graze::fuzz
