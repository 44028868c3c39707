// What contact geometry costs: time per pair and lane, by pair of shapes and instruction set, for random poses
// near contact. Hulls, whose cost depends on their corners, have a benchmark of their own.

#include "engine/contact/collide.h"

#include <benchmark/benchmark.h>

#include <random>

#include "bench/collide/kernel.h"
#include "engine/lanes/isa.h"
#include "engine/model/model.h"

namespace graze {
namespace {

constexpr int kBlocks = 64, kWide = 8;

/// Random pairs of bodies of some 0.1 m that touch about half of the time.
class Pairs {
 public:
  explicit Pairs(ShapeKind a, ShapeKind b) : data_(kBlocks * kWide * kCollideRows) {
    for (int block = 0; block < kBlocks; ++block) {
      for (int lane = 0; lane < kWide; ++lane) fill(block, lane, a, b);
    }
  }
  const double* data(int block = 0) const { return data_.data() + block * kWide * kCollideRows; }

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  double& at(int block, int row, int lane) { return data_[(block * kCollideRows + row) * kWide + lane]; }
  void put(int block, int lane, int first, const Vec3& size, const Pose& X) {
    for (int i = 0; i < 3; ++i) at(block, first + i, lane) = size[i];
    for (int i = 0; i < 9; ++i) at(block, first + 3 + i, lane) = X.linear()(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) at(block, first + 12 + i, lane) = X.translation()[i];
  }
  Pose turned() {
    std::normal_distribution normal;
    Pose X = Pose::Identity();
    X.linear() = Quat(normal(random_), normal(random_), normal(random_), normal(random_)).normalized().matrix();
    return X;
  }
  void fill(int block, int lane, ShapeKind a, ShapeKind b) {
    const auto size = [&](ShapeKind kind) {
      return kind == ShapeKind::heightfield ? Vec3(1, 1, 1) : Vec3(0.1, 0.1 + uniform(0, 0.05), 0.1);
    };
    const bool ground = b == ShapeKind::plane || b == ShapeKind::heightfield;
    Pose X_a = turned(), X_b = ground ? Pose::Identity() : turned();
    X_a.translation() = Vec3(uniform(-0.1, 0.1), uniform(-0.1, 0.1), uniform(0.05, 0.2));
    put(block, lane, 0, size(a), X_a);
    put(block, lane, 15, size(b), X_b);
  }

  std::mt19937 random_{1};
  std::vector<double> data_;
};

void report(benchmark::State& state, long points) {
  const double lanes = static_cast<double>(state.iterations()) * kBlocks * kWide;
  state.counters["time/lane"] = benchmark::Counter(lanes, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["points/lane"] = static_cast<double>(points) / (kBlocks * kWide);
}

using CollideBlocks = long (*)(ShapeKind, ShapeKind, const HeightView*, const double*, int);

CollideBlocks blocks_of([[maybe_unused]] Isa isa) {
#ifdef GRAZE_X86_KERNELS
  if (isa == Isa::avx512) return collide_blocks_avx512;
  if (isa == Isa::avx2) return collide_blocks_avx2;
#endif
  return collide_blocks_portable;
}

void on_lanes(benchmark::State& state, Isa isa, ShapeKind a, ShapeKind b) {
  const Pairs pairs(a, b);
  const std::vector<double> height(21 * 21, 0.0);
  const std::vector<HeightView> views(kWide, HeightView{21, 21, height.data()});
  const CollideBlocks collide = blocks_of(isa);
  long points = 0;
  for (auto _ : state) benchmark::DoNotOptimize(points = collide(a, b, views.data(), pairs.data(), kBlocks));
  report(state, points);
}

void register_all() {
  using enum ShapeKind;
  const char* names[] = {"box", "sphere", "cylinder", "capsule", "mesh", "plane", "heightfield"};
  const auto name = [&](ShapeKind a, ShapeKind b) {
    return std::string(names[static_cast<int>(a)]) + "-" + names[static_cast<int>(b)];
  };
  for (Isa isa : available_isas()) {
    for (ShapeKind a : {sphere, capsule, cylinder, box}) {
      for (ShapeKind b : {plane, sphere, capsule, cylinder, box, heightfield}) {
        if (rank_of(a) > rank_of(b)) continue;
        benchmark::RegisterBenchmark((std::string(isa_name(isa)) + "/" + name(a, b)).c_str(), on_lanes, isa, a, b);
      }
    }
  }
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  graze::register_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
