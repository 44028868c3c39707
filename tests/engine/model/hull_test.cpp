// Claims: a simplified hull keeps its bounds of error and corners, and says what the error is; extreme corners and the
// faces on which things rest stay; the same input gives the same corners.

#include "engine/model/hull.h"

#include <gtest/gtest.h>

#include <random>

#include "engine/model/convex_hull.h"

namespace graze {
namespace {

Mesh ball(int count, double radius) {
  std::mt19937 random(3);
  std::normal_distribution<double> n;
  Mesh out;
  for (int i = 0; i < count; ++i) out.vertices.push_back(radius * Vec3(n(random), n(random), n(random)).normalized());
  return out;
}

Mesh cylinder(int cut, double radius, double length) {
  Mesh out;
  for (int i = 0; i < cut; ++i) {
    const double angle = 2 * M_PI * i / cut;
    for (const double z : {-0.5, 0.5}) out.vertices.emplace_back(radius * cos(angle), radius * sin(angle), z * length);
  }
  return out;
}

Mesh finely_cut_box(const Vec3& size, int cut) {
  Mesh out;
  for (int i = 0; i <= cut; ++i) {
    for (int j = 0; j <= cut; ++j) {
      for (int k = 0; k <= cut; ++k) {
        const bool inside = i % cut != 0 && j % cut != 0 && k % cut != 0;
        if (!inside) out.vertices.push_back((Vec3(i, j, k) / cut - Vec3::Constant(0.5)).cwiseProduct(size));
      }
    }
  }
  return out;
}

/// Distance of x from the convex body of the corners, by projecting onto it (Frank and Wolfe's steps toward the
/// support, away steps included): an algorithm of its own, good to 1e-7.
double distance(const std::vector<Vec3>& corners, const Vec3& x) {
  Vec3 at = corners[0];
  std::vector<double> weight(corners.size(), 0.0);
  weight[0] = 1;
  for (int step = 0; step < 20000; ++step) {
    const Vec3 way = x - at;
    std::size_t best = 0, worst = corners.size();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (way.dot(corners[i]) > way.dot(corners[best])) best = i;
      if (weight[i] > 0 && (worst == corners.size() || way.dot(corners[i]) < way.dot(corners[worst]))) worst = i;
    }
    const double gain = way.dot(corners[best] - at), loss = way.dot(at - corners[worst]);
    if (gain < 1e-12) break;
    const bool toward = gain >= loss;
    const Vec3 go = toward ? Vec3(corners[best] - at) : Vec3(at - corners[worst]);
    const double most = toward ? 1.0 : weight[worst] / (1 - weight[worst]);
    const double t = std::min(most, way.dot(go) / go.squaredNorm());
    for (double& w : weight) w *= toward ? 1 - t : 1 + t;
    weight[toward ? best : worst] += toward ? t : -t;
    at += t * go;
  }
  return (x - at).norm();
}

TEST(SimplifiedHull, says_its_error) {
  for (const Mesh& mesh : {ball(600, 0.05), cylinder(100, 0.04, 0.02), finely_cut_box({0.3, 0.2, 0.1}, 9)}) {
    const auto whole = convex_hull(mesh);
    ASSERT_TRUE(whole);
    for (const double error : {5e-3, 1e-3, 2e-4}) {
      const auto hull = simplified_hull(*whole, Vec3::Ones(), {1000, error, false});
      EXPECT_LE(hull->error, error);
      double most = 0;
      for (const Vec3& vertex : whole->vertices) most = std::max(most, distance(hull->corners, vertex));
      EXPECT_NEAR(hull->error, most, 2e-6);
      for (const Vec3& corner : hull->corners) {
        EXPECT_NE(std::find(whole->vertices.begin(), whole->vertices.end(), corner), whole->vertices.end());
      }
    }
  }
}

TEST(SimplifiedHull, keeps_to_its_number_of_corners_and_grows_no_worse_with_more) {
  const auto whole = convex_hull(ball(2000, 0.1));
  double last = 1;
  for (const std::size_t most : {8u, 16u, 32u, 64u, 128u, 256u}) {
    const auto hull = simplified_hull(*whole, Vec3::Ones(), {most, 1e-6, false});
    EXPECT_EQ(hull->corners.size(), most);
    EXPECT_EQ(hull->of, 2000u);
    EXPECT_LT(hull->error, last);
    last = hull->error;
  }
  // Of n corners on a ball the best leaves caps of height about 2 pi r / (sqrt(3) n) under their triangles, furthest
  // first twice that.
  EXPECT_LT(last, 2.5 * 2 * M_PI * 0.1 / (std::sqrt(3.0) * 256));
}

// A box is its eight corners, however finely it is cut; a cylinder's end faces stay plane and as far apart.
TEST(SimplifiedHull, rests_on_the_same_faces) {
  const auto box = simplified_hull(*convex_hull(finely_cut_box({0.3, 0.2, 0.1}, 12)), Vec3::Ones(), {});
  EXPECT_EQ(box->error, 0);
  for (const Vec3& way : {Vec3(1, 1, 1), Vec3(-1, 1, 1), Vec3(1, -1, -1), Vec3(0, 0, 1), Vec3(0, -1, 0)}) {
    double most = 0;
    for (const Vec3& corner : box->corners) most = std::max(most, way.dot(corner));
    EXPECT_NEAR(most, way.cwiseAbs().dot(Vec3(0.15, 0.1, 0.05)), 1e-12);
  }
  const auto can = simplified_hull(*convex_hull(cylinder(500, 0.05, 0.1)), Vec3::Ones(), {});
  EXPECT_LT(can->corners.size(), 64u);
  EXPECT_LE(can->error, 1e-3);
  int ends[2] = {};
  for (const Vec3& corner : can->corners) {
    EXPECT_EQ(std::abs(corner.z()), 0.05);
    ++ends[corner.z() > 0];
  }
  EXPECT_GE(std::min(ends[0], ends[1]), 8);
}

// Errors are metres of the scaled mesh: one in millimetres is simplified as the same in metres.
TEST(SimplifiedHull, measures_at_its_scale) {
  const auto metres = simplified_hull(*convex_hull(ball(1000, 0.07)), Vec3::Ones(), {});
  Mesh in_millimetres = ball(1000, 0.07);
  for (Vec3& vertex : in_millimetres.vertices) vertex *= 1024;
  const auto scaled = simplified_hull(*convex_hull(in_millimetres), Vec3::Constant(1.0 / 1024), {});
  ASSERT_EQ(scaled->corners.size(), metres->corners.size());
  EXPECT_NEAR(scaled->error, metres->error, 1e-12);
  for (std::size_t i = 0; i < scaled->corners.size(); ++i) EXPECT_EQ(scaled->corners[i], 1024 * metres->corners[i]);
}

TEST(SimplifiedHull, leaves_simple_and_exact_ones_whole) {
  const auto small = convex_hull(ball(32, 0.1)), large = convex_hull(ball(500, 0.1));
  EXPECT_EQ(simplified_hull(*small, Vec3::Ones(), {})->corners, small->vertices);
  const HullSettings exact{128, 1e-3, true};
  EXPECT_EQ(simplified_hull(*large, Vec3::Ones(), exact)->corners, large->vertices);
  EXPECT_EQ(simplified_hull(*large, Vec3::Ones(), exact)->error, 0);
  EXPECT_EQ(simplified_hull(*large, Vec3::Ones(), {})->corners, simplified_hull(*large, Vec3::Ones(), {})->corners);
}

// The volume of a mesh is that of its whole hull.
TEST(SimplifiedHull, is_for_contact_alone) {
  const auto whole = convex_hull(ball(500, 0.1));
  const Shape plain{ShapeKind::mesh, Vec3::Ones(), whole, nullptr};
  const Shape simple{ShapeKind::mesh, Vec3::Ones(), whole, nullptr, simplified_hull(*whole, Vec3::Ones(), {})};
  EXPECT_EQ(simple.volume(), plain.volume());
  EXPECT_LT(hull_of(simple)->corners.size(), hull_of(plain)->corners.size());
}

// The same content is hulled once, whatever file it comes from in the end.
TEST(ConvexHull, is_found_once_for_the_same_vertices) {
  const Mesh mesh = ball(300, 0.1);
  const auto first = convex_hull(mesh), second = convex_hull(mesh);
  EXPECT_EQ(first, second);
  Mesh other = mesh;
  other.vertices[7] *= 1.5;
  EXPECT_NE(convex_hull(other), first);
}

}  // namespace
}  // namespace graze
