// What Bullet costs: particle-steps per second of the LINKS robot trotting on a plane under joint servos, by contact
// model; the cost of start(); and where the time of a step goes.

#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <cmath>

#include "engine/bullet/world.h"
#include "engine/model/urdf.h"
#include "engine/physics.h"

namespace graze {
namespace {

constexpr double kStep = 1e-3;                     // s
constexpr double kStiffness = 4, kDamping = 0.02;  // N m/rad, N m s/rad

Particle links_on_a_plane(const std::string& contact_model) {
  World world;
  world.robot = load_urdf(GRAZE_SOURCE_DIR "/data/robots/links.urdf");
  Object ground;
  ground.name = "ground";
  ground.shape.kind = ShapeKind::plane;
  world.objects.push_back(ground);
  world.contact.model = contact_model;
  world.initial.on_ground = true;
  world.contact.ignore.push_back({"*_LEG_*", "ground"});  // feet and torso touch the ground, as published
  for (const std::string leg : {"LF", "RF", "LH", "RH"}) {
    const double sign = leg == "LF" || leg == "RH" ? 1 : -1;
    world.initial.joint_position[leg + "_X_1"] = 0.2 * sign;
    world.initial.joint_position[leg + "_Y_2"] = 0.8 * sign;
    world.initial.joint_position[leg + "_Y_3"] = 1.2 * sign;
  }
  Particle particle;
  particle.model = compile(world);
  particle.initial = initial_state(world, particle.model);
  return particle;
}

/// Sinusoidal servo of diagonal legs in antiphase, 2 Hz, 0.15 rad.
struct Trot {
  std::vector<int> q, v;
  std::vector<double> start, phase;

  explicit Trot(const Particle& particle) {
    for (int body : particle.model.actuated) {
      const Body& b = particle.model.bodies[body];
      q.push_back(b.q);
      v.push_back(b.v);
      start.push_back(particle.initial.q[b.q]);
      phase.push_back(b.joint.rfind("LF", 0) == 0 || b.joint.rfind("RH", 0) == 0 ? 0 : M_PI);
    }
  }
  double torque(int k, double t, double q_now, double v_now) const {
    const double target = start[k] + 0.15 * std::sin(4 * M_PI * t + phase[k]);
    return kStiffness * (target - q_now) - kDamping * v_now;
  }
};

// Eight lanes that trot; a lane starts afresh every 2 s.
void trot(benchmark::State& state, const std::string& contact_model) {
  const Particle particle = links_on_a_plane(contact_model);
  const Trot servo(particle);
  const auto physics = make_physics("bullet", particle.model);
  BlockArray tau(particle.model.na());
  long step = 0, contacts = 0;
  for (auto _ : state) {
    if (step % 2000 == 0) {
      state.PauseTiming();
      for (int lane = 0; lane < kLanes; ++lane) physics->start(lane, particle);
      state.ResumeTiming();
    }
    const BlockState& now = physics->state();
    for (int k = 0; k < tau.rows(); ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        tau(k, lane) = servo.torque(k, kStep * (step % 2000), now.q(servo.q[k], lane), now.v(servo.v[k], lane));
      }
    }
    physics->step(kStep, LaneMask::all(), tau);
    contacts += static_cast<long>(physics->contacts(0).size());
    ++step;
    if (physics->fault(0)) state.SkipWithError(physics->fault(0)->c_str());
  }
  state.counters["particle-steps/s"] =
      benchmark::Counter(static_cast<double>(step * kLanes), benchmark::Counter::kIsRate);
  state.counters["points"] = static_cast<double>(contacts) / static_cast<double>(step);
}
BENCHMARK_CAPTURE(trot, sequential_impulse, std::string("sequential_impulse"));
BENCHMARK_CAPTURE(trot, dantzig, std::string("dantzig"));
BENCHMARK_CAPTURE(trot, projected_gauss_seidel, std::string("projected_gauss_seidel"));

void start(benchmark::State& state) {
  const Particle particle = links_on_a_plane("sequential_impulse");
  const auto physics = make_physics("bullet", particle.model);
  for (auto _ : state) physics->start(0, particle);
}
BENCHMARK(start);

/// Adds the time until its end to a sum.
class Clock {
 public:
  explicit Clock(double& sum) : sum_(sum), start_(std::chrono::steady_clock::now()) {}
  ~Clock() { sum_ += std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  double& sum_;
  std::chrono::steady_clock::time_point start_;
};

// The step of engine/bullet/world.cpp taken apart: microseconds of contact detection, articulated-body algorithm,
// contact solver and integration (Bullet's work), and of all else (conversion, contacts, energy).
void parts(benchmark::State& state) {
  const Particle particle = links_on_a_plane("sequential_impulse");
  const Model& model = particle.model;
  const Trot servo(particle);
  bullet::HullCache hulls;
  bullet::Forest forest(model, particle.initial);
  std::vector<bullet::Solid> solids = bullet::make_solids(model, forest, hulls);
  bullet::NarrowPhase narrow(model, solids);
  bullet::ContactSet set(model, solids);
  const auto solver = bullet::make_contact_solver(model.contact_model);
  bullet::EnergyWatch energy(model, forest);
  std::vector<btMultiBodyConstraint*> rows;
  std::vector<Contact> contacts;
  Eigen::VectorXd force = Eigen::VectorXd::Zero(model.nv);
  std::array<double, 4> spent{};
  double whole = 0;
  long step = 0;
  for (auto _ : state) {
    const Clock all(whole);
    for (std::size_t k = 0; k < servo.q.size(); ++k) {
      force[servo.v[k]] =
          servo.torque(static_cast<int>(k), kStep * step, forest.q()[servo.q[k]], forest.v()[servo.v[k]]);
    }
    const std::vector<bullet::NearPair>* near;
    {
      const Clock part(spent[0]);
      near = &narrow.detect(2 * kStep);
    }
    set.prepare(*near, forest, kStep);
    {
      const Clock part(spent[1]);
      forest.set_forces(force);
      forest.accelerate(kStep);
    }
    if (!set.manifolds().empty()) {
      const Clock part(spent[2]);
      for (bullet::Tree& tree : forest.trees()) tree.body->setCompanionId(-1);
      solver->solve(set.manifolds(), rows, false, kStep, narrow.dispatcher());
    }
    forest.apply_impulses();
    forest.refresh_twists();
    set.read(set.manifolds().empty() ? nullptr : solver.get(), forest, kStep);
    {
      const Clock part(spent[3]);
      forest.move(kStep);
    }
    forest.refresh();
    bullet::place_solids(solids, forest);
    set.place(contacts);
    benchmark::DoNotOptimize(energy.check(forest, {kStep, 1, 0, 0}));
    ++step;
  }
  const std::array<const char*, 4> names = {"detect_us", "accelerate_us", "solve_us", "move_us"};
  double inside = 0;
  for (int i = 0; i < 4; ++i) {
    state.counters[names[i]] = spent[i] / static_cast<double>(step);
    inside += spent[i];
  }
  state.counters["ours_us"] = (whole - inside) / static_cast<double>(step);
  state.counters["ours_share"] = (whole - inside) / whole;
}
BENCHMARK(parts);

}  // namespace
}  // namespace graze

BENCHMARK_MAIN();
