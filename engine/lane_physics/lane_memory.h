#pragma once
// Memory for rows of lanes, which vector registers read whole.

#include <cstddef>
#include <memory>

namespace graze {

/// Zero-filled memory on cache lines.
class LaneMemory {
 public:
  void grow(std::size_t doubles);  // contents are lost
  double* data() const { return data_.get(); }
  std::size_t size() const { return size_; }

 private:
  struct Free {
    void operator()(double* p) const;
  };

  std::unique_ptr<double, Free> data_;
  std::size_t size_ = 0;
};

}  // namespace graze
