#pragma once
// Fabrication: what a workshop gets wrong. Every number of a World that may be uncertain has a path
// ("robot.link.LF_SHIN.length"); a Fabricator sets the values of one particle coherently (a longer shin moves the foot,
// its inertia and its collision shape) and compiles the perturbed model p*. Figures 10, 15, 23 of the dissertation.

#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/model/model.h"
#include "engine/settings/settings.h"

namespace graze {

/// One addressable number of a world.
///   robot.link.<link>.{density,mass,length,radius,friction,restitution}, robot.link.<link>.size.{x,y,z}
///   robot.link.<link>.com.{x,y,z}
///   robot.joint.<joint>.axis.{tilt,heading} (conical error: the axis is tilted by `tilt` toward `heading`), .zero,
///   .damping, .friction, .effort, .velocity; .gear, .rotor_inertia (where World::knows_rotors)
///   environment.<object>.{friction,restitution,density,mass,radius,length}, .size.{x,y,z}, .position.{x,y,z},
///   .rotation.{roll,pitch,yaw}, .spectrum.{rms,longest,shortest,exponent,seed} (of heightfields that have one)
///   contact.{friction,restitution,model}
///   contact.{stiffness,damping}, environment.<object>.{stiffness,damping}; (where World::has_springs)
///   initial.base.{x,y,z,roll,pitch,yaw} (offsets), initial.base.velocity.{x,y,z,roll,pitch,yaw},
///   initial.joint.<joint>.{position,velocity}; (offsets from the scenario's initial state)
///   control.lag; gravity.{x,y,z}; every channel of channel_names()
///   disturbances.<name>.{at,point.x,point.y,point.z}, of pushes .{force or impulse,azimuth,elevation,duration}, of
///   payloads .mass
/// Offsets have nominal value 0.
struct Parameter {
  std::string path;
  double nominal = 0;
  Quantity quantity = Quantity::dimensionless;
  double lower = -std::numeric_limits<double>::infinity();  // values must lie above (strictly, if `strict`)
  double upper = std::numeric_limits<double>::infinity();
  bool strict = false;
  bool transient = false;            // may carry jitter: control.lag and the channels
  std::vector<std::string> choices;  // for contact.model: value is an index into these
};

/// All addressable numbers of a world, in a fixed order.
class ParameterTable {
 public:
  explicit ParameterTable(const World& world);
  const std::vector<Parameter>& all() const { return parameters_; }
  const Parameter* find(const std::string& path) const;
  /// Indices of the paths that a glob matches, in table order. The path "robot.joint.*.axis" stands for its tilt and
  /// heading in the scenario file; here only leaves exist.
  std::vector<int> match(const std::string& pattern) const;
  /// The path nearest to one that matched nothing.
  std::string suggest(const std::string& pattern) const;

 private:
  std::vector<Parameter> parameters_;
  std::unordered_map<std::string, int> index_;  // by path
};

/// One fabricated particle, ready to simulate.
struct Particle {
  std::uint32_t id = 0;
  Model model;  // p*
  State initial;
  double control_lag = 0;           // s, persistent value
  std::vector<double> joint_zero;   // per actuator, rad: encoder reads q - zero
  std::vector<double> sensor_bias;  // per channel, in the order of channel_names()
  std::vector<BodyDisturbance> disturbances = {};
};

/// Builds particles of one world. Thread-safe.
class Fabricator {
 public:
  /// `paths`: the parameters that a particle sets, in the order of its values. Throws InputError for unknown ones.
  Fabricator(std::shared_ptr<const World> nominal, std::vector<std::string> paths);

  /// The particle with these values. Throws InputError that names the parameter if a value is impossible.
  Particle fabricate(std::uint32_t id, std::span<const double> values) const;
  /// The world that this particle's model is compiled from, without pictures of links that have collision shapes.
  /// Throws as fabricate().
  World perturbed(std::span<const double> values) const;
  /// p0: the nominal world, nothing perturbed.
  Particle nominal() const;
  const World& world() const { return *world_; }

 private:
  struct Plan;
  struct Made;
  Made make(std::span<const double> values) const;
  std::shared_ptr<const World> world_;
  std::vector<std::string> paths_;
  std::shared_ptr<const Plan> plan_;  // paths resolved to setters, once
};

}  // namespace graze
