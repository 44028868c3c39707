// What hulls cost by their number of vertices: per pair and particle, apart and touching. On the ground on lanes; hull
// against hull lane by lane, and what a pair costs that a kept axis parts.

#include <benchmark/benchmark.h>

#include <random>

#include "engine/block_physics.h"
#include "engine/contact/collide.h"
#include "engine/contact/convex_pairs.h"
#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/isa.h"

namespace graze {
namespace {

constexpr int kWide = kLanes, kPoses = 64;

std::shared_ptr<const Hull> ball_of(int vertices) {
  auto out = std::make_shared<Hull>();
  std::mt19937 random(2);
  std::normal_distribution normal;
  for (int i = 0; i < vertices; ++i) {
    out->corners.push_back(0.1 * Vec3(normal(random), normal(random), normal(random)).normalized());
  }
  out->of = out->corners.size();
  return out;
}

/// Rows of kPoses blocks: the first body's poses about `height` over the second's, which stand at the origin.
std::vector<double> poses(double height, bool turned) {
  std::mt19937 random(3);
  std::normal_distribution normal;
  std::vector<double> rows(kPoses * 12 * kWide);
  for (int block = 0; block < kPoses; ++block) {
    for (int lane = 0; lane < kWide; ++lane) {
      const Mat3 R = turned ? Quat(normal(random), normal(random), normal(random), normal(random)).normalized().matrix()
                            : Mat3(Mat3::Identity());
      double* row = rows.data() + block * 12 * kWide + lane;
      for (int i = 0; i < 9; ++i) row[i * kWide] = R(i / 3, i % 3);
      row[11 * kWide] = height;
    }
  }
  return rows;
}

void report(benchmark::State& state, long points) {
  const double pairs = static_cast<double>(state.iterations()) * kPoses * kWide;
  state.counters["time/pair"] = benchmark::Counter(pairs, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["points/pair"] = static_cast<double>(points) / (kPoses * kWide);
}

/// The ground's kernel; `height` of the ball's middle over the plane. Apart it ends with one look at all vertices, and
/// a pair along a kept axis costs two of these.
void on_plane(benchmark::State& state, double height) {
  const LaneKernel& kernel = kernel_of(chosen_isa(), kWide);
  const HullArrays arrays(*ball_of(static_cast<int>(state.range(0))));
  const HullView hull = arrays.view();
  const std::vector<double> above = poses(height, true), origin = poses(0, false);
  const std::vector<double> size(3 * kWide, 1.0), enough(kWide, 0.002);
  std::vector<double> axis(3 * kWide, 0.5), bound(kWide), manifold(8 * kManifoldRows * kWide, 0.0);
  long points = 0;
  for (auto _ : state) {
    points = 0;
    for (int block = 0; block < kPoses; ++block) {
      const unsigned open = kernel.measure_gap(
          {{static_cast<int>(ShapeKind::mesh), size.data(), above.data() + block * 12 * kWide, nullptr, &hull},
           {static_cast<int>(ShapeKind::plane), size.data(), origin.data(), nullptr, nullptr},
           (1u << kWide) - 1,
           enough.data(),
           enough.data(),
           axis.data(),
           bound.data(),
           manifold.data()});
      for (int k = 0; open != 0 && k < 8; ++k) {
        for (int lane = 0; lane < kWide; ++lane) points += manifold[(k * kManifoldRows + kRowValid) * kWide + lane] > 0;
      }
    }
  }
  report(state, points);
}

/// Two balls whose middles are `height` apart, as a step asks when no axis parts them.
void on_hull(benchmark::State& state, double height) {
  Model model;
  for (int i = 0; i < 2; ++i) {
    Collider collider;
    collider.shape.kind = ShapeKind::mesh;
    collider.shape.size = Vec3::Ones();
    collider.shape.hull = ball_of(static_cast<int>(state.range(0)));
    model.colliders.push_back(collider);
  }
  model.pairs = {{0, 1, 1, 0}};
  ConvexPairs pairs(model, kWide);
  const std::vector<double> above = poses(height, true), origin = poses(0, false), margin(kWide, 0.002);
  std::vector<double> rows(8 * kManifoldRows * kWide), axis(3 * kWide);
  long points = 0;
  for (auto _ : state) {
    points = 0;
    for (int block = 0; block < kPoses; ++block) {
      pairs.collide(0, kWide, (1u << kWide) - 1, above.data() + block * 12 * kWide, origin.data(), margin.data(),
                    rows.data(), axis.data());
      for (int k = 0; k < 8; ++k) {
        for (int lane = 0; lane < kWide; ++lane) points += rows[(k * kManifoldRows + kRowValid) * kWide + lane] > 0;
      }
    }
  }
  report(state, points);
}

void vertices(benchmark::internal::Benchmark* bench) { bench->RangeMultiplier(2)->Range(8, 512); }
BENCHMARK_CAPTURE(on_plane, apart, 0.15)->Apply(vertices);
BENCHMARK_CAPTURE(on_plane, touching, 0.085)->Apply(vertices);
BENCHMARK_CAPTURE(on_hull, apart, 0.25)->Apply(vertices);
BENCHMARK_CAPTURE(on_hull, overlapping, 0.17)->Apply(vertices);

}  // namespace
}  // namespace graze

BENCHMARK_MAIN();
