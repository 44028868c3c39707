// A controller of your own in C++ (C++17): a class for one robot, of which there is one object per lane.
//
//   class Walker {
//    public:
//     static constexpr std::uint32_t reads = GRAZE_READS_JOINT_POSITION;     // optional; without it: everything
//     explicit Walker(const graze::policy::Setup& setup);
//     void start(std::uint64_t seed);                          // a trace begins: forget the one before
//     void act(const graze::policy::Robot& robot);             // fills the targets
//   };
//   GRAZE_POLICY(Walker)                                       // once, outside of namespaces
//
// What constructor, start() or act() throws becomes the error that Graze shows; a throwing particle is `invalid`, the
// others go on. Promises, units and frames: graze/policy.h.
#ifndef GRAZE_POLICY_HPP
#define GRAZE_POLICY_HPP

#include <cmath>
#include <cstdint>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "policy.h"

namespace graze::policy {

using Joint = GrazeJoint;

namespace detail {

inline int checked(int k, int count, const char* what, const char* things) {
  if (k >= 0 && k < count) return k;
  throw std::out_of_range(std::string(what) + "(" + std::to_string(k) + "): there are " + std::to_string(count) + " " +
                          things + ", counted from 0");
}

}  // namespace detail

/// What there is to know before the first trace. Indices count from 0; others throw std::out_of_range.
class Setup {
 public:
  explicit Setup(const GrazeSetup& given) : given_(given) {}
  int joints() const { return given_.joints; }
  const Joint& joint(int k) const { return given_.joint[detail::checked(k, joints(), "joint", "driven joints")]; }
  int links() const { return given_.links; }
  std::string link(int k) const { return given_.link[detail::checked(k, links(), "link", "links")]; }
  double period() const { return given_.period; }  // s
  std::string urdf() const { return given_.urdf; }
  std::string settings() const { return given_.settings; }  // JSON
  /// A number, true (1) or false (0) of the settings' outermost map.
  /// Throws std::invalid_argument if a text, a list or a map stands there.
  double setting(const char* key, double otherwise) const {
    const double out = graze_setting(&given_, key, otherwise);
    if (std::isnan(out) && !std::isnan(otherwise)) {
      throw std::invalid_argument("the setting '" + std::string(key) + "' is no number");
    }
    return out;
  }
  /// Throws std::invalid_argument if there is a setting that is none of `known`, names with spaces between ("kp kd").
  void take_settings(const char* known) const {
    char found[64];
    if (!graze_unknown_setting(&given_, known, found, sizeof found)) return;
    throw std::invalid_argument(std::string("unknown setting '") + found + "'; there are: " + known);
  }

 private:
  const GrazeSetup& given_;
};

/// One robot at one control step: what it sees and what it wants. Indices are those of Setup::joint and Setup::link,
/// from 0; others throw std::out_of_range. What the class does not read is not sensed, and asking for it throws, too.
class Robot {
 public:
  explicit Robot(const GrazeRobot& robot) : robot_(robot) {}
  double time() const { return robot_.time; }  // s since the trace began
  int joints() const { return robot_.joints; }
  int links() const { return robot_.sees->links; }
  double position(int joint) const {
    return of_joint(robot_.sees->joint_position, joint, "position", "JOINT_POSITION");
  }
  double velocity(int joint) const {
    return of_joint(robot_.sees->joint_velocity, joint, "velocity", "JOINT_VELOCITY");
  }
  double applied_torque(int joint) const {
    return of_joint(robot_.sees->joint_torque, joint, "applied_torque", "JOINT_TORQUE");
  }
  double base_position(int axis) const {
    return of_axis(robot_.sees->base_position, axis, "base_position", "BASE_POSITION");
  }
  double base_rpy(int axis) const { return of_axis(robot_.sees->base_rpy, axis, "base_rpy", "BASE_RPY"); }
  double base_velocity(int axis) const {
    return of_axis(robot_.sees->base_velocity, axis, "base_velocity", "BASE_VELOCITY");
  }
  double base_rate(int axis) const { return of_axis(robot_.sees->base_rate, axis, "base_rate", "BASE_RATE"); }
  double link_force(int link) const {  // N
    return sensed(robot_.sees->link_force, detail::checked(link, links(), "link_force", "links"), "link_force",
                  "LINK_FORCE");
  }
  /// Anything else, unchecked: robot.see(robot.observation().imu_linear, 2).
  double see(const double* array, int k) const { return graze_see(&robot_, array, k); }
  const GrazeObservation& observation() const { return *robot_.sees; }

  void want_position(int joint, double value) const { want(robot_.wants->position, joint, value, "want_position"); }
  void want_velocity(int joint, double value) const { want(robot_.wants->velocity, joint, value, "want_velocity"); }
  void want_torque(int joint, double value) const { want(robot_.wants->torque, joint, value, "want_torque"); }

 private:
  double sensed(const double* array, int k, const char* what, const char* group) const {
    const double value = see(array, k);
    if (value == value) return value;
    throw std::runtime_error(std::string(what) + "(" + std::to_string(k) + ") is not sensed; add GRAZE_READS_" + group +
                             " to `reads`");
  }
  double of_joint(const double* array, int joint, const char* what, const char* group) const {
    return sensed(array, detail::checked(joint, robot_.joints, what, "driven joints"), what, group);
  }
  double of_axis(const double* array, int axis, const char* what, const char* group) const {
    return sensed(array, detail::checked(axis, 3, what, "axes"), what, group);
  }
  void want(double* array, int joint, double value, const char* what) const {
    graze_want(&robot_, array, detail::checked(joint, robot_.joints, what, "driven joints"), value);
  }

  const GrazeRobot& robot_;
};

namespace detail {

template <class Controller, class = void>
struct Reads {
  static constexpr std::uint32_t value = GRAZE_READS_EVERYTHING;
};
template <class Controller>
struct Reads<Controller, std::void_t<decltype(Controller::reads)>> {
  static constexpr std::uint32_t value = Controller::reads;
};

/// The functions of the C table, for a class.
template <class Controller>
struct Adapter {
  std::vector<std::unique_ptr<Controller>> lanes;
  static std::string& error() {
    thread_local std::string text;
    return text;
  }

  template <class Do>
  static int guarded(const Do& work) {
    try {
      work();
      return 0;
    } catch (const std::exception& thrown) {
      error() = thrown.what();
    } catch (...) {
      error() = "an exception of unknown type";
    }
    return 1;
  }

  static void* create(const GrazeSetup* given) {
    auto made = std::make_unique<Adapter>();
    const int failed = guarded([&] {
      const Setup setup(*given);
      for (int lane = 0; lane < given->lanes; ++lane) made->lanes.push_back(std::make_unique<Controller>(setup));
    });
    return failed != 0 ? nullptr : made.release();
  }
  static int start(void* self, std::int32_t lane, std::uint64_t seed) {
    return guarded([&] { static_cast<Adapter*>(self)->lanes[static_cast<std::size_t>(lane)]->start(seed); });
  }
  static int act(void* self, const GrazeObservation* observation, std::uint32_t active, GrazeTargets* targets) {
    return graze_each_robot(self, observation, active, targets, [](void* policy, const GrazeRobot* one) -> int {
      return guarded(
          [&] { static_cast<Adapter*>(policy)->lanes[static_cast<std::size_t>(one->lane)]->act(Robot(*one)); });
    });
  }
  static void destroy(void* self) { delete static_cast<Adapter*>(self); }
  static const char* last_error(void*) { return error().c_str(); }

  static const GrazePolicy* table() {
    static const GrazePolicy policy = {
        GRAZE_POLICY_VERSION, sizeof(GrazePolicy), Reads<Controller>::value, create, start, act, destroy, last_error};
    return &policy;
  }
};

}  // namespace detail
}  // namespace graze::policy

#define GRAZE_POLICY(Controller)                                         \
  extern "C" GRAZE_POLICY_EXPORT const GrazePolicy* graze_policy(void) { \
    return graze::policy::detail::Adapter<Controller>::table();          \
  }

#endif
