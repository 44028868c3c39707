#pragma once
// Degrees of freedom of an archived state, as people read them: angles in place of quaternions.

#include <span>
#include <string>
#include <vector>

namespace graze {

/// Degrees of freedom of a state, from the columns of q: of each floating body x, y, z and roll, pitch, yaw (rad; R =
/// Rz(yaw) Ry(pitch) Rx(roll)) in place of its quaternion; joints as they are.
class Freedoms {
 public:
  /// q_names: of an archive; a quaternion's columns follow each other, BODY.qw, .qx, .qy, .qz.
  explicit Freedoms(const std::vector<std::string>& q_names);
  std::size_t size() const { return names_.size(); }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<std::string>& units() const { return units_; }  // m, rad; of joints: empty
  /// q: [column]; out: [freedom].
  void read(std::span<const double> q, std::span<double> out) const;
  /// Angles about full turns: puts those of each such column within half a turn of their mean direction.
  void unwrap(std::vector<std::vector<double>>& columns) const;

 private:
  struct Part {
    std::size_t column = 0;    // of q; of an attitude: the first of four
    bool is_attitude = false;  // three degrees of freedom
  };
  std::vector<Part> parts_;
  std::vector<std::string> names_, units_;
};

}  // namespace graze
