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

#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "policy.h"

namespace graze::policy {

using Joint = GrazeJoint;

/// What there is to know before the first trace.
class Setup {
 public:
  explicit Setup(const GrazeSetup& given) : given_(given) {}
  int joints() const { return given_.joints; }
  const Joint& joint(int k) const { return given_.joint[k]; }
  int links() const { return given_.links; }
  std::string link(int k) const { return given_.link[k]; }
  double period() const { return given_.period; }  // s
  std::string urdf() const { return given_.urdf; }
  std::string settings() const { return given_.settings; }  // JSON
  /// A number, true (1) or false (0) of the settings' outermost map.
  double setting(const char* key, double otherwise) const { return graze_setting(&given_, key, otherwise); }

 private:
  const GrazeSetup& given_;
};

/// One robot at one control step: what it sees and what it wants. Indices are those of Setup::joint and Setup::link.
class Robot {
 public:
  explicit Robot(const GrazeRobot& robot) : robot_(robot) {}
  double time() const { return robot_.time; }  // s since the trace began
  double position(int joint) const { return graze_position(&robot_, joint); }
  double velocity(int joint) const { return graze_velocity(&robot_, joint); }
  double applied_torque(int joint) const { return see(robot_.sees->joint_torque, joint); }
  double base_position(int axis) const { return see(robot_.sees->base_position, axis); }
  double base_rpy(int axis) const { return see(robot_.sees->base_rpy, axis); }
  double base_velocity(int axis) const { return see(robot_.sees->base_velocity, axis); }
  double base_rate(int axis) const { return see(robot_.sees->base_rate, axis); }
  double link_force(int link) const { return see(robot_.sees->link_force, link); }  // N
  /// Anything else: robot.see(robot.observation().imu_linear, 2).
  double see(const double* array, int k) const { return graze_see(&robot_, array, k); }
  const GrazeObservation& observation() const { return *robot_.sees; }

  void want_position(int joint, double value) const { graze_want(&robot_, robot_.wants->position, joint, value); }
  void want_velocity(int joint, double value) const { graze_want(&robot_, robot_.wants->velocity, joint, value); }
  void want_torque(int joint, double value) const { graze_want(&robot_, robot_.wants->torque, joint, value); }

 private:
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
