// Policy `joint_trajectory`: joint positions (and velocities) as functions of time, along sinusoids or a table. Joints
// that nothing is said about hold their nominal initial position.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/control/joint_table.h"
#include "engine/control/joint_values.h"
#include "engine/lanes/scalar.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

constexpr const char* kNever = "never";

const Description& sinusoid_description() {
  static const Description text = {
      "q = q0 + offset + amplitude sin(frequency t + phase) about the nominal initial position q0",
      {{"amplitude",
        {Form::joint_numbers(Quantity::angle), Form::joint_numbers(Quantity::length)},
        Default::required(),
        "of the motion"},
       {"frequency", {Form::joint_numbers(Quantity::angular_velocity)}, Default::required(), "angular frequency"},
       {"phase", {Form::joint_numbers(Quantity::angle)}, Default::value("0 rad"), "at the start"},
       {"from_start",
        {Form::flag()},
        Default::value("false"),
        "q0 is where the motion begins, not its middle: with a phase of 90 deg it begins at rest"},
       {"offset",
        {Form::joint_numbers(Quantity::angle), Form::joint_numbers(Quantity::length)},
        Default::value("0 rad"),
        "added all along, as for fingers that shall press"},
       {"until",
        {Form::number(Quantity::time, Bound::not_negative), Form::word({kNever})},
        Default::words(kNever),
        "when the motion is frozen"}}};
  return text;
}

const Description& joint_trajectory_description() {
  static const Description text = {
      "moves the joints along sinusoids or a table over time",
      {{"sinusoid", {Form::map(sinusoid_description())}, {}, sinusoid_description().help},
       {"table", {Form::text("FILE")}, {}, "CSV `time,JOINT,…` whose times grow; its ends are held"},
       interpolation_key()},
      {{"sinusoid", "table"}}};
  return text;
}

/// Joint targets that depend on time alone.
class Motion {
 public:
  virtual ~Motion() = default;
  struct Sample {
    double q, v;
  };
  virtual Sample at(int joint, double t) const = 0;
};

class Sinusoid : public Motion {
 public:
  Sinusoid(const ControlContext& context, const Settings& settings)
      : q0_(actuated_positions(context.nominal, context.initial)) {
    const Described own(settings, sinusoid_description());
    amplitude_ = read_joint_values(context.nominal, settings.at("amplitude"), Quantity::angle, 0.0, Quantity::length);
    frequency_ = read_joint_values(context.nominal, settings.at("frequency"), Quantity::angular_velocity, 0.0);
    phase_ = read_joint_values_or(context.nominal, own, "phase");
    if (own.flag("from_start")) {
      for (std::size_t k = 0; k < q0_.size(); ++k) q0_[k] -= amplitude_[k] * pinned::sin(phase_[k]);
    }
    if (const auto offset = settings.find("offset")) {
      const std::vector<double> by =
          read_joint_values(context.nominal, *offset, Quantity::angle, 0.0, Quantity::length);
      for (std::size_t k = 0; k < q0_.size(); ++k) q0_[k] += by[k];
    }
    const auto until = settings.find("until");
    if (until && !(until->is_scalar() && until->text() == kNever)) until_ = own.number("until");
    for (int k = 0; k < static_cast<int>(q0_.size()); ++k) {
      const double most = std::abs(amplitude_[k]);
      if (most == 0) continue;
      const Settings typed = joint_entry(context.nominal, settings.at("amplitude"), k);
      doubt_targets(context.nominal, k, q0_[k] - most, q0_[k] + most, typed);
    }
  }

  Sample at(int joint, double t) const override {
    const double angle = frequency_[joint] * std::min(t, until_) + phase_[joint];
    const auto [sine, cosine] = pinned::sin_cos(angle);
    const double rate = t < until_ ? amplitude_[joint] * frequency_[joint] * cosine : 0.0;
    return {q0_[joint] + amplitude_[joint] * sine, rate};
  }

 private:
  std::vector<double> q0_, amplitude_, frequency_, phase_;
  double until_ = std::numeric_limits<double>::infinity();
};

class Table : public Motion {
 public:
  Table(const ControlContext& context, const Described& own)
      : q0_(actuated_positions(context.nominal, context.initial)),
        table_(JointTable::load(own.at("table"), actuated_names(context.nominal), read_interpolation(own))),
        column_(q0_.size(), -1) {
    doubt_times(own.at("table"), context.end);
    for (std::size_t c = 0; c < table_.columns().size(); ++c) {
      column_[table_.columns()[c]] = static_cast<int>(c);
      const auto [low, high] = table_.extremes(c);
      doubt_targets(context.nominal, table_.columns()[c], low, high, own.at("table"));
    }
  }

  Sample at(int joint, double t) const override {
    if (column_[joint] < 0) return {q0_[joint], 0};
    const JointTable::Sample sample = table_.at(column_[joint], t);
    return {sample.value, sample.rate};
  }

 private:
  /// Times in ms are a thousand times too long for the trace.
  void doubt_times(const Settings& file, double end) const {
    const double second = table_.second_time();
    if (!(second >= 10 * end && second / 1000 <= end)) return;
    warn(file, fmt::format("{}: its second row is at {:g} s, and no trace is longer than {:g} s; are its times in ms?",
                           file.text(), second, end));
  }

  std::vector<double> q0_;
  JointTable table_;
  std::vector<int> column_;  // of each joint; -1: none
};

/// The samples of all joints at the times of control steps, each computed once for all lanes and traces.
class SampledMotion {
 public:
  SampledMotion(std::unique_ptr<Motion> motion, const ControlContext& context)
      : motion_(std::move(motion)), joints_(context.nominal.na()), period_(context.period) {
    constexpr double kMost = 1 << 16;  // samples that are kept, 1 MB for each policy of each thread
    const double most = std::max(1.0, std::floor(kMost / std::max(joints_, 1)));
    const double steps = std::min(std::ceil(context.end / period_) + 1, most);
    times_.resize(static_cast<std::size_t>(steps), std::numeric_limits<double>::quiet_NaN());
    samples_.resize(times_.size() * static_cast<std::size_t>(joints_));
  }

  /// [joint], valid until the next call.
  const Motion::Sample* at(double t) {
    const auto step = static_cast<std::uint64_t>(std::max(0.0, std::round(t / period_)));
    const std::size_t slot = step % times_.size();
    Motion::Sample* const row = samples_.data() + slot * static_cast<std::size_t>(joints_);
    if (times_[slot] != t) {
      for (int k = 0; k < joints_; ++k) row[k] = motion_->at(k, t);
      times_[slot] = t;
    }
    return row;
  }

 private:
  std::unique_ptr<Motion> motion_;
  const int joints_;
  const double period_;                  // s
  std::vector<double> times_;            // s, that each slot holds
  std::vector<Motion::Sample> samples_;  // [slot][joint]
};

class JointTrajectory : public Policy {
 public:
  JointTrajectory(std::unique_ptr<Motion> motion, const ControlContext& context)
      : motion_(std::move(motion), context) {}

  void start(int) override {}
  void carry(int, LaneTape&) override {}
  unsigned reads() const override { return 0; }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      const Motion::Sample* const samples = motion_.at(observation.time[lane]);
      for (int k = 0; k < targets.q.rows(); ++k) {
        targets.q(k, lane) = samples[k].q;
        targets.v(k, lane) = samples[k].v;
        targets.tau(k, lane) = 0;
      }
    }
  }

 private:
  SampledMotion motion_;
};

std::unique_ptr<Policy> make(const ControlContext& context, const Described& own, TargetKind kind) {
  need_joint_targets(own, kind, "joint_trajectory");
  std::unique_ptr<Motion> motion;
  if (own.has("table")) {
    motion = std::make_unique<Table>(context, own);
  } else {
    motion = std::make_unique<Sinusoid>(context, own.at("sinusoid"));
  }
  return std::make_unique<JointTrajectory>(std::move(motion), context);
}

const PolicyRegistration joint_trajectory_registration("joint_trajectory", joint_trajectory_description(), make);

}  // namespace

}  // namespace graze
