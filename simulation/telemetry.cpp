#include "simulation/telemetry.h"

#include <algorithm>
#include <utility>

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
  const auto nq = static_cast<std::size_t>(source.q.rows()), nv = static_cast<std::size_t>(source.v.rows()),
             na = static_cast<std::size_t>(source.tau.rows());
  row_.resize(nq + nv + na);
  double* const q = row_.data();
  double* const v = copy(source.q, lane, q);
  double* const tau = copy(source.v, lane, v);
  copy(source.tau, lane, tau);
  if (capacity_ > 0 && l.count >= capacity_) {
    l.frames.set(l.count % capacity_, step * step_, {q, nq}, {v, nv}, {tau, na});
  } else {
    if (l.frames.empty()) l.frames.reserve(longest_, nq, nv, na);
    l.frames.add(step * step_, {q, nq}, {v, nv}, {tau, na});
  }
  ++l.count;
}

void TelemetryRecorder::carry(int lane, LaneTape& tape) {
  Lane& l = lanes_[lane];
  tape.same(static_cast<int>(recording_.telemetry)), tape.same(recording_.every);
  tape.same(static_cast<int>(capacity_));  // where the ring goes on depends on it
  tape.carry(l.count), tape.carry(l.frozen);
  std::vector<double> time = l.frames.time(), q = l.frames.q(), v = l.frames.v(), tau = l.frames.tau();
  for (std::vector<double>* column : {&time, &q, &v, &tau}) tape.carry(*column);
  if (!tape.reads()) return;
  l.frames.clear();
  const std::size_t frames = time.size();
  const auto row = [&](const std::vector<double>& column, std::size_t i) {
    const std::size_t width = column.size() / frames;
    return std::span(column).subspan(i * width, width);
  };
  for (std::size_t i = 0; i < frames; ++i) l.frames.add(time[i], row(q, i), row(v, i), row(tau, i));
}

FrameLog TelemetryRecorder::hand_over(int lane, bool failed) {
  Lane& l = lanes_[lane];
  if (!failed && recording_.telemetry != Telemetry::all) return {};
  longest_ = std::max(longest_, l.frames.size());
  if (capacity_ == 0) return std::exchange(l.frames, {});
  FrameLog out;
  const std::uint64_t oldest = l.count > capacity_ ? l.count - capacity_ : 0;
  for (std::uint64_t i = oldest; i < l.count; ++i) {
    const TelemetryFrame frame = l.frames[i % capacity_];
    const double begin = l.frames.time()[(l.count - 1) % capacity_] - recording_.last - step_ / 2;
    if (frame.time >= begin) out.add(frame);
  }
  return out;
}

}  // namespace graze
