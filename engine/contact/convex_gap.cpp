#include "engine/contact/convex_gap.h"

#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "engine/contact/bullet_convert.h"
#include "engine/lanes/scalar.h"

namespace graze {
namespace {

/// Nearer than this (m) two points have no direction.
constexpr double kApart = 1e-9;
constexpr double kNever = std::numeric_limits<double>::infinity();

/// A core as Bullet's EPA sees it: its support function.
class CoreShape final : public btConvexInternalShape {
 public:
  explicit CoreShape(const Convex& convex) : convex_(convex) {
    m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
    m_collisionMargin = 0;
  }
  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& n) const override {
    return to_bt(convex_.core_support(from_bt(n)));
  }
  btVector3 localGetSupportingVertex(const btVector3& n) const override {
    return localGetSupportingVertexWithoutMargin(n);
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* n, btVector3* out, int count) const override {
    for (int i = 0; i < count; ++i) out[i] = localGetSupportingVertexWithoutMargin(n[i]);
  }
  void calculateLocalInertia(btScalar, btVector3&) const override { assert(false && "not a body"); }
  const char* getName() const override { return "core"; }

 private:
  const Convex& convex_;
};

/// Climbs to the direction of greatest separation near n: EPA ends on a polytope, which leaves round shapes some 1e-4
/// of their size from it. Steps along two tangents, halved when neither helps.
Vec3 climb(const Convex& a, const Convex& b, Vec3 n) {
  double best = separation(a, b, n);
  for (double step = 1e-3; step > 1e-8;) {
    const Vec3 t1 = n.unitOrthogonal(), t2 = n.cross(t1);
    bool better = false;
    for (const Vec3& way : {t1, t2, Vec3(-t1), Vec3(-t2)}) {
      const Vec3 next = (n + step * way).normalized();
      const double value = separation(a, b, next);
      if (value > best) {
        best = value;
        n = next;
        better = true;
        break;
      }
    }
    if (!better) step *= 0.5;
  }
  return n;
}

bool is_round(const Convex& shape) { return shape.kind != ShapeKind::box && shape.kind != ShapeKind::mesh; }

Vec3 centre(const Convex& shape) { return shape.X.translation(); }

Gap from_cores(const Convex& a, const Convex& b, double d, const Vec3& n, const Vec3& core_a, const Vec3& core_b) {
  return {d - a.rounding() - b.rounding(), n, core_a - a.rounding() * n, core_b + b.rounding() * n};
}

/// A point of the difference of both cores, with the points it comes from.
struct Difference {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  Vec3 w() const { return a - b; }
};

/// Up to four of them, and the weights of their hull's point that is nearest to zero.
struct Simplex {
  int count = 0;
  std::array<Difference, 4> point;
  std::array<double, 4> weight{};

  Vec3 sum(Vec3 Difference::*side) const {
    Vec3 out = Vec3::Zero();
    for (int i = 0; i < count; ++i) out += weight[i] * (point[i].*side);
    return out;
  }
  Vec3 nearest() const { return sum(&Difference::a) - sum(&Difference::b); }
};

/// Solves for the weights of one or two edges: the larger diagonal first.
void weigh_edges(const Vec3& o, const Vec3& first, const Vec3& second, double& x, double& y) {
  const double g = first.squaredNorm(), l = first.dot(second) / g;
  const double right = -first.dot(o);
  y = (-second.dot(o) - l * right) / (second.squaredNorm() - l * first.dot(second));
  x = right / g - l * y;
}

/// Weights of the affine hull's point nearest to zero; false where it is not between the points, or they are dependent.
/// With edges e_i from the first point o: sum_j (e_i . e_j) x_j = -e_i . o.
bool weigh(Simplex& simplex) {
  const Vec3 o = simplex.point[0].w();
  Vec3 x = Vec3::Zero(), edge[3];
  for (int i = 1; i < simplex.count; ++i) edge[i - 1] = simplex.point[i].w() - o;
  if (simplex.count == 2) x[0] = -edge[0].dot(o) / edge[0].squaredNorm();
  if (simplex.count == 3) {
    const bool first = edge[0].squaredNorm() >= edge[1].squaredNorm();
    first ? weigh_edges(o, edge[0], edge[1], x[0], x[1]) : weigh_edges(o, edge[1], edge[0], x[1], x[0]);
  }
  if (simplex.count == 4) {
    Mat3 E;
    E << edge[0], edge[1], edge[2];
    x = (E.transpose() * E).eval().ldlt().solve(E.transpose() * -o);
  }
  simplex.weight = {1 - x.sum(), x[0], x[1], x[2]};
  for (int i = 0; i < simplex.count; ++i) {
    if (!(simplex.weight[i] >= 0 && std::isfinite(simplex.weight[i]))) return false;
  }
  return true;
}

/// The face (corner, edge, triangle or all) of the simplex that holds the point nearest to zero. All that contain the
/// last point, or all at all, are tried, which has no case to get wrong.
Simplex nearest_face(const Simplex& simplex, bool with_last) {
  Simplex best;
  double least = std::numeric_limits<double>::infinity();
  const unsigned last = 1u << (simplex.count - 1);
  for (unsigned members = with_last ? last : 1; members < 2 * last; ++members) {
    Simplex face;
    for (int i = 0; i < simplex.count; ++i) {
      if (members >> i & 1u) face.point[face.count++] = simplex.point[i];
    }
    if (!weigh(face)) continue;
    const double distance = face.nearest().squaredNorm();
    // Four points hold zero, or one of their faces is nearer; what else comes out is the rounding of a flat
    // tetrahedron.
    if (face.count == 4 && distance > kApart * kApart) continue;
    if (distance < least) {
      least = distance;
      best = face;
    }
  }
  return best;
}

Difference support_of_difference(const Convex& a, const Convex& b, const Vec3& n) {
  return {a.X * a.core_support(a.X.linear().transpose() * -n), b.X * b.core_support(b.X.linear().transpose() * n)};
}

/// To begin with: the point of the difference that lies furthest against n.
Simplex first_simplex(const Convex& a, const Convex& b, const Vec3& n) {
  Simplex out;
  out.count = 1;
  out.point[0] = support_of_difference(a, b, n);
  return out;
}

/// The direction from b's middle to a's, or any.
Vec3 outward(const Convex& a, const Convex& b) {
  const Vec3 from = centre(a) - centre(b);
  const double length = from.norm();
  return length > kApart ? Vec3(from / length) : Vec3::UnitZ();
}

/// What GJK finds of two cores.
enum class Cores { overlap, apart, far };

/// Nearest points of the cores, if they are apart (Gilbert, Johnson and Keerthi, IEEE J. Robotics and Automation 4
/// (1988)). Ends when the direction proves the distance to 1e-13 of it; or, far, when it proves that the distance is
/// more than `enough` and three quarters of that of the points found. `simplex`: in, points to begin with; out, those
/// of the result.
Cores nearest_cores(const Convex& a, const Convex& b, double enough, Simplex& simplex, Vec3& on_a, Vec3& on_b) {
  simplex = nearest_face(simplex, false);
  Cores out = Cores::apart;
  for (int i = 0; i < 200; ++i) {
    const Vec3 v = simplex.nearest();
    const double length = v.norm();
    if (length < kApart) return Cores::overlap;
    const Difference next = support_of_difference(a, b, v);
    const double proved = v.dot(next.w());
    if (length * length - proved <= 1e-13 * length * length) break;
    if (proved > std::max(enough, 0.75 * length) * length) {
      out = Cores::far;
      break;
    }
    Simplex larger = simplex;
    larger.point[larger.count++] = next;
    larger = nearest_face(larger, true);
    if (!(larger.nearest().squaredNorm() < v.squaredNorm())) break;
    simplex = larger;
    if (simplex.count == 4) return Cores::overlap;  // zero lies inside
  }
  on_a = simplex.sum(&Difference::a);
  on_b = simplex.sum(&Difference::b);
  return out;
}

/// Moves a out of b along n, and looks from there which way is nearest: a direction that parts the shapes by less, as
/// long as there is one. This also finds the normal of shapes that just touch, where EPA sees none.
Gap step_out(const Convex& a, const Convex& b, Vec3 n) {
  constexpr double kAside = 1e-3;  // m
  Gap best{-1e300, n, centre(a), centre(b)};
  Simplex simplex = first_simplex(a, b, n);  // of a where it is; the next place is not far from the last
  for (int i = 0; i < 10; ++i) {
    const double phi = separation(a, b, n);
    if (phi <= best.phi + 1e-10 && i > 0) break;
    best.phi = phi;
    best.n = n;
    Convex moved = a;
    const Vec3 way = (kAside - phi) * n;
    moved.X.translation() += way;
    Vec3 on_a, on_b;
    for (int k = 0; k < simplex.count; ++k) simplex.point[k].a += way;
    if (nearest_cores(moved, b, kNever, simplex, on_a, on_b) == Cores::overlap) break;
    for (int k = 0; k < simplex.count; ++k) simplex.point[k].a -= way;
    best.p_a = on_a - way;
    best.p_b = on_b;
    n = (on_a - on_b).normalized();
  }
  return best;
}

/// Cores that overlap, or touch so closely that GJK sees no direction.
Gap overlap(const Convex& a, const Convex& b) {
  const CoreShape core_a(a), core_b(b);
  const Vec3 first = outward(a, b);
  Gap best = step_out(a, b, first);
  btGjkEpaSolver2::sResults result;
  const btVector3 guess = to_bt(Vec3(a.X.linear().transpose() * -first));
  if (btGjkEpaSolver2::Penetration(&core_a, to_bt(a.X), &core_b, to_bt(b.X), guess, result, false)) {
    const Vec3 way = from_bt(result.witnesses[1]) - from_bt(result.witnesses[0]);
    if (way.norm() > kApart) {
      const Gap other = step_out(a, b, way.normalized());
      if (other.phi > best.phi) best = other;
    }
  }
  if (is_round(a) || is_round(b)) best.n = climb(a, b, best.n);
  best.phi = separation(a, b, best.n);
  // The ends as they touch, phi apart along n.
  const Vec3 middle = 0.5 * (best.p_a + best.p_b) + 0.5 * (b.rounding() - a.rounding()) * best.n;
  return {best.phi, best.n, middle + 0.5 * best.phi * best.n, middle - 0.5 * best.phi * best.n};
}

}  // namespace

Vec3 Convex::core_support(const Vec3& n) const {
  const Vec3 s(n.x() < 0 ? -1 : 1, n.y() < 0 ? -1 : 1, n.z() < 0 ? -1 : 1);
  switch (kind) {
    case ShapeKind::sphere:
      return Vec3::Zero();
    case ShapeKind::capsule:
      return {0, 0, 0.5 * size.y() * s.z()};
    case ShapeKind::cylinder: {
      const double across = pinned::hypot(n.x(), n.y());
      const double scale = across > 1e-150 ? size.x() / across : 0;
      return {scale * n.x(), scale * n.y(), 0.5 * size.y() * s.z()};
    }
    case ShapeKind::box:
      return 0.5 * size.cwiseProduct(s);
    case ShapeKind::mesh:
      return corners->furthest(n);
    default:
      assert(false && "not convex");
      return Vec3::Zero();
  }
}

double Convex::reach(const Vec3& n) const { return n.dot(X * core_support(X.linear().transpose() * n)) + rounding(); }

double separation(const Convex& a, const Convex& b, const Vec3& n) { return -a.reach(-n) - b.reach(n); }

Gap gap_between(const Convex& a, const Convex& b, double enough) {
  Vec3 on_a, on_b;
  const double rounding = a.rounding() + b.rounding();
  Simplex simplex = first_simplex(a, b, outward(a, b));
  const Cores cores = nearest_cores(a, b, enough + rounding, simplex, on_a, on_b);
  if (cores == Cores::overlap) return overlap(a, b);
  const double distance = (on_a - on_b).norm();
  const Vec3 n = (on_a - on_b) / distance;
  // The last look may not have been along n by more than rounding, so the bound is taken along it.
  return from_cores(a, b, cores == Cores::far ? separation(a, b, n) + rounding : distance, n, on_a, on_b);
}

}  // namespace graze
