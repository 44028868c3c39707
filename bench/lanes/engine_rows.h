#pragma once
// A LaneEngine with its state, without the dress of a back end: any instruction set and width.

#include <new>

#include "bench/lanes/trot.h"
#include "engine/lane_physics/lane_engine.h"

namespace graze::bench {

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

/// A block of trotting robots and what its contact solver did.
class TrottingBlock {
 public:
  TrottingBlock(const World& world, const LaneKernel& kernel)
      : nominal_(compile(world)),
        lanes_(kernel.lanes),
        q_(nominal_.nq * lanes_),
        v_(nominal_.nv * lanes_),
        a_(nominal_.nv * lanes_),
        X_(12 * nominal_.bodies.size() * lanes_),
        tau_(nominal_.na() * lanes_),
        engine_(nominal_, kernel, {q_.data(), v_.data(), a_.data(), X_.data()}),
        servos_(world) {
    for (int lane = 0; lane < lanes_; ++lane) {
      const Particle particle = trotting_particle(world, lane);
      engine_.start(lane, particle.model, particle.initial);
    }
  }

  void step() {
    servos_.torques(time_, q_.data(), v_.data(), lanes_, tau_.data());
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

  int lanes() const { return lanes_; }
  double sweeps() const { return sweeps_ / (steps_ * lanes_); }
  double most_sweeps() const { return most_sweeps_ / steps_; }
  double unfinished() const { return static_cast<double>(unfinished_) / steps_; }
  double contacts() const { return contacts_ / steps_; }
  double residual() const { return residual_; }
  double bits() const {  // of the first lane, to compare rows
    double sum = 0;
    for (int i = 0; i < nominal_.nq; ++i) sum += q_[i * lanes_] * (i + 1);
    return sum;
  }

 private:
  Model nominal_;
  int lanes_;
  Rows q_, v_, a_, X_, tau_;
  LaneEngine engine_;
  Servos servos_;
  double time_ = 0, sweeps_ = 0, most_sweeps_ = 0, residual_ = 0, contacts_ = 0;
  long steps_ = 0, unfinished_ = 0;
};

}  // namespace graze::bench
