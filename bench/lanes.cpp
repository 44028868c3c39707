// What the lane engine costs, one thread, processor time, 1 ms steps. Four tables:
//   isa       LINKS (18 degrees of freedom) trots on a plane by joint servo, feet making and breaking contact: steps by
//             instruction set and number of lanes, with the contact solver's effort
//   bullet    the same robot and motion through the public interface, lanes against Bullet's solvers, each with its
//             contact residuals in one measure (lanes/residuals.h)
//   chains    growth with degrees of freedom: chains of 6 to 60 joints, hanging and lying on a plane
//   contacts  growth with contacts, 1 to 64
// Usage: bench_lanes [seconds per row] [table or instruction set ...]

#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/lanes/clock.h"
#include "bench/lanes/engine_rows.h"
#include "bench/lanes/residuals.h"
#include "bench/lanes/trot.h"
#include "bench/lanes/worlds.h"
#include "engine/lane_physics/lane_physics.h"
#include "engine/lanes/isa.h"
#include "engine/physics.h"

namespace {

using namespace graze;
using namespace graze::bench;

void isa_row(const World& world, Isa isa, int lanes, double seconds) {
  TrottingBlock block(world, kernel_of(isa, lanes));
  for (int i = 0; i < 500; ++i) block.step();
  const double bits = block.bits();
  const double step = time_of(seconds, 100, [&] { block.step(); }) / lanes;
  fmt::print("{:9} {:5} {:12.0f} {:9.3f} {:8.2f} {:8.2f} {:8.4f} {:8.2f} {:10.1e}  {:a}\n", isa_name(isa), lanes,
             1 / step, 1e6 * step, block.sweeps(), block.most_sweeps(), block.unfinished(), block.contacts(),
             block.residual(), bits);
}

void isa_table(double seconds, const std::string& only) {
  const World world = links_on_plane();
  fmt::print("{:9} {:>5} {:>12} {:>9} {:>8} {:>8} {:>8} {:>8} {:>10}  {}\n", "isa", "lanes", "steps/s", "us/step",
             "sweeps", "of block", "cut", "contacts", "residual", "bits of lane 0 after 0.5 s");
  for (Isa isa : available_isas()) {
    if (!only.empty() && isa_name(isa) != only) continue;
    isa_row(world, isa, 8, seconds);
    if (isa == Isa::avx2) isa_row(world, isa, 4, seconds);
    isa_row(world, isa, 1, seconds);
  }
}

/// LINKS in a back end, eight lanes. A lane that its back end finds at fault starts anew.
class BackEndTrot {
 public:
  BackEndTrot(const std::string& back_end, const std::string& contact_model, const Gains& gains)
      : world_(links_on_plane()), servos_(world_, gains) {
    world_.contact.model = contact_model;
    for (int lane = 0; lane < kLanes; ++lane) particles_.push_back(trotting_particle(world_, lane, gains));
    physics_ = make_physics(back_end, particles_[0].model);
    for (int lane = 0; lane < kLanes; ++lane) physics_->start(lane, particles_[lane]);
    tau_ = BlockArray(particles_[0].model.na());
  }

  void step() {
    const BlockState& now = physics_->state();
    servos_.torques(time_, now.q.row(0), now.v.row(0), kLanes, tau_.row(0));
    physics_->step(kStep, LaneMask::all(), tau_);
    time_ += kStep;
    ++steps_;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!physics_->fault(lane)) continue;
      physics_->start(lane, particles_[lane]);
      ++faults_;
    }
  }

  /// Contact residuals of all lanes over two periods of the trot.
  Residual residual() {
    Residual out;
    std::vector<ResidualMeter> meters;
    for (const Particle& particle : particles_) meters.emplace_back(particle.model);
    for (int i = 0; i < 1000; ++i) {
      const long faults = faults_;
      for (int lane = 0; lane < kLanes; ++lane) meters[lane].before(*physics_, lane);
      step();
      if (faults_ > faults) continue;  // what stands there now is a fresh start
      for (int lane = 0; lane < kLanes; ++lane) meters[lane].after(*physics_, lane, kStep, out);
    }
    return out;
  }

  double faults() const { return static_cast<double>(faults_) / (kLanes * kStep * static_cast<double>(steps_)); }

 private:
  World world_;
  Servos servos_;
  std::vector<Particle> particles_;
  std::unique_ptr<BlockPhysics> physics_;
  BlockArray tau_;
  double time_ = 0;
  long steps_ = 0, faults_ = 0;
};

void bullet_table(const Gains& gains, double seconds) {
  fmt::print("\nservos of {} N m/rad, damping {} N m s/rad explicit, {} implicit\n", gains.stiffness, gains.rate,
             gains.damping);
  fmt::print("{:7} {:22} {:>9} {:>8} {:>9} {:>8}", "", "contact model", "steps/s", "us/step", "x dantzig", "faults/s");
  for (const char* name : Residual::kNames) fmt::print(" | {:>15} {:>7}", name, "most");
  fmt::print(" | mm deep\n");
  double dantzig = 0;
  for (const auto& [back_end, model] :
       std::vector<std::pair<std::string, std::string>>{{"bullet", "dantzig"},
                                                        {"bullet", "sequential_impulse"},
                                                        {"bullet", "projected_gauss_seidel"},
                                                        {"lanes", "complementarity"},
                                                        {"lanes", "complementarity_free"},
                                                        {"lanes", "compliant"}}) {
    BackEndTrot trot(back_end, model, gains);
    for (int i = 0; i < 500; ++i) trot.step();
    const Residual residual = trot.residual();
    const double step = time_of(seconds, 100, [&] { trot.step(); }) / kLanes;
    if (model == "dantzig") dantzig = step;
    fmt::print("{:7} {:22} {:9.0f} {:8.3f} {:9.2f} {:8.3f}", back_end, model, 1 / step, 1e6 * step, dantzig / step,
               trot.faults());
    for (int i = 0; i < 4; ++i) fmt::print(" | {:15.1e} {:7.0e}", residual.mean(i), residual.most[i]);
    fmt::print(" | {:.3f}\n", 1e3 * residual.depth);
  }
}

/// Steps eight equal particles of a world in the lane engine; `push`: torque or force of all actuators at time t.
template <class Push>
void growth_row(const std::string& name, World world, double seconds, Push push) {
  world.contact.model = "complementarity";
  Particle particle;
  particle.model = compile(world);
  particle.initial = initial_state(world, particle.model);
  const auto physics = make_physics("lanes", particle.model);
  for (int lane = 0; lane < kLanes; ++lane) physics->start(lane, particle);
  BlockArray tau(particle.model.na());
  double time = 0, points = 0, sweeps = 0, steps = 0;
  const auto* lanes = dynamic_cast<const LanePhysics*>(physics.get());
  const auto step = [&] {
    for (int k = 0; k < tau.rows(); ++k) std::fill_n(tau.row(k), kLanes, push(k, time));
    physics->step(kStep, LaneMask::all(), tau);
    time += kStep;
    points += static_cast<double>(physics->contact_points().size());
    sweeps += lanes->sweeps(0);
    ++steps;
  };
  for (int i = 0; i < 500; ++i) step();
  points = sweeps = steps = 0;
  const double us = 1e6 * time_of(seconds, 20, step) / kLanes;
  fmt::print("{:16} {:4} {:9.1f} {:7.1f} {:12.0f} {:9.3f} {:11.4f}  {}\n", name, particle.model.nv, points / steps,
             sweeps / steps, 1e6 / us, us, us / particle.model.nv, physics->fault(0).value_or(""));
}

void growth_head() {
  fmt::print("\n{:16} {:>4} {:>9} {:>7} {:>12} {:>9} {:>11}\n", "", "dof", "contacts", "sweeps", "steps/s", "us/step",
             "us/step/dof");
}

void chains_table(double seconds) {
  growth_head();
  for (const bool lying : {false, true}) {
    for (int joints : {6, 12, 24, 36, 48, 60}) {
      growth_row(fmt::format("{} {}", lying ? "lying" : "hanging", joints), chain(joints, lying), seconds,
                 [](int k, double t) { return 1e-3 * std::sin(10 * t + k); });
    }
  }
}

void contacts_table(double seconds) {
  growth_head();
  const auto circle = [](int k, double t) {  // N: drags the table along, lets it stick and slip
    return k == 0 ? 4 * std::cos(6 * t) : k == 1 ? 4 * std::sin(6 * t) : 0;
  };
  for (int feet : {1, 2, 4, 8, 16, 32, 64}) growth_row(fmt::format("table {}", feet), table(feet), seconds, circle);
  for (int count : {1, 2, 4, 8, 16, 32, 64}) {
    growth_row(fmt::format("balls {}", count), balls(count), seconds, [](int, double) { return 0.0; });
  }
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 1.0;
  std::vector<std::string> parts(argv + std::min(argc, 2), argv + argc);
  if (parts.empty()) parts = {"isa", "bullet", "chains", "contacts"};
  for (const std::string& part : parts) {
    if (part == "bullet") {
      bullet_table(kExplicit, seconds);
      bullet_table(kImplicit, seconds);
    } else if (part == "chains") {
      chains_table(seconds);
    } else if (part == "contacts") {
      contacts_table(seconds);
    } else {
      isa_table(seconds, part == "isa" ? "" : part);
    }
  }
}
