#pragma once
// What is known of a robot's state at a moment, and the states that particles begin in because of what is not known.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/sensing/sensors.h"
#include "scenarios/scenario.h"
#include "simulation/saved_trace.h"

namespace graze {

struct StateEstimate {
  double time = 0;  // s on the scenario's clock, a whole number of control periods
  State state;      // the best guess: q [nq], v [nv]
  // Of what is true less what is estimated, [2 nv, 2 nv], in the order of coordinates(). Empty: nothing is in doubt.
  Eigen::MatrixXd covariance;
  // The state is what sensors read, persistent errors included: a particle has its own (biases of its channels, zeros
  // of its encoders), which are taken out of where it begins. `covariance` is then of what is left.
  bool read_by_sensors = false;
  std::shared_ptr<const ControllerMemory> memory;  // of this moment; null: candidates start afresh
};

/// The rows of a covariance: nv positions in the order of v, then nv velocities. A floating body's orientation errs by
/// a rotation vector in world axes, rad, its place in m; joints in rad or m; velocities in these per second.
/// "position.base.wx", "velocity.LF_X_1".
std::vector<std::string> coordinates(const Model& model);

/// What the sensors read in a lane of an observation, with the jitter of the scenario's channels (Eq. 14) as
/// covariance: encoders, position, attitude and state estimate. Joints without encoder and objects are as in `others`,
/// without doubt.
StateEstimate read_estimate(const Scenario& scenario, const Observation& sensed, int lane, const State& others);

/// Draws the states in which particles begin. Constant, so that any number of threads may share one.
class EstimateDraws {
 public:
  /// `estimate` outlives this. Draws are keyed by the seed, the particle, the coordinate and the estimate's control
  /// step. Throws InputError if the sizes do not fit, or the covariance is none; it names the coordinate.
  EstimateDraws(const Scenario& scenario, const StateEstimate& estimate);
  /// The state of a particle, joints that follow others in keeping with them.
  State draw(const Particle& particle) const;

 private:
  void take_out_errors(const Particle& particle, Eigen::VectorXd& error) const;

  /// What a coordinate's sensor channels add to it, `sign` times a bias; channel -1: a joint's zero of this actuator.
  struct Source {
    int coordinate, channel, actuator;
  };
  const Model* model_;
  const StateEstimate* estimate_;
  std::uint64_t seed_;
  std::uint32_t step_;
  std::vector<std::uint64_t> names_;  // hashes, of coordinates()
  Eigen::MatrixXd factor_;            // lower, of the covariance; empty: none
  std::vector<Source> sources_;       // of persistent errors; empty: the state was not read by sensors
  Mat3 turn_ = Mat3::Identity();      // rotation vector of small changes of roll, pitch and yaw
};

}  // namespace graze
