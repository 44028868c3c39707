// Policy `library`: a controller of the user's own in a shared object, by the C interface graze/policy.h.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "engine/control/joint_values.h"
#include "engine/control/policy.h"
#include "engine/control/rows.h"
#include "engine/library/settings_json.h"
#include "engine/library/shared_object.h"

namespace graze {

namespace {

/// What a library reads, in terms of the sensors.
unsigned sensed_groups(std::uint32_t reads) {
  static constexpr std::array<std::pair<unsigned, unsigned>, 12> kGroups = {
      {{GRAZE_READS_JOINT_POSITION, kJointPosition},
       {GRAZE_READS_JOINT_VELOCITY, kJointVelocity},
       {GRAZE_READS_JOINT_ACCELERATION, kJointAcceleration},
       {GRAZE_READS_JOINT_TORQUE, kJointTorque},
       {GRAZE_READS_BASE_POSITION, kBasePosition},
       {GRAZE_READS_BASE_RPY, kBaseRpy},
       {GRAZE_READS_BASE_VELOCITY, kBaseVelocity},
       {GRAZE_READS_BASE_RATE, kBaseRate},
       {GRAZE_READS_IMU_LINEAR, kImuLinear},
       {GRAZE_READS_IMU_ANGULAR, kImuAngular},
       {GRAZE_READS_LINK_FORCE, kLinkForce},
       {GRAZE_READS_LINK_PUSH, kLinkPush}}};
  unsigned out = 0;
  for (const auto& [bit, group] : kGroups) out |= (reads & bit) != 0 ? group : 0u;
  return out;
}

/// What a library is told of the robot, with the memory that it points into.
class LibrarySetup {
 public:
  LibrarySetup(const ControlContext& context, const Described& own) : urdf_(library_urdf()) {
    const auto settings = own.find("settings");
    settings_ = settings && !settings->is_null() ? settings_json(*settings) : "{}";
    const Model& model = context.nominal;
    const std::vector<double> initial = actuated_positions(model, context.initial);
    for (int k = 0; k < model.na(); ++k) {
      const Body& body = model.bodies[model.actuated[k]];
      joints_.push_back({body.joint.c_str(), body.type == JointType::prismatic, body.lower, body.upper, body.effort,
                         body.velocity, initial[static_cast<std::size_t>(k)]});
    }
    for (const Frame& frame : model.frames) links_.push_back(frame.name.c_str());
    given_ = {GRAZE_POLICY_VERSION, sizeof(GrazeSetup), kLanes,
              model.na(),           joints_.data(),     static_cast<std::int32_t>(links_.size()),
              links_.data(),        context.period,     urdf_.c_str(),
              settings_.c_str()};
  }
  LibrarySetup(const LibrarySetup&) = delete;
  LibrarySetup& operator=(const LibrarySetup&) = delete;
  const GrazeSetup& given() const { return given_; }

 private:
  std::string urdf_, settings_;
  std::vector<GrazeJoint> joints_;
  std::vector<const char*> links_;
  GrazeSetup given_{};
};

class LibraryPolicy : public Policy {
 public:
  LibraryPolicy(const ControlContext& context, const Described& own)
      : use_(read_library_use(own)),
        setup_(context, own),
        names_(actuated_names(context.nominal)),
        initial_(actuated_positions(context.nominal, context.initial)),
        draws_(context.draws),
        wanted_(context.nominal.na(), 0) {
    if (use_.loads_here()) load();
  }
  ~LibraryPolicy() override { end(); }
  LibraryPolicy(const LibraryPolicy&) = delete;
  LibraryPolicy& operator=(const LibraryPolicy&) = delete;

  /// Where it is not loaded nobody knows.
  unsigned reads() const override { return object_ ? sensed_groups(object_->table().reads) : sensed_groups(~0u); }

  void start(int lane) override {
    if (!object_) refuse();
    object_->call(LibraryCall::start, 0, self_, [&] { return object_->table().start(self_, lane, seed(lane)); });
  }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    if (!object_) refuse();
    int first = 0;
    while (first + 1 < kLanes && !active[first]) ++first;
    const double time = observation.time[static_cast<std::size_t>(first)];
    preset();
    const GrazeObservation seen = view_of(observation);
    GrazeTargets out = {wanted_.q.row(0), wanted_.v.row(0), wanted_.tau.row(0)};
    object_->call(LibraryCall::act, time, self_,
                  [&] { return object_->table().act(self_, &seen, active.bits(), &out); });
    take(active, time, targets);
  }

 private:
  void load() {
    object_ = std::make_unique<SharedObject>(use_);
    const double never = std::numeric_limits<double>::quiet_NaN();
    try {
      object_->call(LibraryCall::create, never, nullptr, [&] {
        self_ = object_->table().create(&setup_.given());
        return 0;
      });
    } catch (const std::runtime_error& error) {
      end();
      use_.place.fail_key(error.what());
    }
    if (!self_) {
      use_.place.fail_key(fmt::format("{}: create() gave no controller{}", use_.file, object_->reason(nullptr)));
    }
  }

  void end() noexcept try {
    if (!self_) return;
    object_->call(LibraryCall::destroy, std::numeric_limits<double>::quiet_NaN(), nullptr, [&] {
      object_->table().destroy(self_);
      return 0;
    });
  } catch (const std::exception&) {  // nobody depends on it any more
  }

  [[noreturn]] void refuse() const {
    const bool untrusted = libraries_allowed() == LibraryLoading::refused;
    throw LibraryRefused(fmt::format(
        "{}: {} {}", use_.place.key_place(), use_.file,
        untrusted ? "is code that would run with your rights, and runs only if you say --trust, to graze run, resume, "
                    "replay, sweep, submit, steps, sources, improve, check --probe or check --determinism"
                  : "runs in a process of its own, which this command has none of; with isolation: none it runs in "
                    "the program"));
  }

  /// 64 bits of (campaign's seed, particle, policy).
  std::uint64_t seed(int lane) const {
    if (!draws_) return 0;
    constexpr double kHalf = 4294967296.0;  // 2^32
    const auto high = static_cast<std::uint64_t>(std::floor(draws_->uniform_of_trace(lane, 0) * kHalf));
    const auto low = static_cast<std::uint64_t>(std::floor(draws_->uniform_of_trace(lane, 1) * kHalf));
    return high << 32 | low;
  }

  void preset() {
    for (int k = 0; k < wanted_.q.rows(); ++k) {
      std::fill_n(wanted_.q.row(k), kLanes, initial_[static_cast<std::size_t>(k)]);
      std::fill_n(wanted_.v.row(k), kLanes, 0.0);
      std::fill_n(wanted_.tau.row(k), kLanes, 0.0);
    }
  }

  GrazeObservation view_of(const Observation& o) const {
    return {kLanes,
            setup_.given().joints,
            setup_.given().links,
            o.time.data(),
            o.joint_position.row(0),
            o.joint_velocity.row(0),
            o.joint_acceleration.row(0),
            o.joint_torque.row(0),
            o.base_position.row(0),
            o.base_rpy.row(0),
            o.base_velocity.row(0),
            o.base_rate.row(0),
            o.imu_linear.row(0),
            o.imu_angular.row(0),
            o.link_force.row(0),
            o.link_push.row(0)};
  }

  /// Hands over what is wanted, unless some of it is no number.
  void take(LaneMask active, double time, Targets& targets) const {
    std::array<double, kLanes> poison{};  // becomes NaN, and stays 0 where all is finite
    const auto move = [&](const BlockArray& from, BlockArray& to) {
      for (int k = 0; k < from.rows(); ++k) {
        const double* const row = from.row(k);
        for (int lane = 0; lane < kLanes; ++lane) poison[static_cast<std::size_t>(lane)] += row[lane] - row[lane];
        copy_lanes(to.row(k), row, active);
      }
    };
    move(wanted_.q, targets.q);
    move(wanted_.v, targets.v);
    move(wanted_.tau, targets.tau);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane] && std::isnan(poison[static_cast<std::size_t>(lane)])) not_finite(lane, time);
    }
  }

  [[noreturn]] void not_finite(int lane, double time) const {
    const auto look = [&](const BlockArray& array, const char* what) {
      for (int k = 0; k < array.rows(); ++k) {
        if (std::isfinite(array(k, lane))) continue;
        object_->fail(LibraryCall::act, time,
                      fmt::format("asks joint {} for a {} of {}, which is no finite number",
                                  names_[static_cast<std::size_t>(k)], what, array(k, lane)));
      }
    };
    look(wanted_.q, "position");
    look(wanted_.v, "velocity");
    look(wanted_.tau, "torque");
    object_->fail(LibraryCall::act, time, "asks for what is no finite number");
  }

  const LibraryUse use_;
  const LibrarySetup setup_;
  const std::vector<std::string> names_;
  const std::vector<double> initial_;
  PolicyDraws* const draws_;
  Targets wanted_;
  std::unique_ptr<SharedObject> object_;
  void* self_ = nullptr;
};

const PolicyRegistration library_registration(
    "library", library_description(),
    [](const ControlContext& context, const Described& own, TargetKind kind) -> std::unique_ptr<Policy> {
      if (kind != TargetKind::joint) {
        own.settings().fail_key(
            "library gives joint positions, velocities and torques; use control: {joint_pd: …} or {torque: {}}");
      }
      return std::make_unique<LibraryPolicy>(context, own);
    });

}  // namespace

}  // namespace graze
