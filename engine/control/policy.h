#pragma once
// Policies and trackers. A policy (what to do) turns observations into targets; a control lag lies between; a tracker
// (how to do it) turns the delayed targets into what actuators are asked for. Both see the nominal model p0 only. To
// add one, write one file in this folder that ends in a PolicyRegistration or TrackerRegistration.

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/actuation/actuators.h"
#include "engine/control/policy_draws.h"
#include "engine/lanes/lane_tape.h"
#include "engine/model/model.h"
#include "engine/sensing/sensors.h"
#include "engine/settings/description.h"
#include "engine/settings/settings.h"

namespace graze {

/// What a target is about.
enum class TargetKind { joint, effector };

/// Targets of one control step, all lanes.
struct Targets {
  BlockArray q, v;   // na rows: joint positions and velocities (kind joint)
  BlockArray tau;    // na rows: feed-forward torque
  BlockArray x, xd;  // 3 rows per effector: position (m) and velocity (m/s) in the base frame (kind effector)
  Targets() = default;
  Targets(int na, int effectors) : q(na), v(na), tau(na), x(3 * effectors), xd(3 * effectors) {}
};

/// What makes a policy or tracker: p0, the timing, and the random numbers of those that draw.
struct ControlContext {
  const Model& nominal;                                  // outlives the policy
  const State& initial;                                  // nominal initial state
  double period;                                         // s, control step
  bool solves_drives = true;                             // BlockPhysics::solves_drives
  double end = std::numeric_limits<double>::infinity();  // s, longest trace
  std::uint64_t seed = 0;                                // root seed, which PolicyDraws are keyed by
  std::string name = {};                                 // of the policy in its scenario, "step/2cm"; keys them too
  PolicyDraws* draws = nullptr;                          // set by the Controller; outlives the policy
  std::string urdf = {};                                 // of `nominal`; empty: what brief_libraries() was told
};

/// Name and unit of an internal quantity.
struct Inside {
  std::string name, unit;
};

class Policy {
 public:
  virtual ~Policy() = default;
  virtual void start(int lane) = 0;
  /// From the lane's next start() on acts in it as `other` would, which was made of the same settings for a robot of
  /// the same parts, so that one call serves a robot in each lane, with the bits that each has alone. False: it cannot.
  virtual bool know(int /*lane*/, const Policy& /*other*/) { return false; }
  /// Fills the targets of the active lanes from what is sensed.
  virtual void act(const Observation& observation, LaneMask active, Targets& targets) = 0;
  /// Groups of the observation (SensedGroup) that act reads; the others need not be sensed, and are NaN then.
  virtual unsigned reads() const { return kAllGroups; }
  /// Writes down, or reads back after start(), all that act keeps of a lane from call to call. A policy that keeps
  /// nothing does nothing here; one that does not tell cannot be saved: throws std::logic_error.
  virtual void carry(int /*lane*/, LaneTape& /*tape*/) {
    throw std::logic_error("the policy does not tell what it keeps of a trace (Policy::carry), so it cannot be saved");
  }
  /// Internal quantities of the policy, for records of a trace, and the numbers of a lane after act(),
  /// out[inside().size()].
  virtual std::vector<Inside> inside() const { return {}; }
  virtual void look_inside(int /*lane*/, double* /*out*/) const {}
  /// Frames (indices into Model::frames) that the effector targets are for; empty if it has joint targets only.
  virtual std::vector<int> effectors() const { return {}; }
};

class Tracker {
 public:
  virtual ~Tracker() = default;
  virtual TargetKind kind() const = 0;
  /// As of a policy, the first two for trackers that keep something of a lane from call to call.
  virtual void start(int /*lane*/) {}
  virtual void carry(int /*lane*/, LaneTape& /*tape*/) {}
  virtual bool know(int /*lane*/, const Tracker& /*other*/) { return false; }
  /// Groups of the observation that track reads, as Policy::reads, and kServoPosition or kServoVelocity if the servos
  /// that it commands look at their encoders.
  virtual unsigned reads() const { return kAllGroups; }
  virtual void track(const Observation& observation, const Targets& targets, LaneMask active,
                     ActuatorCommand& command) = 0;
  /// As of a policy, after track().
  virtual std::vector<Inside> inside() const { return {}; }
  virtual void look_inside(int /*lane*/, double* /*out*/) const {}
};

/// Given what is written for a policy or tracker, whose keys are known to be described ones. `kind`: what the chosen
/// tracker follows; a policy that cannot fill it calls own.settings().fail_key().
using PolicyFactory =
    std::function<std::unique_ptr<Policy>(const ControlContext&, const Described& own, TargetKind kind)>;
using TrackerFactory = std::function<std::unique_ptr<Tracker>(const ControlContext&, const Described& own,
                                                              const std::vector<int>& effectors)>;

/// With what is told of a policy and what its settings may hold: other keys are refused before it is made.
struct PolicyRegistration {
  PolicyRegistration(const std::string& name, Description text, PolicyFactory make);
};
/// `kind` stands here too, because it must be known before the policy is made.
struct TrackerRegistration {
  TrackerRegistration(const std::string& name, Description text, TargetKind kind, TrackerFactory make);
};

/// For policies that give joints their targets. Throws InputError where the chosen tracker follows feet.
void need_joint_targets(const Described& own, TargetKind kind, const std::string& policy);

std::vector<std::string> policy_names();
std::vector<std::string> tracker_names();
/// Of a registered one. Throws std::out_of_range if there is none of that name.
const Description& policy_text(const std::string& name);
const Description& tracker_text(const std::string& name);

/// A policy with its tracker and the lag between them: everything between observation and actuators.
class Controller {
 public:
  /// `policy`: map with one policy name and, but for purely internal trackers, `control: {TRACKER: …}`; e.g.
  /// {gait: {…}, control: {operational_pd: {kp: 1000, kd: 20}}}. Throws InputError with place.
  Controller(const ControlContext& context, const Settings& policy);
  ~Controller();

  /// From the lane's next start() on acts in it as `other` would, which was made of the same policy for a robot of the
  /// same parts. False: it cannot, and the lane is not to be used before it knows a robot again.
  bool know(int lane, const Controller& other);
  /// `lag`: persistent value of the lane's particle, s. `particle`: its id, which keys what the policy draws.
  void start(int lane, double lag, std::uint32_t particle);
  /// Writes down, or reads back after start(), all that the lane's further way depends on, between two control steps.
  void carry(int lane, LaneTape& tape);
  /// One control step. `lag_jitter`: added to the lag of each lane at this step; the sum is cut at 0.
  void act(const Observation& observation, const double* lag_jitter, LaneMask active, ActuatorCommand& command);
  /// Groups of the observation that policy or tracker read (SensedGroup).
  unsigned reads() const;
  // What follows is for records of a trace, and of the last act.
  TargetKind kind() const;                  // of what the tracker follows
  const Policy& policy() const;             // its effectors and what it keeps to itself
  const Tracker& tracker() const;           // what it keeps to itself
  const Targets& targets() const;           // before the lag
  const Targets& targets_in_force() const;  // behind it: what the tracker followed in the lanes that acted
  double lag(int lane) const;               // s, with its jitter

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace graze
