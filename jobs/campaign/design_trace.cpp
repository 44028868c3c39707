#include "jobs/campaign/design_trace.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/model/fabrication.h"
#include "jobs/campaign/nominal_traces.h"
#include "simulation/simulation.h"

namespace graze {
namespace {

constexpr double kPoseInterval = 0.01;  // s: a gait cycle of 0.3 s looks smooth
constexpr double kMostPoses = 400;      // of one trace

/// So many steps from one sample to the next that there are at most `most`, `least` seconds apart.
std::uint32_t sampled_every(const Scenario& scenario, double least, double most) {
  const double between = std::max(least, scenario.timing.end / most);
  return static_cast<std::uint32_t>(std::max(1.0, std::ceil(between / scenario.timing.step - 1e-9)));
}

/// Keeps speeds and torques of the drives, and lets a FrameWatch keep the poses.
class DriveWatch : public TraceObserver {
 public:
  explicit DriveWatch(const Scenario& scenario)
      : every_(sampled_every(scenario, 0, kMostSamples)),
        poses_(sampled_every(scenario, kPoseInterval, kMostPoses), {kNominalParticle},
               {{kNominalParticle, std::numeric_limits<double>::infinity()}}) {}

  bool see(const StepView& step) override {
    if (step.step == step.first) begin(step.model);
    const bool kept = step.step % every_ == 0 || step.ends;
    if (kept && step.step > step.first) add(step);  // at the start there is no torque yet
    return poses_.see(step);
  }
  DesignTrace take() {
    out_.frames = poses_.take(kNominalParticle);
    return std::move(out_);
  }

 private:
  void begin(const Model& model) {
    out_ = {};
    for (const int index : model.actuated) {
      const Body& body = model.bodies[static_cast<std::size_t>(index)];
      out_.drives.push_back({body.joint, body.type == JointType::prismatic, body.effort, body.velocity, {}, {}, {}});
    }
  }
  void add(const StepView& step) {
    out_.time.push_back(step.time);
    for (std::size_t k = 0; k < out_.drives.size(); ++k) {
      const Body& body = step.model.bodies[static_cast<std::size_t>(step.model.actuated[k])];
      out_.drives[k].speed.push_back(step.physics.state().v(body.v, step.lane));
      const double torque = step.tau(static_cast<int>(k), step.lane);
      const double cut = std::max(0.0, -step.headroom(static_cast<int>(k), step.lane));
      out_.drives[k].torque.push_back(torque);
      out_.drives[k].asked.push_back(torque + std::copysign(cut, torque));
    }
  }

  const std::uint32_t every_;
  FrameWatch poses_;
  DesignTrace out_;
};

}  // namespace

DesignTrace trace_design(Scenario scenario, const std::string& policy) {
  scenario.recording.telemetry = Telemetry::none;
  scenario.recording.events = false;
  scenario.task.stop_at_violation = false;
  for (UncertainParameter& parameter : scenario.space.parameters) parameter.jitter.reset();
  const Simulation simulation(std::move(scenario), 1);
  std::vector<Particle> particles = {Fabricator(simulation.scenario().world, {}).nominal()};
  particles.front().id = kNominalParticle;
  DriveWatch watch(simulation.scenario());
  TraceRecord record = std::move(Simulator(simulation, policy).run(particles, {.observer = &watch}).front());
  DesignTrace out = watch.take();
  out.record = std::move(record);
  return out;
}

}  // namespace graze
