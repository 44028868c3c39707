// The kernels of one instruction set; compiled once for each (see CMakeLists.txt).

#include "engine/lane_physics/actuator_rows.h"
#include "engine/lane_physics/gaps.h"
#include "engine/lane_physics/step.h"

namespace graze {

namespace {

template <class T>
constexpr LaneKernel make_kernel() {
  static_assert(sizeof(SweepMemoryT<T>) == kSweepMemory * sizeof(T));
  static_assert(sizeof(MimicRowT<T>) == kMimicRows * sizeof(T));
  constexpr int row = sizeof(T);
  return {kWidth<T>,
          static_cast<int>(sizeof(BodyT<T>)) / row,
          static_cast<int>(sizeof(MotionT<T>)) / row,
          static_cast<int>(sizeof(BalanceT<T>)) / row,
          static_cast<int>(sizeof(ContactLawT<T>)) / row,
          static_cast<int>(sizeof(ContactT<T>) / sizeof(double)),
          static_cast<int>(sizeof(JointRowT<T>) / sizeof(double)),
          &settle<T>,
          &begin<T>,
          &finish<T>,
          &measure_gap<T>,
          &add_moves<T>,
          &add_travel<T>,
          &find_due<T>,
          &place<T>,
          &fill_drive<T>,
          &follow_drive<T>};
}

}  // namespace

const LaneKernel* GRAZE_OF_ISA(find_lane_kernel)(int lanes) {
  static constexpr LaneKernel eight = make_kernel<Pack<8>>(), one = make_kernel<double>();
  if (lanes == 1) return &one;
#if defined(GRAZE_ISA_AVX2)
  static constexpr LaneKernel four = make_kernel<Pack<4>>();
  if (lanes == 4) return &four;
#endif
  return lanes == 8 ? &eight : nullptr;
}

}  // namespace graze
