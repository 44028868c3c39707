#pragma once
// Plain words of a task's judgement, which archives keep: when a witness counts, and whom its margin names.

#include <cstddef>
#include <cstdint>
#include <limits>

namespace graze {

/// When traces are looked at: at 0, step, 2 step, … end. A step of 0 stands for any time at all.
struct TraceTimes {
  double step = 0;                                       // s
  double end = std::numeric_limits<double>::infinity();  // s
};

/// When a witness counts.
struct Window {
  double from = 0;                                      // s
  double to = std::numeric_limits<double>::infinity();  // s
  bool contains(double t) const { return t >= from && t <= to; }
  /// Whether it contains a time at which traces are looked at.
  bool opens(const TraceTimes& times) const;
};

/// What the parts of a witness are numbers of. none: the witness is about one part, which needs no telling.
enum class PartKind : std::uint8_t {
  none,
  link,   // index into Model::frames
  joint,  // index into Model::actuated
  pair    // a * Model::colliders.size() + b, two colliders, a < b
};
inline constexpr int kNoPart = -1;

/// The share of its steps in which a trace's contacts may fail to converge before it is flagged, where a scenario does
/// not say (contact.unconverged). docs/physics.md has what robots give.
inline constexpr double kUnconvergedShare = 0.05;

/// The culprit of a margin.
struct Culprit {
  int leaf = -1;  // of an objective: index into leaves(); -1: it has none
  int part = kNoPart;
};

/// Bits of a mask (TraceOutcome::kept).
inline constexpr std::size_t kMostMeasures = 64;

}  // namespace graze
