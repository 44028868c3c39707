#include "engine/lane_physics/lane_memory.h"

#include <algorithm>
#include <new>

namespace graze {

void LaneMemory::Free::operator()(double* p) const { ::operator delete[](p, std::align_val_t(64)); }

void LaneMemory::grow(std::size_t doubles) {
  if (doubles <= size_) return;
  size_ = doubles + doubles / 2;
  data_.reset(static_cast<double*>(::operator new[](size_ * sizeof(double), std::align_val_t(64))));
  std::fill_n(data_.get(), size_, 0.0);
}

}  // namespace graze
