#include "jobs/telemetry.h"

#include <algorithm>

namespace graze {
namespace {

double* copy(const BlockArray& array, int lane, double* to) {
  for (int i = 0; i < array.rows(); ++i) *to++ = array(i, lane);
  return to;
}

}  // namespace

TelemetryRecorder::TelemetryRecorder(const Recording& recording, double step) : recording_(recording), step_(step) {
  if (recording.telemetry != Telemetry::last) return;
  // Frames at both ends of the interval, and the one of the failure itself, which need not be due.
  constexpr double kMost = 1e9;
  capacity_ = static_cast<std::uint64_t>(std::min(kMost, recording.last / (step * recording.every) + 1e-9)) + 2;
}

void TelemetryRecorder::start(int lane) {
  lanes_[lane].frames.clear();
  lanes_[lane].count = 0;
  lanes_[lane].frozen = false;
}

void TelemetryRecorder::take(int lane, std::uint32_t step, bool ended, bool failed, const FrameSource& source) {
  Lane& l = lanes_[lane];
  if (l.frozen) return;
  l.frozen = failed && recording_.telemetry == Telemetry::last;
  if (!ended && !l.frozen && step % static_cast<std::uint32_t>(recording_.every) != 0) return;
  nq_ = static_cast<std::size_t>(source.q.rows());
  nv_ = static_cast<std::size_t>(source.v.rows());
  na_ = static_cast<std::size_t>(source.tau.rows());
  const std::size_t width = 1 + nq_ + nv_ + na_;
  const std::uint64_t place = capacity_ > 0 ? l.count % capacity_ : l.count;
  if (l.frames.size() < (place + 1) * width) l.frames.resize((place + 1) * width);
  double* to = l.frames.data() + place * width;
  *to++ = step * step_;
  to = copy(source.q, lane, to);
  to = copy(source.v, lane, to);
  copy(source.tau, lane, to);
  ++l.count;
}

FrameLog TelemetryRecorder::hand_over(int lane, bool failed) {
  Lane& l = lanes_[lane];
  FrameLog out;
  if (!failed && recording_.telemetry != Telemetry::all) return out;
  const std::size_t width = 1 + nq_ + nv_ + na_;
  std::uint64_t first = capacity_ > 0 && l.count > capacity_ ? l.count - capacity_ : 0;
  const auto frame = [&](std::uint64_t i) { return l.frames.data() + (capacity_ > 0 ? i % capacity_ : i) * width; };
  if (capacity_ > 0 && l.count > 0) {
    const double begin = frame(l.count - 1)[0] - recording_.last - step_ / 2;
    while (frame(first)[0] < begin) ++first;
  }
  out.reserve(l.count - first, nq_, nv_, na_);
  for (std::uint64_t i = first; i < l.count; ++i) {
    const double* row = frame(i);
    out.add(row[0], {row + 1, nq_}, {row + 1 + nq_, nv_}, {row + 1 + nq_ + nv_, na_});
  }
  return out;
}

}  // namespace graze
