// How fast the lane engine steps LINKS (18 degrees of freedom), trotting by joint servo on a plane, 1 ms steps, feet
// making and breaking contact: particle-steps per second of one thread's processor time, by instruction set and number
// of lanes, with the contact solver's effort and residual. Usage: bench_lanes [seconds per row] [isa]

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/isa.h"
#include "engine/model/urdf.h"
#include "sampling/stream.h"

namespace {

using namespace graze;

constexpr double kStep = 1e-3;  // s

World links_on_plane() {
  World world;
  world.robot = load_urdf(std::string(GRAZE_SOURCE_DIR) + "/data/robots/links.urdf");
  Object ground;
  ground.name = "ground";
  ground.shape.kind = ShapeKind::plane;
  world.objects.push_back(ground);
  // The published robot collides by torso and feet only.
  world.contact.ignore = {{"*_LEG_*", "*"}};
  world.initial.on_ground = true;
  world.initial.clearance = 0.005;
  for (const Joint& joint : world.robot.joints) {
    const bool left_front = joint.name.starts_with("LF") || joint.name.starts_with("RH");
    const double sign = left_front ? 1 : -1;
    if (joint.name.ends_with("X_1")) world.initial.joint_position[joint.name] = 0.2 * sign;
    if (joint.name.ends_with("Y_2")) world.initial.joint_position[joint.name] = 0.8 * sign;
    if (joint.name.ends_with("Y_3")) world.initial.joint_position[joint.name] = 1.2 * sign;
  }
  return world;
}

/// A block of slightly different robots, its servos and its clock.
class Trot {
 public:
  Trot(const World& world, const LaneKernel& kernel)
      : nominal_(compile(world)),
        initial_(initial_state(world, nominal_)),
        lanes_(kernel.lanes),
        q_(nominal_.nq * lanes_),
        v_(nominal_.nv * lanes_),
        a_(nominal_.nv * lanes_),
        X_(12 * nominal_.bodies.size() * lanes_),
        tau_(nominal_.na() * lanes_),
        engine_(nominal_, kernel, {q_.data(), v_.data(), a_.data(), X_.data()}) {
    for (int lane = 0; lane < lanes_; ++lane) start(lane);
    add_servos();
  }

  void step() {
    servo();
    engine_.step(kStep, (1u << lanes_) - 1u, tau_.data());
    time_ += kStep;
    ++steps_;
    double most = 0;
    for (int lane = 0; lane < lanes_; ++lane) {
      sweeps_ += engine_.sweeps(lane);
      most = std::max(most, engine_.sweeps(lane));
      residual_ = std::max(residual_, engine_.residual(lane));
    }
    most_sweeps_ += most;
    if (most >= engine_.block().settings.most_sweeps) ++unfinished_;
    contacts_ += engine_.block().contact_count;
  }

  double most_sweeps() const { return most_sweeps_ / steps_; }
  double unfinished() const { return static_cast<double>(unfinished_) / steps_; }
  double sweeps() const { return sweeps_ / (steps_ * lanes_); }
  double contacts() const { return contacts_ / steps_; }
  double residual() const { return residual_; }
  double height(int lane) const { return q_[6 * lanes_ + lane]; }
  double forward(int lane) const { return q_[4 * lanes_ + lane]; }
  double bits() const {  // of the first lane, to compare rows
    double sum = 0;
    for (int i = 0; i < nominal_.nq; ++i) sum += q_[i * lanes_] * (i + 1);
    return sum;
  }

 private:
  void start(int lane) {
    Model model = nominal_;
    const auto spread = [&](const char* name) { return 2 * uniform(1, lane, name_hash(name), 0) - 1; };
    for (Body& body : model.bodies) {
      const double factor = 1 + 0.05 * spread(body.name.c_str());
      body.mass *= factor;
      body.inertia *= factor;
      body.damping = 0.2;  // N m s/rad: the servo's damping, implicit (shins are too light for an explicit one at 1 ms)
    }
    for (ColliderPair& pair : model.pairs) pair.friction *= 1 + 0.2 * spread("friction");
    State state = initial_;
    for (int body : model.actuated) state.q[model.bodies[body].q] += 0.02 * spread(model.bodies[body].joint.c_str());
    engine_.start(lane, model, state);
  }

  /// What a joint's servo does: hold the initial angle, and swing.
  struct Servo {
    int row;                   // in q
    double rest, swing, lift;  // rad
    bool first;                // of the diagonal pairs of legs
  };

  void add_servos() {
    for (int index : nominal_.actuated) {
      const Body& body = nominal_.bodies[index];
      const double rest = initial_.q[body.q];
      servos_.push_back({body.q, rest, body.joint.ends_with("Y_2") ? 0.1 : 0,
                         body.joint.ends_with("Y_3") ? std::copysign(0.25, rest) : 0,
                         body.joint.starts_with("LF") || body.joint.starts_with("RH")});
    }
  }

  /// Diagonal legs swing together, twice a second: the foot is lifted by the knee while the hip brings it forward.
  void servo() {
    const double phase = 2 * std::numbers::pi * 2 * time_, s = std::sin(phase), c = std::cos(phase);
    for (std::size_t k = 0; k < servos_.size(); ++k) {
      const Servo& servo = servos_[k];
      const double sign = servo.first ? 1 : -1;
      const double target = servo.rest + servo.swing * sign * c + servo.lift * std::max(0.0, sign * s);
      const double* q = &q_[servo.row * lanes_];
      double* tau = &tau_[k * lanes_];
      for (int lane = 0; lane < lanes_; ++lane) tau[lane] = std::clamp(8 * (target - q[lane]), -7.3, 7.3);
    }
  }

  template <class A>
  struct Aligned {
    using value_type = A;
    Aligned() = default;
    template <class B>
    explicit Aligned(const Aligned<B>&) {}
    A* allocate(std::size_t n) { return static_cast<A*>(::operator new(n * sizeof(A), std::align_val_t(64))); }
    void deallocate(A* p, std::size_t) { ::operator delete(p, std::align_val_t(64)); }
    bool operator==(const Aligned&) const { return true; }
  };
  using Rows = std::vector<double, Aligned<double>>;

  Model nominal_;
  State initial_;
  int lanes_;
  Rows q_, v_, a_, X_, tau_;
  LaneEngine engine_;
  std::vector<Servo> servos_;
  double time_ = 0, sweeps_ = 0, residual_ = 0, contacts_ = 0;
  double most_sweeps_ = 0;
  long steps_ = 0, unfinished_ = 0;
};

/// Processor time of this thread, s: what others do on the machine does not count.
double now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void run_row(const World& world, Isa isa, int lanes, double seconds) {
  Trot trot(world, kernel_of(isa, lanes));
  for (int i = 0; i < 500; ++i) trot.step();
  const double bits = trot.bits();
  long steps = 0;
  const double begin = now();
  double elapsed = 0;
  while (elapsed < seconds) {
    for (int i = 0; i < 100; ++i) trot.step();
    steps += 100;
    elapsed = now() - begin;
  }
  fmt::print("{:9} {:5} {:12.0f} {:9.3f} {:8.2f} {:8.2f} {:8.4f} {:8.2f} {:10.1e} {:7.3f} {:7.3f}  {:a}\n",
             isa_name(isa), lanes, steps * lanes / elapsed, 1e6 * elapsed / (steps * lanes), trot.sweeps(),
             trot.most_sweeps(), trot.unfinished(), trot.contacts(), trot.residual(), trot.height(0), trot.forward(0),
             bits);
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 1.0;
  const World world = links_on_plane();
  fmt::print("{:9} {:>5} {:>12} {:>9} {:>8} {:>8} {:>8} {:>8} {:>10} {:>7} {:>7}  {}\n", "isa", "lanes", "steps/s",
             "us/step", "sweeps", "of block", "cut", "contacts", "residual", "height", "way",
             "bits of lane 0 after 0.5 s");
  for (Isa isa : available_isas()) {
    if (argc > 2 && isa_name(isa) != argv[2]) continue;
    run_row(world, isa, 8, seconds);
    if (isa == Isa::avx2) run_row(world, isa, 4, seconds);
    run_row(world, isa, 1, seconds);
  }
}
