#pragma once
// A number for a sequence of things: equal sequences, equal numbers. For comparing what two parts of the program hold,
// within one run of it; not for archives.

#include <bit>
#include <cstdint>
#include <string_view>

namespace graze {

class RunningDigest {
 public:
  /// Order matters (multiply and fold).
  void add(std::uint64_t word) {
    value_ = (value_ ^ word) * 0x9e3779b97f4a7c15u;
    value_ ^= value_ >> 32;
  }
  void add(int number) { add(static_cast<std::uint64_t>(static_cast<std::int64_t>(number))); }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(std::string_view text) {
    add(static_cast<std::uint64_t>(text.size()));
    for (const char c : text) add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  }
  /// The numbers of a vector or matrix, column by column.
  template <class Matrix>
  void add_all(const Matrix& numbers) {
    for (int k = 0; k < numbers.size(); ++k) add(static_cast<double>(numbers.data()[k]));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace graze
