#pragma once
// Numbers in the tables that kernels read. A table is a template on Number: `double` where all lanes share it, as they
// share the nominal model; `LaneNumber` where each lane has its own, as robots of several designs do.

#include <cstddef>

#include "engine/lanes/pack.h"

namespace graze {

/// Lanes of a table: those of a block (kLanes), whose header is not for kernels.
inline constexpr int kTableLanes = 8;

/// A number of each lane.
struct alignas(64) LaneNumber {
  double lane[kTableLanes];
};

/// Puts one lane's numbers, or arrays of them, into a table.
inline void set_lane(int lane, double from, LaneNumber& to) { to.lane[lane] = from; }
template <std::size_t N, class From, class To>
inline void set_lane(int lane, const From (&from)[N], To (&to)[N]) {
  for (std::size_t i = 0; i < N; ++i) set_lane(lane, from[i], to[i]);
}

inline namespace GRAZE_ISA_NAMESPACE {

/// A table's number for arithmetic with others of its table: a double stays one, so that what all lanes share is
/// computed once. Rounds alike either way.
template <class T>
inline double value_of(double number) {
  return number;
}
template <class T>
inline T value_of(const LaneNumber& number) {
  return load<T>(number.lane);
}
template <class T, class Number>
using ValueOf = decltype(value_of<T>(Number{}));

/// The same, for all lanes.
template <class T, class Number>
inline T lanes_of(const Number& number) {
  return T(value_of<T>(number));
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
