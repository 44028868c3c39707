#pragma once
// A dictionary that is larger than memory: texts wait on disk until their number is known, memory holds a hash of each.

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <utility>

#include "archive/files/files.h"
#include "archive/hdf5/hdf5.h"

namespace graze {

class TextSpool {
 public:
  /// `beside`: the texts wait in a nameless file beside this one. Throws MachineError.
  explicit TextSpool(const std::filesystem::path& beside);

  /// Numbers texts in order of first appearance.
  std::uint32_t number(const std::string& text);
  /// Writes all texts as one dataset.
  void write(const hdf5::Handle& file, const char* dataset);

 private:
  using Key = std::pair<std::uint64_t, std::uint64_t>;  // two hashes: 128 bits are not met twice by chance
  struct KeyHash {
    std::size_t operator()(const Key& key) const { return key.first; }
  };
  void flush();

  std::filesystem::path path_;
  Descriptor file_;
  std::string pending_;                                      // [length, bytes]…, not in the file yet
  std::unordered_map<Key, std::uint32_t, KeyHash> numbers_;  // only looked up, never walked through
};

}  // namespace graze
