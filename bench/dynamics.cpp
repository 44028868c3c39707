// What the dynamics of LINKS (18 degrees of freedom, 13 bodies) cost: poses, mass matrix and bias, with and without the
// factorisation and its solution, by the kernels of each instruction set per block of lanes, and by the templates on
// double and on packs as a caller compiles them. No colliders: dynamics alone.

#include <benchmark/benchmark.h>

#include "engine/dynamics/dynamics_model.h"
#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/block.h"
#include "engine/model/urdf.h"

namespace graze {
namespace {

Model links() {
  World world;
  world.robot = load_urdf(GRAZE_SOURCE_DIR "/data/robots/links.urdf");
  world.contact.ignore = {{"*", "*"}};
  return compile(world);
}

State somewhere(const Model& model) {
  State state{Eigen::VectorXd::Constant(model.nq, 0.3), Eigen::VectorXd::Constant(model.nv, 0.5)};
  state.q.head<4>().normalize();
  return state;
}

void per_robot(benchmark::State& state, int lanes) {
  state.counters["robots/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * lanes, benchmark::Counter::kIsRate);
}

/// `solve`: M is factored, too, and v' found (the lanes' has joint damping in it).
void by_kernel(benchmark::State& state, Isa isa, int lanes, bool solve) {
  const Model model = links();
  BlockArray q(model.nq), v(model.nv), a(model.nv), X(12 * static_cast<int>(model.bodies.size())), tau(model.na());
  const LaneKernel& kernel = kernel_of(isa, lanes);
  LaneEngine engine(model, kernel, {q.row(0), v.row(0), a.row(0), X.row(0)});
  for (int lane = 0; lane < lanes; ++lane) engine.start(lane, model, somewhere(model));
  DriveView drive{};
  drive.tau = tau.row(0);
  for (auto _ : state) {
    kernel.settle(engine.block());
    if (solve) kernel.begin(engine.block(), 1e-3, (1u << lanes) - 1u, drive);
    benchmark::ClobberMemory();
  }
  per_robot(state, lanes);
}

template <class T>
void by_template(benchmark::State& state, bool solve) {
  const Model model = links();
  const DynamicsModel robot(model);
  DynamicsData<T> data(robot);
  const State start = somewhere(model);
  std::vector<T> q(start.q.begin(), start.q.end()), v(start.v.begin(), start.v.end()), tau(model.nv, T(0.0)),
      a(model.nv);
  for (auto _ : state) {
    update(data.tree(), q.data(), v.data());
    if (solve) forward_dynamics(data.tree(), tau.data(), a.data());
    benchmark::ClobberMemory();
  }
  per_robot(state, kWidth<T>);
}

void add_all() {
  for (const bool solve : {false, true}) {
    const std::string what = solve ? "M, bias, factor, solve/" : "M, bias/";
    for (const Isa isa : available_isas()) {
      for (const int lanes : {8, 4, 1}) {
        if (lanes == 4 && isa != Isa::avx2) continue;
        const std::string name = what + isa_name(isa) + ", lanes: " + std::to_string(lanes);
        benchmark::RegisterBenchmark(name.c_str(), by_kernel, isa, lanes, solve);
      }
    }
    benchmark::RegisterBenchmark((what + "template, double").c_str(), by_template<double>, solve);
    benchmark::RegisterBenchmark((what + "template, Pack<8>").c_str(), by_template<Pack<8>>, solve);
  }
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  graze::add_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
}
