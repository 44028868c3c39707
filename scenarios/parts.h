#pragma once
// Parts in tasks: globs of collision shapes' or links' names, or of one shape's features ("curb.side"), and contacts
// between two of them.

#include <string>
#include <vector>

#include "engine/clearance/clearance.h"
#include "engine/physics.h"
#include "engine/settings/settings.h"

namespace graze {

/// Contacts between two sets of parts.
struct Between {
  Parts first, second;
  std::string text;  // "*_FOOT and curb.side"

  /// Lanes in which the point is one of them.
  unsigned operator()(const ContactPoint& point) const;
};

/// `[a, b]`; refused if no pair of colliders that may touch is meant, because then nothing could ever change it.
Between read_between(const Settings& settings, const Model& nominal);

}  // namespace graze
