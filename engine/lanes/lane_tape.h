#pragma once
// What a lane keeps from step to step, written down and read back by one and the same walk over its parts (`carry`
// functions), so that what is written and what is read cannot differ.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/lanes/block.h"

namespace graze {

class LaneTape {
 public:
  using Content = std::vector<std::byte>;

  /// Writes.
  LaneTape() = default;
  /// Reads what was written, which outlives this.
  explicit LaneTape(const Content& written) : source_(&written) {}

  bool reads() const { return source_ != nullptr; }

  /// Writes or reads a number. Throws std::invalid_argument, here and below, when what is read was not written by this
  /// walk over parts of these sizes.
  template <class T>
  void carry(T& x) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    bytes(&x, sizeof x);
  }
  /// Column `lane` of the rows.
  void carry(BlockArray& rows, int lane) {
    same(rows.rows());
    for (int i = 0; i < rows.rows(); ++i) carry(rows(i, lane));
  }
  template <class T>
  void carry(std::vector<T>& items) {
    std::uint64_t count = items.size();
    carry(count);
    if (reads()) {
      if (count > source_->size() - at_) refuse();
      items.resize(count);
    }
    for (T& item : items) carry(item);
  }

  /// Must be read back as it was written: a size, or the name of what comes next.
  void same(int number) {
    int carried = number;
    carry(carried);
    if (carried != number) refuse();
  }
  void same(std::string_view name) {
    same(static_cast<int>(name.size()));
    for (const char c : name) same(static_cast<int>(c));
  }

  /// What was written.
  Content take() { return std::move(written_); }
  /// All has been read.
  void end() const {
    if (reads() && at_ != source_->size()) refuse();
  }

 private:
  [[noreturn]] static void refuse() {
    throw std::invalid_argument(
        "what was saved of the trace does not fit here: another policy, task or record saved it");
  }
  void bytes(void* x, std::size_t size) {
    if (!reads()) {
      const auto* from = static_cast<const std::byte*>(x);
      written_.insert(written_.end(), from, from + size);
      return;
    }
    if (size > source_->size() - at_) refuse();
    std::memcpy(x, source_->data() + at_, size);
    at_ += size;
  }

  const Content* source_ = nullptr;
  std::size_t at_ = 0;
  Content written_;
};

}  // namespace graze
