// What hulls cost by their number of vertices: per pair and particle, apart and touching. On the ground,
// and hull against hull.

#include <benchmark/benchmark.h>

#include <random>

#include "engine/block_physics.h"
#include "engine/contact/collide.h"
#include "engine/contact/hull_arrays.h"
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

/// A ball whose middle is `height` over the origin, where a ball of as many corners stands, or a plane. A direction
/// that parts them by `enough` (m) ends it; else the kernel looks for points within 2 mm.
void measure(benchmark::State& state, ShapeKind under, double height, double enough) {
  const LaneKernel& kernel = kernel_of(chosen_isa(), kWide);
  const HullArrays arrays(*ball_of(static_cast<int>(state.range(0))));
  const HullView hull = arrays.view();
  const std::vector<double> above = poses(height, true), origin = poses(0, false);
  const std::vector<double> size(3 * kWide, 1.0), reach(kWide, 0.002), parted(kWide, enough);
  std::vector<double> axis(3 * kWide, 0.5), bound(kWide), manifold(8 * kManifoldRows * kWide, 0.0);
  long points = 0;
  for (auto _ : state) {
    points = 0;
    for (int block = 0; block < kPoses; ++block) {
      const unsigned open = kernel.measure_gap(
          {{static_cast<int>(ShapeKind::mesh), size.data(), above.data() + block * 12 * kWide, nullptr, &hull},
           {static_cast<int>(under), size.data(), origin.data(), nullptr, &hull},
           (1u << kWide) - 1,
           parted.data(),
           reach.data(),
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

/// Apart on the plane it ends with one look at all vertices, and a pair along a kept axis costs two of these.
void on_plane(benchmark::State& state, double height) { measure(state, ShapeKind::plane, height, 0.002); }
/// As a step asks when no axis parts them.
void on_hull(benchmark::State& state, double height) { measure(state, ShapeKind::mesh, height, 1e9); }

void vertices(benchmark::internal::Benchmark* bench) { bench->RangeMultiplier(2)->Range(8, 512); }
BENCHMARK_CAPTURE(on_plane, apart, 0.15)->Apply(vertices);
BENCHMARK_CAPTURE(on_plane, touching, 0.085)->Apply(vertices);
BENCHMARK_CAPTURE(on_hull, apart, 0.25)->Apply(vertices);
BENCHMARK_CAPTURE(on_hull, overlapping, 0.17)->Apply(vertices);

}  // namespace
}  // namespace graze

BENCHMARK_MAIN();
