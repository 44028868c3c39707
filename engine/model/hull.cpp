#include "engine/model/hull.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "engine/model/convex_hull.h"

namespace graze {

namespace {

/// Hulls of so few corners are not simplified: looking at them costs no more than looking at a cylinder.
constexpr std::size_t kFew = 32;
/// Default of the error: 1 mm, and 1 % of the longest edge of the bounding box.
constexpr double kError = 1e-3, kErrorShare = 0.01;

using Box = Eigen::AlignedBox3d;

double distance_to_segment(const Vec3& x, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp(ab.dot(x - a) / length2, 0.0, 1.0) : 0;
  return (x - a - t * ab).norm();
}

/// Chooses corners furthest-first.
class Simplifier {
 public:
  Simplifier(std::vector<Vec3> points, double error, std::size_t most)
      : points_(std::move(points)), chosen_(points_.size()), error_limit_(error), most_(most) {}

  /// Which points stay, in order.
  std::vector<int> run() {
    if (!begin()) return all();
    while (true) {
      span();
      measure_planes();
      if (add_worst()) continue;
      measure_distances();  // no less than those of the planes
      if (!add_worst()) break;
    }
    error_ = 0;
    for (const Reach& reach : reach_) error_ = std::max(error_, reach.distance);
    return members();
  }

  /// How far the others lie outside of what the chosen span, m.
  double error() const { return error_; }

 private:
  struct Reach {
    double distance = 0;  // outside, m; 0: inside
    int face = -1;        // that it lies farthest above
  };

  std::vector<int> all() {
    std::vector<int> out(points_.size());
    std::iota(out.begin(), out.end(), 0);
    return out;
  }

  std::vector<int> members() const {
    std::vector<int> out;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (chosen_[i]) out.push_back(static_cast<int>(i));
    }
    return out;
  }

  /// The extreme points along the axes, then along diagonals, until they span a volume.
  bool begin() {
    for (int zeros : {2, 0, 1}) {
      for (int way = 0; way < 27; ++way) {
        const int x = way % 3 - 1, y = way / 3 % 3 - 1, z = way / 9 - 1;
        const Vec3 n(x, y, z);
        if ((n.array() == 0).count() == zeros) choose_extreme(n);
      }
      if (span()) return true;
    }
    return false;
  }

  void choose_extreme(const Vec3& n) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < points_.size(); ++i) {
      if (n.dot(points_[i]) > n.dot(points_[best])) best = i;
    }
    chosen_[best] = true;
  }

  double distance_to(const HullFace& face, const Vec3& x) const {
    const Vec3 &n = face.normal, &a = corners_[face.corner[0]], &b = corners_[face.corner[1]];
    const Vec3& c = corners_[face.corner[2]];
    const bool within =
        n.dot((b - a).cross(x - a)) >= 0 && n.dot((c - b).cross(x - b)) >= 0 && n.dot((a - c).cross(x - c)) >= 0;
    if (within) return n.dot(x) - face.offset;
    return std::min({distance_to_segment(x, a, b), distance_to_segment(x, b, c), distance_to_segment(x, c, a)});
  }

  bool span() {
    const std::vector<int> member = members();
    count_ = member.size();
    corners_.clear();
    for (const int i : member) corners_.push_back(points_[i]);
    faces_ = hull_faces(corners_, corners_.size());
    return !faces_.empty();
  }

  /// Bounds of the distances from below: the greatest from any face's plane.
  void measure_planes() {
    reach_.assign(points_.size(), {});
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (chosen_[i]) continue;
      const Vec3& p = points_[i];
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        const double above = faces_[f].normal.dot(p) - faces_[f].offset;
        if (above > reach_[i].distance) reach_[i] = {above, static_cast<int>(f)};
      }
    }
  }

  /// The distances themselves, of the points that lie above some face.
  void measure_distances() {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (reach_[i].face < 0) continue;
      double least = 1e300;
      // The nearest point of a convex body lies on a face that is seen.
      for (const HullFace& face : faces_) {
        if (face.normal.dot(points_[i]) > face.offset) least = std::min(least, distance_to(face, points_[i]));
      }
      reach_[i].distance = std::max(reach_[i].distance, least);
    }
  }

  /// Takes the worst points, one per face and an eighth as many as there are. False when there is none, or no room.
  bool add_worst() {
    std::vector<int> worst(faces_.size(), -1);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Reach& reach = reach_[i];
      if (reach.face < 0 || reach.distance <= error_limit_) continue;
      int& of_face = worst[reach.face];
      if (of_face < 0 || reach.distance > reach_[of_face].distance) of_face = static_cast<int>(i);
    }
    std::erase(worst, -1);
    std::sort(worst.begin(), worst.end(), [&](int a, int b) {
      return reach_[a].distance > reach_[b].distance || (reach_[a].distance == reach_[b].distance && a < b);
    });
    const std::size_t room = most_ > count_ ? most_ - count_ : 0;
    const std::size_t take = std::min({worst.size(), room, 1 + count_ / 8});
    for (std::size_t i = 0; i < take; ++i) chosen_[worst[i]] = true;
    return take > 0;
  }

  const std::vector<Vec3> points_;
  std::vector<bool> chosen_;
  const double error_limit_;
  const std::size_t most_;
  std::size_t count_ = 0;
  double error_ = 0;
  std::vector<Vec3> corners_;
  std::vector<HullFace> faces_;
  std::vector<Reach> reach_;
};

Vec3 centre_of(const std::vector<Vec3>& points) {
  Box box;
  for (const Vec3& p : points) box.extend(p);
  return box.center();
}

std::shared_ptr<Hull> whole_hull(const Mesh& whole) {
  auto out = std::make_shared<Hull>();
  out->corners = whole.vertices;
  out->centre = centre_of(out->corners);
  out->of = out->corners.size();
  return out;
}

}  // namespace

std::shared_ptr<const Hull> simplified_hull(const Mesh& whole, const Vec3& scale, const HullSettings& settings) {
  auto out = whole_hull(whole);
  if (settings.exact || out->of <= std::min(kFew, settings.vertices)) return out;
  std::vector<Vec3> points;
  Box box;
  for (const Vec3& p : whole.vertices) box.extend(points.emplace_back(p.cwiseProduct(scale)));
  const double most =
      std::isnan(settings.error) ? std::min(kError, kErrorShare * box.sizes().maxCoeff()) : settings.error;
  Simplifier simplifier(std::move(points), most, std::max(settings.vertices, HullSettings::kFewest));
  const std::vector<int> chosen = simplifier.run();
  out->corners.clear();
  for (const int i : chosen) out->corners.push_back(whole.vertices[i]);
  out->centre = centre_of(out->corners);
  out->error = simplifier.error();
  return out;
}

std::shared_ptr<const Hull> hull_of(const Shape& shape) {
  if (shape.hull) return shape.hull;
  const auto whole = convex_hull(*shape.mesh);
  return whole_hull(whole ? *whole : *shape.mesh);
}

}  // namespace graze
