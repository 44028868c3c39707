#pragma once
// Which part of contacts' impulses a witness counts: the normal one, or the component along a direction of the world.

#include <optional>
#include <string>

#include "engine/settings/description.h"
#include "scenarios/parts.h"

namespace graze {

/// The part of an impulse that counts.
class ImpulsePart {
 public:
  /// Of the key `direction` of a witness; refused if it has no length.
  explicit ImpulsePart(const Described& own);

  /// Of a point's impulse over the last step, N s. Normal: >= 0. Along a direction: that on the first-named part,
  /// signed. `first_is_a`: lanes of Between::first_is_a().
  double operator()(const ContactPoint& point, unsigned first_is_a, int lane) const {
    if (!along_) return point(kNormalImpulse, lane);
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += point(static_cast<ContactRow>(kImpulse + i), lane) * (*along_)[i];
    return first_is_a >> lane & 1u ? sum : -sum;
  }

  bool is_normal() const { return !along_; }
  /// " along (0, 1, 0)", or nothing.
  const std::string& text() const { return text_; }

  static Key key();

 private:
  std::optional<Vec3> along_;  // unit, world
  std::string text_;
};

}  // namespace graze
