// How well the lane engine's contact models solve the curb campaign's contacts: sweeps, and residuals of Signorini's
// and Coulomb's conditions, of maximum dissipation, and of each model's own law. Traces are simulated once by their
// policy and then stepped again from their recorded torques, with the residuals measured after every step. Usage:
// bench_contact_residuals [particles] [policy] [model ...]

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "engine/lane_physics/lane_engine.h"
#include "engine/lane_physics/lane_physics.h"
#include "simulation/block_run.h"

namespace {

using namespace graze;

/// One lane's step in contact.
struct Sample {
  double sweeps, residual, signorini, coulomb, dissipation, own;
};

Scenario curb(const std::string& model, const std::string& policy) {
  ScenarioOptions options;
  options.overrides = {{"physics", "lanes"},
                       {"uncertain.contact.model.choice", "[" + model + "]"},
                       {"record", "{telemetry: all, every: 1, events: false}"}};
  Scenario scenario = load_scenario(GRAZE_SOURCE_DIR "/data/scenarios/quadruped_curb.yaml", options);
  std::erase_if(scenario.policies, [&](const PolicySpec& spec) { return spec.name != policy; });
  if (scenario.policies.empty()) throw std::runtime_error("no policy " + policy);
  return scenario;
}

std::vector<Particle> draw(const Scenario& scenario, int first, int count, int all) {
  const Sampler sampler(scenario.space, scenario.design, scenario.seed, all);
  std::vector<std::string> paths;
  for (const UncertainParameter& parameter : scenario.space.parameters) paths.push_back(parameter.name);
  const Fabricator fabricator(scenario.world, paths);
  std::vector<Particle> particles;
  for (int i = first; i < first + count; ++i) particles.push_back(fabricator.fabricate(i, sampler.draw(i)));
  return particles;
}

/// Steps a block again and keeps what the solver made of it.
void replay(const Scenario& scenario, const std::vector<Particle>& particles, const std::vector<TraceRecord>& traces,
            std::vector<Sample>& samples) {
  const Model& model = scenario.model;
  BlockArray q(model.nq), v(model.nv), a(model.nv), X(12 * static_cast<int>(model.bodies.size()));
  // As campaigns step: drives, here of torques that are given.
  BlockArray tau(model.na()), none(model.na()), lower(model.na()), upper(model.na());
  for (int k = 0; k < model.na(); ++k) {
    std::fill_n(lower.row(k), kLanes, -std::numeric_limits<double>::infinity());
    std::fill_n(upper.row(k), kLanes, std::numeric_limits<double>::infinity());
  }
  const DriveView drive{tau.row(0),  none.row(0),  none.row(0),  none.row(0),
                        none.row(0), lower.row(0), upper.row(0), none.row(0)};
  LaneEngine engine(model, kernel_of(chosen_isa()), {q.row(0), v.row(0), a.row(0), X.row(0)});
  engine.block().settings.measure = true;
  for (std::size_t lane = 0; lane < particles.size(); ++lane) {
    engine.start(static_cast<int>(lane), particles[lane].model, particles[lane].initial);
  }
  for (std::size_t frame = 1;; ++frame) {
    LaneMask active;
    for (std::size_t lane = 0; lane < traces.size(); ++lane) {
      if (frame >= traces[lane].telemetry.size()) continue;
      active.set(static_cast<int>(lane));
      const double* values = traces[lane].telemetry.tau().data() + frame * static_cast<std::size_t>(tau.rows());
      for (int k = 0; k < tau.rows(); ++k) tau(k, static_cast<int>(lane)) = values[k];
    }
    if (active.bits() == 0) break;
    engine.drive(scenario.timing.step, active.bits(), drive);
    const LaneBlock& block = engine.block();
    for (int lane = 0; lane < static_cast<int>(traces.size()); ++lane) {
      if (!active[lane] || engine.sweeps(lane) == 0) continue;
      const double* m = block.measured + lane;
      samples.push_back({engine.sweeps(lane), engine.residual(lane), m[0], m[kLanes], m[2 * kLanes], m[3 * kLanes]});
    }
  }
  for (std::size_t lane = 0; lane < traces.size(); ++lane) {
    const Eigen::VectorXd now = q.column(static_cast<int>(lane));
    if (!std::equal(now.begin(), now.end(), traces[lane].q.begin())) {
      fmt::print("the replay of particle {} left its trace\n", particles[lane].id);
    }
  }
}

double quantile(std::vector<Sample>& samples, double Sample::*member, double p) {
  const auto place = samples.begin() + static_cast<std::ptrdiff_t>(p * static_cast<double>(samples.size() - 1));
  std::nth_element(samples.begin(), place, samples.end(),
                   [&](const Sample& x, const Sample& y) { return x.*member < y.*member; });
  return (*place).*member;
}

void table(const std::string& model, std::vector<Sample>& samples) {
  fmt::print("{}: {} steps in contact\n", model, samples.size());
  fmt::print("  {:<14}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "median", "90 %", "99 %", "99.9 %", "worst", "mean");
  const auto line = [&](const char* name, double Sample::*member) {
    fmt::print("  {:<14}", name);
    for (double p : {0.5, 0.9, 0.99, 0.999, 1.0}) fmt::print("{:>10.2g}", quantile(samples, member, p));
    double sum = 0;
    for (const Sample& sample : samples) sum += sample.*member;
    fmt::print("{:>10.2g}\n", sum / static_cast<double>(samples.size()));
  };
  line("sweeps, steps", &Sample::sweeps);
  line("last change", &Sample::residual);
  line("own law", &Sample::own);
  line("Signorini", &Sample::signorini);
  line("Coulomb", &Sample::coulomb);
  line("dissipation", &Sample::dissipation);
  const double tolerance = SolverSettings{}.tolerance;
  std::vector<Sample> unfinished;
  for (const Sample& sample : samples) {
    if (sample.residual > tolerance) unfinished.push_back(sample);
  }
  fmt::print("  not converged: {} ({:.3f} %)", unfinished.size(),
             100.0 * static_cast<double>(unfinished.size()) / static_cast<double>(samples.size()));
  if (!unfinished.empty()) {
    fmt::print(", own residual median {:.2g}, worst {:.2g} m/s", quantile(unfinished, &Sample::own, 0.5),
               quantile(unfinished, &Sample::own, 1));
  }
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 48;
  const std::string policy = argc > 2 ? argv[2] : "step/1cm";
  std::vector<std::string> models(argv + std::min(argc, 3), argv + argc);
  if (models.empty()) models = lane_contact_models();
  for (const std::string& model : models) {
    const Scenario scenario = curb(model, policy);
    std::vector<Sample> samples;
    for (int first = 0; first < count; first += kLanes) {
      const std::vector<Particle> particles = draw(scenario, first, std::min(kLanes, count - first), count);
      BlockRun run(scenario, scenario.policies.front(), scenario.seed);
      const std::vector<TraceRecord> traces = run.run(particles);
      replay(scenario, particles, traces, samples);
    }
    table(model, samples);
  }
}
