#pragma once
// A robot, floating, in one lane of a block: everything that a witness may look at, set by hand.

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scenarios/task.h"
#include "tests/reference_kinematics.h"
#include "tests/scenarios/support.h"

namespace graze::testing {

inline void write_poses(const std::vector<Pose>& X_WB, int lane, BlockState& state) {
  for (std::size_t b = 0; b < X_WB.size(); ++b) {
    for (int i = 0; i < 9; ++i) state.X(static_cast<int>(12 * b) + i, lane) = X_WB[b].linear()(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) state.X(static_cast<int>(12 * b) + 9 + i, lane) = X_WB[b].translation()[i];
  }
}

class TaskBench : public ::testing::Test {
 protected:
  static constexpr int kLane = 3;

  TaskBench() : scenario_(read(hopper(""))), model_(scenario_.model), tau_(model_.na()), headroom_(model_.na()) {
    q_ = initial_state(*scenario_.world, model_).q;
    v_ = Eigen::VectorXd::Zero(model_.nv);
    for (int k = 0; k < headroom_.rows(); ++k) headroom_(k, kLane) = 100;
    state_.q = BlockArray(model_.nq);
    state_.v = BlockArray(model_.nv);
    state_.a = BlockArray(model_.nv);
    state_.X = BlockArray(12 * static_cast<int>(model_.bodies.size()));
  }

  Task task(const std::string& yaml) const { return read_task(Settings::parse(yaml, "task.yaml"), model_); }

  /// Margin of one witness in the present state.
  double margin(const std::string& witness) {
    const Task t = task("requirements: {w: " + witness + "}");
    return margin(*t.requirements[0].witness);
  }
  double margin(const Witness& w) {
    BlockArray own(w.numbers());
    w.read(model_, kLane, own);
    const std::unique_ptr<WitnessMemory> memory = w.remember();
    if (memory) memory->start(kLane, model_);
    double out[kLanes];
    WitnessInput in = input();
    in.memory = memory.get();
    double part[kLanes];
    w.evaluate(in, own, out, part);
    return out[kLane];
  }

  const WitnessInput& input(double time = 0) {
    const std::vector<Pose> X_WB = reference_poses(model_, q_);
    write_poses(X_WB, kLane, state_);
    state_.q.set_column(kLane, q_);
    state_.v.set_column(kLane, v_);
    lists_[kLane] = contacts_;
    points_ = lists_.gather();
    std::array<double, kLanes> times{};
    times[kLane] = time;
    input_.reset(new WitnessInput{state_, points_, tau_, headroom_, times, LaneMask(1u << kLane)});
    return *input_;
  }

  int q_of(const char* joint) const { return model_.bodies[model_.joint(joint)].q; }
  int v_of(const char* joint) const { return model_.bodies[model_.joint(joint)].v; }
  int actuator_of(const char* joint) const {
    for (int k = 0; k < model_.na(); ++k) {
      if (model_.bodies[model_.actuated[k]].joint == joint) return k;
    }
    return -1;
  }

  void touch(const char* a, const char* b, double phi, double impulse, Feature feature_b = Feature::surface) {
    Contact c;
    c.a = model_.collider(a);
    c.b = model_.collider(b);
    c.feature_b = feature_b;
    if (c.a > c.b) {
      std::swap(c.a, c.b);
      std::swap(c.feature_a, c.feature_b);
    }
    c.phi = phi;
    c.impulse_W = impulse * c.n_W;
    contacts_.push_back(c);
  }

  Scenario scenario_;
  const Model& model_;
  Eigen::VectorXd q_, v_;
  BlockState state_;
  BlockArray tau_, headroom_;
  std::vector<Contact> contacts_;
  ContactLists lists_;
  std::vector<ContactPoint> points_;
  std::unique_ptr<WitnessInput> input_;
};

}  // namespace graze::testing
