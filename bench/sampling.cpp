// Cost of a noise channel per control step (one uniform and one quantile) and of a particle under each design.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "sampling/design.h"
#include "sampling/stream.h"

namespace graze {
namespace {

Distribution distribution(int kind) {
  switch (kind) {
    case 0:
      return Distribution::uniform(1000, 1200);
    case 1:
      return Distribution::normal(0, 0.003);
    case 2:
      return Distribution::truncated_normal(0.005, 0.001, 0, 1);
    default:
      return Distribution::choice(4);
  }
}

void uniform_draw(benchmark::State& state) {
  std::uint32_t step = 0;
  for (auto _ : state) benchmark::DoNotOptimize(uniform(1, 2, 3, step++));
}
BENCHMARK(uniform_draw);

void noise_channel(benchmark::State& state) {
  const Distribution d = distribution(static_cast<int>(state.range(0)));
  state.SetLabel(d.describe());
  std::uint32_t step = 0;
  for (auto _ : state) benchmark::DoNotOptimize(d.quantile(uniform(1, 2, 3, step++)));
}
BENCHMARK(noise_channel)->DenseRange(0, 3);

// 175 parameters: as many as the dissertation's quadruped has (Figure 15).
void particle(benchmark::State& state) {
  ParameterSpace space;
  for (int i = 0; i < 175; ++i) {
    UncertainParameter p;
    p.name = fmt::format("p{}", i);
    p.persistent = distribution(i % 2);
    space.parameters.push_back(p);
  }
  const Sampler sampler(space, static_cast<Design>(state.range(0)), 1, 10000);
  std::vector<double> values(space.parameters.size());
  std::uint32_t id = 0;
  for (auto _ : state) {
    sampler.draw(id++ % 10000, values);
    benchmark::DoNotOptimize(values.data());
  }
}
BENCHMARK(particle)->DenseRange(0, 2)->ArgName("design");

}  // namespace
}  // namespace graze

BENCHMARK_MAIN();
