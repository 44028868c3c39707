#pragma once
// Parts in tasks: globs of collision shapes' or links' names, or of one shape's features ("curb.side"), and contacts
// between two of them.

#include <algorithm>
#include <string>
#include <vector>

#include "engine/clearance/clearance.h"
#include "engine/physics.h"
#include "engine/settings/settings.h"
#include "scenarios/task.h"

namespace graze {

/// Contacts between two sets of parts.
struct Between {
  Parts first, second;
  std::string text;  // "*_FOOT and curb.side"
  int pairs = 0;     // of colliders that may touch

  /// What a witness of them reports as parts, and the number of one (PartKind::pair).
  PartKind parts() const { return pairs > 1 ? PartKind::pair : PartKind::none; }
  double part_of(int a, int b) const {
    return static_cast<double>(std::min(a, b)) * static_cast<double>(first.features.size()) + std::max(a, b);
  }
  double part_of(const ContactPoint& point) const { return part_of(point.a, point.b); }

  /// Lanes in which the point is one of them.
  unsigned operator()(const ContactPoint& point) const;
  /// Those of them in which its collider `a` is of the first set; in the others `b` is.
  unsigned first_is_a(const ContactPoint& point) const;
};

/// `[a, b]`; refused if no pair of colliders that may touch is meant, because then nothing could ever change it.
Between read_between(const Settings& settings, const Model& nominal);

}  // namespace graze
