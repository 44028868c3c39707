#pragma once
// The seam between the sensors (compiled once) and their kernels (philox.h, quantile.h, reading.h; compiled once per
// instruction set): tables of integers and pointers to rows of kLanes doubles.

#include <cstdint>

namespace graze {

/// Channels are drawn in this order: kinds one after the other.
enum NoiseKind : int { kNormalNoise, kTruncatedNoise, kUniformNoise, kRawNoise, kNoiseKinds };

/// A noise channel.
struct NoiseChannel {
  std::uint32_t word[3];   // what seed and name contribute to Philox's words after two rounds; see philox.h
  int row;                 // of the results
  double a, b, c, d;       // Distribution's parameters
  double low, high, span;  // of a truncated normal
};

struct NoiseView {
  std::uint64_t seed;
  const NoiseChannel* channels;
  int end[kNoiseKinds];  // channels [end[kind - 1], end[kind]) are of that kind
};

/// One draw of all channels: out = mean + quantile in the active lanes. Raw channels: raw = uniform, in the order of
/// the channels, all lanes.
struct NoiseDraw {
  const std::uint32_t *particle, *step;  // per lane
  unsigned active;
  const double* mean;
  double *out, *raw;
};

/// Reads out(group, row) = source row + error row, in the active lanes.
struct Reading {
  int source, source_row;  // index into ReadingView::source
  int error_row;
  int group, row;  // index into ReadingView::out
};

/// A share of the force on a link.
struct LinkForce {
  const double* impulse;  // N s, one row
  unsigned lanes;
  int frame;
};

struct ReadingView {
  unsigned active;
  const double* const* source;
  const double* error;
  double* const* out;
  int reading_count;
  const Reading* readings;
  const double* quaternion;  // 4 rows w, x, y, z, or null: attitude is not read
  const double* rpy_error;   // 3 rows
  double* rpy;               // 3 rows
  int frame_count;           // 0: forces are not read
  double* link_force;        // frame_count rows
  int force_count;
  const LinkForce* forces;  // added in this order
  double h;                 // s, over which the impulses acted
};

/// The functions of one instruction set, for kLanes lanes.
struct SensingKernel {
  void (*draw)(const NoiseView& noise, const NoiseDraw& draw);
  void (*read)(const ReadingView& view);
};

const SensingKernel* find_sensing_kernel_portable();
const SensingKernel* find_sensing_kernel_avx2();
const SensingKernel* find_sensing_kernel_avx512();

}  // namespace graze
