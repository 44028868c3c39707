// Policy `library`: a controller of the user's own in a shared object, by the C interface graze/policy.h.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "engine/control/joint_values.h"
#include "engine/control/policy.h"
#include "engine/library/outside_policy.h"
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
  LibrarySetup(const ControlContext& context, const Described& own)
      : urdf_(context.urdf.empty() ? library_urdf() : context.urdf) {
    const auto settings = own.find("settings");
    settings_ = settings && !settings->is_null() ? settings_json(*settings) : "{}";
    if (!settings_.starts_with("{")) settings->fail("must be a map, {kp: 20, …}");
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

class LibraryPolicy : public OutsidePolicy {
 public:
  LibraryPolicy(const ControlContext& context, const Described& own)
      : OutsidePolicy(context, read_library_use(own)), setup_(context, own) {
    if (use().loads_here()) load();
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
    const double time = time_of(observation, active);
    preset(wanted_.q.row(0), wanted_.v.row(0), wanted_.tau.row(0));
    for (BlockArray* array : {&wanted_.q, &wanted_.v, &wanted_.tau}) std::fill_n(array->row(joints()), kLanes, kGuard);
    const GrazeObservation seen = view_of(observation);
    GrazeTargets out = {wanted_.q.row(0), wanted_.v.row(0), wanted_.tau.row(0)};
    object_->call(LibraryCall::act, time, self_,
                  [&] { return object_->table().act(self_, &seen, active.bits(), &out); });
    std::string wrong = replaced(out);
    if (wrong.empty()) wrong = written_behind();
    if (wrong.empty()) wrong = take(wanted_, active, targets);
    if (wrong.find("of nan") != std::string::npos &&
        (object_->table().reads & GRAZE_READS_EVERYTHING) != GRAZE_READS_EVERYTHING) {
      wrong += "; what `reads` of its table does not name is NaN";
    }
    if (!wrong.empty()) object_->fail(LibraryCall::act, time, wrong);
  }

 private:
  void load() {
    object_ = std::make_unique<SharedObject>(use());
    const double never = std::numeric_limits<double>::quiet_NaN();
    std::string why;
    try {
      object_->call(LibraryCall::create, never, nullptr, [&] {
        self_ = object_->table().create(&setup_.given());
        if (!self_) why = object_->reason(nullptr);  // it is code of the controller's, too
        return 0;
      });
    } catch (const std::runtime_error& error) {
      end();
      use().place.at("file").fail(error.what());
    }
    if (!self_) {
      use().place.at("file").fail(fmt::format("{}: create() gave no controller{}", use().file, why));
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

  /// "replaces targets.torque, …" if a pointer is not as it was; else nothing.
  std::string replaced(const GrazeTargets& out) const {
    const std::array<std::pair<bool, const char*>, 3> arrays = {{{out.position == wanted_.q.row(0), "position"},
                                                                 {out.velocity == wanted_.v.row(0), "velocity"},
                                                                 {out.torque == wanted_.tau.row(0), "torque"}}};
    for (const auto& [same, name] : arrays) {
      if (!same) return fmt::format("replaces targets.{} by another array; write into the one that is there", name);
    }
    return "";
  }

  /// "writes targets.torque of joint 12, and …" if a guard is not as it was; else nothing.
  std::string written_behind() const {
    const std::array<std::pair<const BlockArray*, const char*>, 3> arrays = {
        {{&wanted_.q, "position"}, {&wanted_.v, "velocity"}, {&wanted_.tau, "torque"}}};
    for (const auto& [array, name] : arrays) {
      const double* const guard = array->row(joints());
      if (std::all_of(guard, guard + kLanes, [](double one) { return one == kGuard; })) continue;
      return fmt::format(
          "writes targets.{} of joint {}, behind its end: the robot has {} driven joint{}, counted from 0", name,
          joints(), joints(), joints() == 1 ? "" : "s");
    }
    return "";
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

  const LibrarySetup setup_;
  static constexpr double kGuard = -8.25e307;  // nobody asks for it
  Targets wanted_ = Targets(joints() + 1, 0);  // with a row behind the last joint, which nobody may write
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
