#include "simulation/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/lanes/scalar.h"
#include "engine/model/rotation.h"
#include "sampling/stream.h"
#include "simulation/names.h"

namespace graze {
namespace {

constexpr double kVarianceSlack = 1e-9;  // of a variance, by which sums of products may miss it

/// A sensor channel and the coordinate that it reads.
struct ReadCoordinate {
  int coordinate;
  std::string channel;
  int actuator = -1;  // whose encoder it is, of positions
};

/// Those of a robot, in the order of coordinates(). The attitude's channels are of roll, pitch and yaw.
std::vector<ReadCoordinate> read_coordinates(const Model& model) {
  std::vector<ReadCoordinate> out;
  const int nv = model.nv;
  const char* xyz[] = {"x", "y", "z"};
  const char* rpy[] = {"roll", "pitch", "yaw"};
  for (int k = 0; k < 3 && model.floating_base; ++k) {
    const int turn = model.bodies.front().v + k, place = turn + 3;
    out.push_back({turn, std::string("sensor.magnetometer.") + rpy[k]});
    out.push_back({place, k < 2 ? std::string("sensor.gps.") + xyz[k] : "sensor.estimate.z"});
    out.push_back({nv + turn, std::string("sensor.estimate.rate.") + rpy[k]});
    out.push_back({nv + place, std::string("sensor.estimate.velocity.") + xyz[k]});
  }
  for (int k = 0; k < model.na(); ++k) {
    const Body& body = model.bodies[static_cast<std::size_t>(model.actuated[static_cast<std::size_t>(k)])];
    out.push_back({body.v, "sensor.encoder." + body.joint + ".position", k});
    out.push_back({nv + body.v, "sensor.encoder." + body.joint + ".velocity"});
  }
  return out;
}

/// Columns: the rotation vectors (world axes) of small changes of roll, pitch and yaw.
Mat3 turn_of_angles(const Mat3& R) {
  const Vec3 rpy = rpy_from_rotation(R);
  const Mat3 yaw = rotation_about(Vec3::UnitZ(), rpy.z());
  Mat3 out;
  out.col(0) = yaw * rotation_about(Vec3::UnitY(), rpy.y()).col(0);
  out.col(1) = yaw.col(1);
  out.col(2) = Vec3::UnitZ();
  return out;
}

Quat quaternion_at(const Eigen::VectorXd& q, int at) { return {q[at], q[at + 1], q[at + 2], q[at + 3]}; }

void set_quaternion(const Quat& turn, int at, Eigen::VectorXd& q) {
  q[at] = turn.w(), q[at + 1] = turn.x(), q[at + 2] = turn.y(), q[at + 3] = turn.z();
}

Quat turned_by(const Vec3& rotation, const Quat& turn) {
  const double angle = rotation.norm();
  if (angle == 0) return turn;
  const auto [s, c] = pinned::sin_cos(angle / 2);
  const Vec3 v = s / angle * rotation;
  return (Quat(c, v.x(), v.y(), v.z()) * turn).normalized();
}

/// q moved by small errors in the order of v.
void displace(const Model& model, const Eigen::VectorXd& error, Eigen::VectorXd& q) {
  for (const Body& body : model.bodies) {
    if (body.type == JointType::floating) {
      set_quaternion(turned_by(error.segment<3>(body.v), quaternion_at(q, body.q)), body.q, q);
      q.segment<3>(body.q + 4) += error.segment<3>(body.v + 3);
    } else {
      q[body.q] += error[body.v];
    }
  }
}

/// Joints that follow others stand where these have them.
void follow(const Model& model, State& state) {
  for (const Body& body : model.bodies) {
    if (body.mimics < 0) continue;
    const Body& other = model.bodies[static_cast<std::size_t>(body.mimics)];
    state.q[body.q] = body.multiplier * state.q[other.q] + body.offset;
    state.v[body.v] = body.multiplier * state.v[other.v];
  }
}

[[noreturn]] void refuse_covariance(const std::vector<std::string>& names, int row, const std::string& why) {
  throw InputError(
      fmt::format("the covariance of an estimate: row {} ({}): {}", row, names[static_cast<std::size_t>(row)], why));
}

void check_covariance(const Eigen::MatrixXd& covariance, const std::vector<std::string>& names) {
  const auto size = static_cast<Eigen::Index>(names.size());
  if (covariance.rows() != size || covariance.cols() != size) {
    throw InputError(
        fmt::format("the covariance of an estimate has {} rows and {} columns; it has {} of each, nv of "
                    "positions and nv of velocities",
                    covariance.rows(), covariance.cols(), size));
  }
  for (int i = 0; i < size; ++i) {
    for (int k = 0; k <= i; ++k) {
      const double one = covariance(i, k), other = covariance(k, i);
      if (!std::isfinite(one) || !std::isfinite(other)) refuse_covariance(names, i, "a number that is not finite");
      if (std::abs(one - other) > kVarianceSlack * std::max(std::abs(one), std::abs(other))) {
        refuse_covariance(names, i, fmt::format("{} in column {}, but {} the other way", one, k, other));
      }
    }
    if (covariance(i, i) < 0) {
      refuse_covariance(names, i, fmt::format("a variance of {}; it must be >= 0", covariance(i, i)));
    }
  }
}

/// Lower factor L of a positive semi-definite matrix L L^T; what is certain has a row of zeros.
Eigen::MatrixXd factor_of(const Eigen::MatrixXd& C, const std::vector<std::string>& names) {
  const int size = static_cast<int>(names.size());
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(size, size);
  for (int k = 0; k < size; ++k) {
    double pivot = C(k, k);
    for (int j = 0; j < k; ++j) pivot -= L(k, j) * L(k, j);
    const bool certain = pivot <= kVarianceSlack * C(k, k);
    if (pivot < -kVarianceSlack * C(k, k)) refuse_covariance(names, k, "the matrix is not positive semi-definite here");
    if (!certain) L(k, k) = std::sqrt(pivot);
    for (int i = k + 1; i < size; ++i) {
      double rest = C(i, k);
      for (int j = 0; j < k; ++j) rest -= L(i, j) * L(k, j);
      if (!certain) L(i, k) = rest / L(k, k);
      // What is certain already, or follows from the rows before, has nothing more in common with another.
      if (certain && rest * rest > 1e-6 * C(i, i) * C(k, k)) {
        refuse_covariance(names, i, "the matrix is not positive semi-definite here");
      }
    }
  }
  return L;
}

}  // namespace

std::vector<std::string> coordinates(const Model& model) {
  std::vector<std::string> out;
  const std::vector<std::string> names = trace_names(model).v_names;
  for (const char* kind : {"position.", "velocity."}) {
    for (const std::string& name : names) out.push_back(kind + name);
  }
  return out;
}

StateEstimate read_estimate(const Scenario& scenario, const Observation& sensed, int lane, const State& others) {
  const Model& model = scenario.model;
  StateEstimate out;
  out.time = sensed.time[static_cast<std::size_t>(lane)];
  out.state = others;
  out.read_by_sensors = true;
  auto& [q, v] = out.state;
  Mat3 turn = Mat3::Identity();
  if (model.floating_base) {
    const Body& base = model.bodies.front();
    const Mat3 R = rotation_from_rpy(sensed.base_rpy.vec3(0, lane));
    turn = turn_of_angles(R);
    set_quaternion(Quat(R).normalized(), base.q, q);
    q.segment<3>(base.q + 4) = sensed.base_position.vec3(0, lane);
    v.segment<3>(base.v) = sensed.base_rate.vec3(0, lane);
    v.segment<3>(base.v + 3) = sensed.base_velocity.vec3(0, lane);
  }
  for (int k = 0; k < model.na(); ++k) {
    const Body& body = model.bodies[static_cast<std::size_t>(model.actuated[static_cast<std::size_t>(k)])];
    q[body.q] = sensed.joint_position(k, lane);
    v[body.v] = sensed.joint_velocity(k, lane);
  }
  follow(model, out.state);
  const std::vector<std::string> channels = channel_names(scenario.world->robot);
  const SensorNoise noise = sensor_noise(scenario, scenario.seed);
  out.covariance = Eigen::MatrixXd::Zero(2 * model.nv, 2 * model.nv);
  for (const ReadCoordinate& one : read_coordinates(model)) {
    const auto channel = std::find(channels.begin(), channels.end(), one.channel) - channels.begin();
    const auto& jitter = noise.jitter.at(static_cast<std::size_t>(channel));
    const double std = jitter ? jitter->std() : 0.0;
    out.covariance(one.coordinate, one.coordinate) = std * std;
  }
  if (!model.floating_base) return out;
  const int at = model.bodies.front().v;
  const Mat3 angles = out.covariance.block<3, 3>(at, at);
  out.covariance.block<3, 3>(at, at) = turn * angles * turn.transpose();
  return out;
}

EstimateDraws::EstimateDraws(const Scenario& scenario, const StateEstimate& estimate)
    : model_(&scenario.model), estimate_(&estimate), seed_(scenario.seed) {
  const auto& [q, v] = estimate.state;
  if (q.size() != model_->nq || v.size() != model_->nv) {
    throw InputError(fmt::format("an estimate of {} positions and {} velocities; the model has {} and {}", q.size(),
                                 v.size(), model_->nq, model_->nv));
  }
  step_ = static_cast<std::uint32_t>(std::round(estimate.time / scenario.timing.control));
  const std::vector<std::string> names = coordinates(*model_);
  for (const std::string& name : names) names_.push_back(name_hash("estimate." + name));
  if (estimate.covariance.size() > 0) {
    check_covariance(estimate.covariance, names);
    factor_ = factor_of(estimate.covariance, names);
  }
  if (!estimate.read_by_sensors) return;
  const std::vector<std::string> channels = channel_names(scenario.world->robot);
  for (const ReadCoordinate& one : read_coordinates(*model_)) {
    const auto channel = std::find(channels.begin(), channels.end(), one.channel) - channels.begin();
    sources_.push_back({one.coordinate, static_cast<int>(channel), one.actuator});
  }
  if (model_->floating_base) {
    turn_ = turn_of_angles(quaternion_at(q, model_->bodies.front().q).normalized().toRotationMatrix());
  }
}

/// A reading is the truth plus its channel's bias, an encoder's position less the joint's zero (Sensors::start).
void EstimateDraws::take_out_errors(const Particle& particle, Eigen::VectorXd& error) const {
  if (sources_.empty()) return;
  Eigen::VectorXd own = Eigen::VectorXd::Zero(error.size());
  for (const Source& one : sources_) {
    const auto channel = static_cast<std::size_t>(one.channel);
    if (channel < particle.sensor_bias.size()) own[one.coordinate] -= particle.sensor_bias[channel];
    if (one.actuator >= 0) own[one.coordinate] += particle.joint_zero[static_cast<std::size_t>(one.actuator)];
  }
  if (model_->floating_base) {
    const int at = model_->bodies.front().v;
    const Vec3 angles = own.segment<3>(at);
    own.segment<3>(at) = turn_ * angles;
  }
  error += own;
}

State EstimateDraws::draw(const Particle& particle) const {
  State out = estimate_->state;
  Eigen::VectorXd error = Eigen::VectorXd::Zero(2 * model_->nv);
  if (factor_.size() > 0) {
    Eigen::VectorXd z(factor_.rows());
    for (int i = 0; i < z.size(); ++i) {
      z[i] = normal_quantile(uniform(seed_, particle.id, names_[static_cast<std::size_t>(i)], step_));
    }
    for (int i = 0; i < z.size(); ++i) {
      for (int k = 0; k <= i; ++k) error[i] += factor_(i, k) * z[k];
    }
  }
  take_out_errors(particle, error);
  displace(*model_, error.head(model_->nv), out.q);
  out.v += error.tail(model_->nv);
  follow(*model_, out);
  return out;
}

}  // namespace graze
