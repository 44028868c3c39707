#pragma once
// The gait planner once more, written one lane at a time in Eigen: the reference of the lane kernel.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/control/gait_parameters.h"
#include "tests/reference_kinematics.h"

namespace graze::scalar {

enum class FootMode { stance, swing, reach, support };

struct BaseCommand {
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();
  bool operator==(const BaseCommand& other) const { return v == other.v && w == other.w; }
};

struct Path {
  std::array<Vec3, 4> knot{}, slope{};
  double t0 = 0, duration = 1;
  struct Sample {
    Vec3 x, xd;
  };
  Path() = default;
  Path(const std::array<Vec3, 4>& k, const Vec3& v_start, const Vec3& v_end, double t, double T)
      : knot(k), t0(t), duration(T) {
    const double h = T / 3;
    const Vec3 r1 = 3 / h * (knot[2] - knot[0]) - v_start, r2 = 3 / h * (knot[3] - knot[1]) - v_end;
    slope = {v_start, (4 * r1 - r2) / 15, (4 * r2 - r1) / 15, v_end};
  }
  Sample at(double t) const {
    const double h = duration / 3, u = std::clamp(t - t0, 0.0, duration) / h;
    const int i = std::min(static_cast<int>(u), 2);
    const double s = u - i;
    const Vec3 rise = knot[i + 1] - knot[i], m0 = h * slope[i], m1 = h * slope[i + 1];
    const Vec3 c2 = 3 * rise - 2 * m0 - m1, c3 = m0 + m1 - 2 * rise;
    return {knot[i] + s * (m0 + s * (c2 + s * c3)), (m0 + s * (2 * c2 + 3 * s * c3)) / h};
  }
};

struct Foot {
  FootMode mode = FootMode::stance;
  Vec3 x = Vec3::Zero(), xd = Vec3::Zero();
  Path path;
  BaseCommand planned_for;
};

struct Senses {
  double t = 0, dt = 0;
  BaseCommand command;
  std::array<Vec3, kMaxFeet> x{};
  std::array<double, kMaxFeet> force{};
  double roll = 0, pitch = 0;
};

class Planner {
 public:
  explicit Planner(const GaitParameters& p)
      : p_(p), R_GB_(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(p.R_GB)) {}

  std::vector<Foot> start(const Senses& in) const {
    std::vector<Foot> feet(p_.timing.feet);
    for (int i = 0; i < p_.timing.feet; ++i) {
      feet[i].x = in.x[i];
      if (p_.settle <= 0) continue;
      Vec3 level = R_GB_ * in.x[i];
      level.z() = p_.origin[i][2];
      const Vec3 way = R_GB_.transpose() * level - in.x[i];
      feet[i].path = Path({in.x[i], in.x[i] + 7.0 / 27 * way, in.x[i] + 20.0 / 27 * way, in.x[i] + way}, Vec3::Zero(),
                          Vec3::Zero(), 0, p_.settle);
    }
    return feet;
  }

  void plan(const Senses& in, std::vector<Foot>& feet) const {
    if (in.t >= p_.settle) {
      Senses since = in;
      since.t -= p_.settle;
      walk(since, feet);
      return;
    }
    for (Foot& foot : feet) set(foot, in.t);
  }

 private:
  static double fraction(double x) { return x - std::floor(x); }
  static void set(Foot& foot, double t) {
    const Path::Sample sample = foot.path.at(t);
    foot.x = sample.x;
    foot.xd = sample.xd;
  }
  bool in_stance(int i, double phase) const {
    return p_.timing.duty[i] >= 1 || fraction(phase - p_.timing.touchdown[i] + 1e-9) < p_.timing.duty[i];
  }
  double hop(double phase) const {
    phase += 2e-9;
    for (int k = 0; k < p_.timing.flight_count; ++k) {
      const GaitTiming::Flight& flight = p_.timing.flights[k];
      const double top = 0.5 * p_.gravity * flight.duration;
      const double aloft = fraction(phase - flight.takeoff) * p_.timing.period;
      if (aloft < flight.duration) return top - p_.gravity * aloft;
      const double stood = fraction(phase - flight.previous_landing) * p_.timing.period;
      if (stood < flight.stance) {
        const double s = stood / flight.stance;
        return top * (2 * s * s * (3 - 2 * s) - 1);
      }
    }
    return 0;
  }
  Vec3 within_reach(int i, const Vec3& x) const {
    const Vec3 hip = Vec3::Map(p_.hip[i]), from_hip = x - hip;
    const double distance = from_hip.norm();
    return distance > p_.reach[i] ? Vec3(hip + p_.reach[i] / distance * from_hip) : x;
  }
  Vec3 stance_velocity(const Vec3& x, const BaseCommand& command) const {
    return -(R_GB_.transpose() * (command.v + command.w.cross(R_GB_ * x)));
  }
  Vec3 touchdown(int i, const BaseCommand& command) const {
    const double T = 0.5 * p_.timing.duty[i] * p_.timing.period, yaw = command.w.z() * T;
    const bool small = std::abs(yaw) < 1e-6;
    const double a = small ? 1 - yaw * yaw / 6 : std::sin(yaw) / yaw;
    const double b = small ? yaw / 2 : (1 - std::cos(yaw)) / yaw;
    const double dx = command.v.x() * T, dy = command.v.y() * T, c = std::cos(yaw), s = std::sin(yaw);
    const double* o = p_.origin[i];
    const Vec3 goal(a * dx - b * dy + c * o[0] - s * o[1], b * dx + a * dy + s * o[0] + c * o[1], o[2]);
    return within_reach(i, R_GB_.transpose() * goal);
  }
  Path path(const Senses& in, int i, const Vec3& x, const Vec3& xd, double t0, double duration) const {
    const Vec3 goal = touchdown(i, in.command);
    Vec3 end = stance_velocity(goal, in.command);
    end *= std::min(1.0, p_.max_speed / std::max(end.norm(), 1e-12));
    const Vec3 vertical =
        p_.global_up ? Vec3(rotation_from_rpy({in.roll, in.pitch, 0.7}).row(2).transpose()) : Vec3::UnitZ();
    const Vec3 up = p_.step_height * vertical;
    Vec3 step = goal - x;
    step -= step.dot(up) / std::max(up.squaredNorm(), 1e-300) * up;
    return Path({x, x + up, goal + up + p_.overshoot * step, goal}, xd, end, t0, duration);
  }

  void walk(const Senses& in, std::vector<Foot>& feet) const {
    const double phase = fraction(in.t / p_.timing.period);
    const int n = p_.timing.feet;
    BaseCommand command = in.command;
    command.v.z() += hop(phase);
    for (int i = 0; i < n; ++i) {
      FootMode& mode = feet[i].mode;
      const bool planned = in_stance(i, phase);
      if (mode == FootMode::swing && planned) {
        feet[i].x = feet[i].path.at(in.t).x;
        mode = FootMode::reach;
      }
      if (mode == FootMode::support && planned) mode = FootMode::stance;
      if (mode == FootMode::reach && (!p_.recovery || in.force[i] > p_.contact_force)) mode = FootMode::stance;
      if (mode != FootMode::swing && !planned) mode = FootMode::support;
    }
    for (int i = 0; i < n; ++i) {
      Foot& foot = feet[i];
      if (foot.mode == FootMode::swing) continue;
      foot.xd = stance_velocity(in.x[i], command);
      if (foot.mode == FootMode::reach) foot.xd.z() -= foot.xd.norm();
      foot.x = within_reach(i, foot.x + in.dt * foot.xd);
    }
    const bool reaching =
        std::any_of(feet.begin(), feet.end(), [](const Foot& f) { return f.mode == FootMode::reach; });
    for (int i = 0; i < n; ++i) {
      Foot& foot = feet[i];
      if (foot.mode != FootMode::support) continue;
      const bool overreached = (in.x[i] - Vec3::Map(p_.hip[i])).norm() > p_.reach[i];
      const double left = std::max(fraction(p_.timing.touchdown[i] - phase - 1e-9), 0.0) * p_.timing.period;
      const double swing = (1 - p_.timing.duty[i]) * p_.timing.period;
      if ((reaching && !overreached) || left < 0.25 * swing) continue;
      foot.mode = FootMode::swing;
      foot.path = path(in, i, foot.x, foot.xd, in.t, left);
      foot.planned_for = in.command;
    }
    for (int i = 0; i < n; ++i) {
      Foot& foot = feet[i];
      if (foot.mode != FootMode::swing) continue;
      const Path old = foot.path;
      if (in.t - old.t0 <= p_.redirect * old.duration && !(foot.planned_for == in.command)) {
        foot.path = path(in, i, old.knot[0], old.slope[0], old.t0, old.duration);
        foot.planned_for = in.command;
      }
      set(foot, in.t);
    }
  }

  const GaitParameters& p_;
  Mat3 R_GB_;
};

}  // namespace graze::scalar
