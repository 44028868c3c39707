#pragma once
// What the custom mutators share: now and then bytes, mostly structure.

#include <algorithm>
#include <cstring>
#include <string>

#include "tests/fuzz/dice.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace graze::fuzz {

/// libFuzzer's own mutants of bytes.
inline std::string mutated_bytes(std::string text, std::size_t most) {
  const std::size_t size = text.size();
  text.resize(std::max(size, most));
  text.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(text.data()), size, text.size()));
  return text;
}

/// Puts a mutant where libFuzzer wants it; one that is too long becomes one of bytes.
inline std::size_t put(const std::string& mutant, std::uint8_t* data, std::size_t size, std::size_t most) {
  if (mutant.empty() || mutant.size() > most) return LLVMFuzzerMutate(data, size, most);
  std::memcpy(data, mutant.data(), mutant.size());
  return mutant.size();
}

}  // namespace graze::fuzz
