#pragma once
// How a link or an object changes coherently when its sizes, density or mass do. A link has one *primary* shape: its
// longest cylinder, capsule or box, else its largest sphere (of the collision shapes, or of the visual ones where there
// are none). Its change is an affine map of space near the link; the map moves child joints, fixed children and other
// shapes, and it acts on the second moments of mass, so that the inertia stays physical by construction.

#include <optional>
#include <vector>

#include "engine/model/world.h"

namespace graze {

/// What one particle does to a link. Ratios to nominal values.
struct LinkChange {
  double length = 1, radius = 1;
  Vec3 size = Vec3::Ones();
  double density = 1;
  double mass = std::numeric_limits<double>::quiet_NaN();  // kg, NaN: density times volume
  Vec3 com = Vec3::Zero();                                 // m, shift of the centre of mass after all else
};

/// What one particle does to an object.
struct ObjectChange {
  double length = 1, radius = 1, density = 1;
  Vec3 size = Vec3::Ones();
  double mass = std::numeric_limits<double>::quiet_NaN();
  Vec3 rpy = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());  // rad, NaN: as it is
  std::optional<Spectrum> spectrum;                                     // of a heightfield that has one; none: as it is
};

/// What does not change from particle to particle: where a link's primary shape is, how it lies, what hangs on it.
class LinkPlan {
 public:
  /// `children`: the joints whose parent is the link.
  LinkPlan(const Robot& robot, int link, std::vector<int> children);

  bool has_shape() const { return primary_ >= 0; }
  /// The primary shape; has_shape() only.
  const Geometry& primary(const Robot& robot) const;
  /// A limb can be longer or shorter: a cylinder or capsule, or a box that hangs on a joint.
  bool has_length() const { return limb_; }
  double length(const Robot& robot) const;
  double volume() const { return volume_; }  // m^3, of all shapes of the link

  void apply(const LinkChange& change, Robot& robot) const;

 private:
  struct Map;
  void choose_primary(const Robot& robot);
  void choose_ends(const Robot& robot);
  void move_attached(const Map& map, Robot& robot) const;
  static const std::vector<Geometry>& shapes(const Link& link);

  int link_;
  int primary_ = -1;  // index among the link's shapes
  bool limb_ = false;
  bool root_ = false;
  int axis_ = 2;          // of the primary's frame, along the limb
  double direction_ = 1;  // +1: the distal end is at the axis' positive end
  double volume_ = 0;
  std::vector<int> children_;
};

/// The plans of all links of a robot.
std::vector<LinkPlan> link_plans(const Robot& robot);

/// Throws InputError for a spectrum of which there is no ground (spectral_heights).
void apply(const ObjectChange& change, Object& object);

}  // namespace graze
