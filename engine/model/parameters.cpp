#include "engine/model/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "engine/model/limits.h"
#include "engine/model/rotation.h"

namespace graze {

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr const char* kAngles[] = {"roll", "pitch", "yaw"};

/// Bounds of a parameter's values.
struct Bounds {
  double lower = -kUnbounded, upper = kUnbounded;
  bool strict = false;
};
constexpr Bounds kAny{};
constexpr Bounds kSize{0, kMaxLength, true};
constexpr Bounds kPlace{-kMaxLength, kMaxLength, false};
constexpr Bounds kTurn{-kMaxAngle, kMaxAngle, false};
constexpr Bounds kPositive{0, kUnbounded, true};
constexpr Bounds kNonNegative{0, kUnbounded, false};
constexpr Bounds kUnit{0, 1, false};
constexpr Bounds kStiffness{kMinStiffness, kMaxStiffness, false};
constexpr Bounds kGear{0, kMaxGear, true};
constexpr Bounds kRotor{0, kMaxRotor, false};
constexpr Bounds kDamping{0, kMaxDamping, false};
constexpr Bounds kExponent{kLeastExponent, kMostExponent, false};

/// What a joint's channel measures; `turns`: its joint does.
Quantity joint_channel_quantity(const std::string& name, bool turns) {
  if (name.rfind("sensor.encoder.", 0) != 0) return turns ? Quantity::torque : Quantity::force;
  if (name.ends_with(".position")) return turns ? Quantity::angle : Quantity::length;
  if (name.ends_with(".velocity")) return turns ? Quantity::angular_velocity : Quantity::velocity;
  return turns ? Quantity::angular_acceleration : Quantity::acceleration;
}

/// `prismatic`: the joints that slide.
Quantity channel_quantity(const std::string& name, const std::unordered_set<std::string>& prismatic) {
  for (const std::string& start :
       {std::string("sensor.encoder."), std::string("sensor.torque."), std::string("actuator.torque.")}) {
    if (name.rfind(start, 0) != 0) continue;
    const std::size_t end = start == "sensor.encoder." ? name.rfind('.') : name.size();
    return joint_channel_quantity(name, prismatic.count(name.substr(start.size(), end - start.size())) == 0);
  }
  const auto has = [&](const char* text) { return name.find(text) != std::string::npos; };
  if (has("imu.linear")) return Quantity::acceleration;
  if (has("imu.angular")) return Quantity::angular_acceleration;
  if (has("magnetometer")) return Quantity::angle;
  if (has("estimate.velocity")) return Quantity::velocity;
  return has("estimate.rate") ? Quantity::angular_velocity : Quantity::length;
}

class Lister {
 public:
  explicit Lister(const World& world) : world_(world), mass_(world.moving_mass()) {}

  std::vector<AddressedParameter> run() {
    const Robot& robot = world_.robot;
    const std::vector<LinkPlan> plans = link_plans(robot);
    for (std::size_t i = 0; i < robot.links.size(); ++i) add_link(static_cast<int>(i), plans[i]);
    for (std::size_t i = 0; i < robot.joints.size(); ++i) add_joint(static_cast<int>(i));
    for (std::size_t i = 0; i < world_.objects.size(); ++i) add_object(static_cast<int>(i));
    add_contact();
    add_initial();
    add_rest();
    for (std::size_t i = 0; i < world_.disturbances.size(); ++i) add_disturbance(i);
    return std::move(out_);
  }

 private:
  template <typename Set>
  void add(const std::string& path, double nominal, Quantity quantity, const Bounds& bounds, Set set,
           bool transient = false) {
    out_.push_back({{path, nominal, quantity, bounds.lower, bounds.upper, bounds.strict, transient, {}}, set});
  }

  // ---- links

  void add_link(int i, const LinkPlan& plan) {
    const Link& link = world_.robot.links[i];
    const std::string path = "robot.link." + link.name + ".";
    const double mass = link.inertia.mass;
    if (mass > 0 && plan.volume() > 0) {
      const double density = mass / plan.volume();
      add(path + "density", density, Quantity::density, kPositive,
          [i, density](Draft& d, double x) { d.links[i].density = x / density; });
    }
    if (mass > 0) {
      add(path + "mass", mass, Quantity::mass, kPositive, [i](Draft& d, double x) { d.links[i].mass = x; });
    }
    if (plan.has_shape()) add_link_sizes(i, plan, path);
    if (mass > 0) add_link_com(i, path);
    if (link.collisions.empty()) return;
    add(path + "friction", link.friction, Quantity::dimensionless, kNonNegative,
        [i](Draft& d, double x) { d.world.robot.links[i].friction = x; });
    add(path + "restitution", link.restitution, Quantity::dimensionless, kUnit,
        [i](Draft& d, double x) { d.world.robot.links[i].restitution = x; });
  }

  void add_link_sizes(int i, const LinkPlan& plan, const std::string& path) {
    const Shape& shape = plan.primary(world_.robot).shape;
    if (plan.has_length()) {
      const double length = plan.length(world_.robot);
      add(path + "length", length, Quantity::length, kSize,
          [i, length](Draft& d, double x) { d.links[i].length = x / length; });
    }
    if (shape.kind == ShapeKind::box) {
      for (int k = 0; k < 3; ++k) {
        const double size = shape.size[k];
        add(path + "size." + kAxes[k], size, Quantity::length, kSize,
            [i, k, size](Draft& d, double x) { d.links[i].size[k] = x / size; });
      }
    } else {
      const double radius = shape.size.x();
      add(path + "radius", radius, Quantity::length, kSize,
          [i, radius](Draft& d, double x) { d.links[i].radius = x / radius; });
    }
  }

  void add_link_com(int i, const std::string& path) {
    const Vec3 com = world_.robot.links[i].inertia.com();
    for (int k = 0; k < 3; ++k) {
      add(path + "com." + kAxes[k], com[k], Quantity::length, kPlace,
          [i, k, nominal = com[k]](Draft& d, double x) { d.links[i].com[k] = x - nominal; });
    }
  }

  // ---- joints

  void add_joint(int i) {
    const Joint& joint = world_.robot.joints[i];
    if (joint.type == JointType::fixed) return;
    const bool turns = joint.type == JointType::revolute;
    const std::string path = "robot.joint." + joint.name + ".";
    add(path + "axis.tilt", 0, Quantity::angle, kAny, [i](Draft& d, double x) { d.axes[i].tilt = x; });
    add(path + "axis.heading", 0, Quantity::angle, kAny, [i](Draft& d, double x) { d.axes[i].heading = x; });
    for (int k = 0; k < 3; ++k) {
      add(path + "origin." + kAxes[k], joint.X_PJ.translation()[k], Quantity::length, kPlace,
          [i, k](Draft& d, double x) { d.world.robot.joints[i].X_PJ.translation()[k] = x; });
    }
    const auto member = [&](const char* name, double Joint::*field, Quantity quantity, const Bounds& bounds) {
      add(path + name, joint.*field, quantity, bounds,
          [i, field](Draft& d, double x) { d.world.robot.joints[i].*field = x; });
    };
    if (joint.driven()) member("zero", &Joint::zero, turns ? Quantity::angle : Quantity::length, turns ? kAny : kPlace);
    member("damping", &Joint::damping, turns ? Quantity::rotational_damping : Quantity::damping, kNonNegative);
    member("friction", &Joint::friction, turns ? Quantity::torque : Quantity::force, kNonNegative);
    if (!joint.driven()) return;
    member("effort", &Joint::effort, turns ? Quantity::torque : Quantity::force, kNonNegative);
    member("velocity", &Joint::velocity, turns ? Quantity::angular_velocity : Quantity::velocity, kNonNegative);
    if (!world_.knows_rotors) return;
    member("gear", &Joint::gear, Quantity::dimensionless, kGear);
    member("rotor_inertia", &Joint::rotor_inertia, Quantity::inertia, kRotor);
  }

  // ---- environment

  void add_object(int i) {
    const Object& object = world_.objects[i];
    const std::string path = "environment." + object.name + ".";
    const ContactSettings& contact = world_.contact;
    add(path + "friction", std::isnan(object.friction) ? contact.friction : object.friction, Quantity::dimensionless,
        kNonNegative, [i](Draft& d, double x) { d.world.objects[i].friction = x; });
    add(path + "restitution", std::isnan(object.restitution) ? contact.restitution : object.restitution,
        Quantity::dimensionless, kUnit, [i](Draft& d, double x) { d.world.objects[i].restitution = x; });
    add_spring(path, object.spring.or_else(contact.spring),
               [i](Draft& d) -> Spring& { return d.world.objects[i].spring; });
    if (object.movable) add_object_mass(i, path);
    add_object_sizes(i, path);
    for (int k = 0; k < 3; ++k) {
      add(path + "position." + kAxes[k], object.X_WO.translation()[k], Quantity::length, kPlace,
          [i, k](Draft& d, double x) { d.world.objects[i].X_WO.translation()[k] = x; });
    }
    const Vec3 rpy = rpy_from_rotation(object.X_WO.linear());
    for (int k = 0; k < 3; ++k) {
      add(path + "rotation." + kAngles[k], rpy[k], Quantity::angle, kAny, [i, k, rpy](Draft& d, double x) {
        if (d.objects[i].rpy.hasNaN()) d.objects[i].rpy = rpy;
        d.objects[i].rpy[k] = x;
      });
    }
  }

  /// Stiffness and damping, where the back end knows them; what is not given is nominally as for the nominal mass.
  /// `of`: where they stand in a draft.
  template <typename Of>
  void add_spring(const std::string& path, const Spring& given, Of of) {
    if (!world_.has_springs()) return;
    const Spring nominal = default_spring(mass_, given);
    add(path + "stiffness", nominal.stiffness, Quantity::stiffness, kStiffness,
        [of](Draft& d, double x) { of(d).stiffness = x; });
    add(path + "damping", nominal.damping, Quantity::damping, kDamping,
        [of](Draft& d, double x) { of(d).damping = x; });
  }

  void add_object_mass(int i, const std::string& path) {
    const Object& object = world_.objects[i];
    const double mass = object.inertia.mass, volume = object.volume();
    if (!(mass > 0)) return;
    if (volume > 0) {
      add(path + "density", mass / volume, Quantity::density, kPositive,
          [i, nominal = mass / volume](Draft& d, double x) { d.objects[i].density = x / nominal; });
    }
    add(path + "mass", mass, Quantity::mass, kPositive, [i](Draft& d, double x) { d.objects[i].mass = x; });
  }

  /// Of the factor of the heights: none may lie beyond the largest length.
  static Bounds scale_of(const HeightGrid& grid) {
    double most = 1;
    for (const double height : grid.height) most = std::max(most, std::abs(height));
    return {0, kMaxLength / most, true};
  }

  void add_object_sizes(int i, const std::string& path) {
    const Shape& shape = world_.objects[i].shape;
    const bool round = shape.kind == ShapeKind::cylinder || shape.kind == ShapeKind::capsule;
    if (round || shape.kind == ShapeKind::sphere) {
      add(path + "radius", shape.size.x(), Quantity::length, kSize,
          [i, nominal = shape.size.x()](Draft& d, double x) { d.objects[i].radius = x / nominal; });
    }
    if (round) {
      add(path + "length", shape.size.y(), Quantity::length, kSize,
          [i, nominal = shape.size.y()](Draft& d, double x) { d.objects[i].length = x / nominal; });
    }
    if (shape.spectrum) return add_spectrum(i, path);
    if (shape.kind != ShapeKind::box && shape.kind != ShapeKind::heightfield) return;
    for (int k = 0; k < 3; ++k) {
      add(path + "size." + kAxes[k], shape.size[k], Quantity::length,
          shape.grid && k == 2 ? scale_of(*shape.grid) : kSize,
          [i, k, nominal = shape.size[k]](Draft& d, double x) { d.objects[i].size[k] = x / nominal; });
    }
  }

  /// Sizes are not among them: waves of certain lengths fill the field, however large it is.
  void add_spectrum(int i, const std::string& path) {
    const Shape& shape = world_.objects[i].shape;
    const HeightGrid& grid = *shape.grid;
    const Spectrum& nominal = *shape.spectrum;
    const auto number = [&](const char* name, double Spectrum::*member, Quantity quantity, const Bounds& bounds) {
      add(path + "spectrum." + name, nominal.*member, quantity, bounds, [i, member, nominal](Draft& d, double x) {
        std::optional<Spectrum>& changed = d.objects[i].spectrum;
        if (!changed) changed = nominal;
        (*changed).*member = x;
      });
    };
    const SpectrumLimits limits = spectrum_limits(grid.nx, grid.ny, shape.size.x(), shape.size.y());
    number("rms", &Spectrum::rms, Quantity::length, {0, limits.rms, false});
    number("longest", &Spectrum::longest, Quantity::length, {limits.shortest, limits.longest, false});
    number("shortest", &Spectrum::shortest, Quantity::length, {limits.shortest, limits.longest, false});
    number("exponent", &Spectrum::exponent, Quantity::dimensionless, kExponent);
    number("seed", &Spectrum::seed, Quantity::dimensionless, kAny);
  }

  // ---- the rest

  void add_contact() {
    add("contact.friction", world_.contact.friction, Quantity::dimensionless, kNonNegative,
        [](Draft& d, double x) { d.world.contact.friction = x; });
    add("contact.restitution", world_.contact.restitution, Quantity::dimensionless, kUnit,
        [](Draft& d, double x) { d.world.contact.restitution = x; });
    add_spring("contact.", world_.contact.spring, [](Draft& d) -> Spring& { return d.world.contact.spring; });
    const std::vector<std::string>& models = world_.contact_models;
    const auto chosen = std::find(models.begin(), models.end(), world_.contact.model);
    const Bounds bounds{0, static_cast<double>(models.size()) - 1, false};
    add("contact.model", static_cast<double>(chosen == models.end() ? 0 : chosen - models.begin()),
        Quantity::dimensionless, bounds,
        [](Draft& d, double x) { d.world.contact.model = d.world.contact_models[static_cast<std::size_t>(x)]; });
    out_.back().parameter.choices = models;
  }

  void add_initial() {
    for (int k = 0; k < 3; ++k) {
      add(std::string("initial.base.") + kAxes[k], 0, Quantity::length, kPlace, [k](Draft& d, double x) {
        d.world.initial.position[k] += x;
        if (k == 2) d.world.initial.clearance += x;  // which counts instead of the position when it is on the ground
      });
    }
    for (int k = 0; k < 3; ++k) {
      add(std::string("initial.base.") + kAngles[k], 0, Quantity::angle, kAny,
          [k](Draft& d, double x) { d.world.initial.rpy[k] += x; });
    }
    if (world_.robot.floating_base) add_initial_velocity();
    for (const Joint& joint : world_.robot.joints) {
      if (joint.driven()) add_initial_joint(joint);
    }
  }

  void add_initial_velocity() {
    for (int k = 0; k < 3; ++k) {
      add(std::string("initial.base.velocity.") + kAxes[k], 0, Quantity::velocity, kAny,
          [k](Draft& d, double x) { d.world.initial.linear_velocity[k] += x; });
    }
    for (int k = 0; k < 3; ++k) {
      add(std::string("initial.base.velocity.") + kAngles[k], 0, Quantity::angular_velocity, kAny,
          [k](Draft& d, double x) { d.world.initial.angular_velocity[k] += x; });
    }
  }

  void add_initial_joint(const Joint& joint) {
    const bool turns = joint.type == JointType::revolute;
    const std::string path = "initial.joint." + joint.name + ".";
    const auto position = world_.initial.joint_position.find(joint.name);
    const double start =
        position == world_.initial.joint_position.end() ? world_.robot.default_position(joint.name) : position->second;
    add(path + "position", 0, turns ? Quantity::angle : Quantity::length, turns ? kTurn : kPlace,
        [name = joint.name, start](Draft& d, double x) { d.world.initial.joint_position[name] = start + x; });
    add(path + "velocity", 0, turns ? Quantity::angular_velocity : Quantity::velocity, kAny,
        [name = joint.name](Draft& d, double x) { d.world.initial.joint_velocity[name] += x; });
  }

  void add_rest() {
    add(
        "control.lag", world_.control_lag, Quantity::time, kNonNegative,
        [](Draft& d, double x) { d.world.control_lag = x; }, true);
    for (int k = 0; k < 3; ++k) {
      add(std::string("gravity.") + kAxes[k], world_.gravity[k], Quantity::acceleration, kAny,
          [k](Draft& d, double x) { d.world.gravity[k] = x; });
    }
    const std::vector<std::string> channels = channel_names(world_.robot);
    const std::vector<double> bias = nominal_bias(world_);
    std::unordered_set<std::string> prismatic;
    for (const Joint& joint : world_.robot.joints) {
      if (joint.type == JointType::prismatic) prismatic.insert(joint.name);
    }
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const bool probability = channels[i].rfind("sensor.contact.", 0) == 0;
      add(
          channels[i], bias[i], probability ? Quantity::dimensionless : channel_quantity(channels[i], prismatic),
          probability ? kUnit : kAny, [i](Draft& d, double x) { d.sensor_bias[i] = x; }, !probability);
    }
  }

  void add_disturbance(std::size_t i) {
    const Disturbance& one = world_.disturbances[i];
    const std::string path = "disturbances." + one.name + ".";
    const auto number = [&](const char* name, double Disturbance::*member, Quantity quantity, const Bounds& bounds) {
      add(path + name, one.*member, quantity, bounds,
          [i, member](Draft& d, double x) { d.world.disturbances[i].*member = x; });
    };
    number("at", &Disturbance::at, Quantity::time, kNonNegative);
    if (one.kind == Disturbance::Kind::payload) {
      number("mass", &Disturbance::mass, Quantity::mass, {0, kMostPayload, false});
    } else {
      number(one.is_force ? "force" : "impulse", &Disturbance::strength,
             one.is_force ? Quantity::force : Quantity::impulse, {-kMostPush, kMostPush, false});
      number("azimuth", &Disturbance::azimuth, Quantity::angle, kTurn);
      number("elevation", &Disturbance::elevation, Quantity::angle, kTurn);
      number("duration", &Disturbance::duration, Quantity::time, kNonNegative);
    }
    for (int k = 0; k < 3; ++k) {
      add(path + "point." + kAxes[k], one.point[k], Quantity::length, kPlace,
          [i, k](Draft& d, double x) { d.world.disturbances[i].point[k] = x; });
    }
  }

  const World& world_;
  double mass_;  // kg, of all that moves
  std::vector<AddressedParameter> out_;
};

}  // namespace

std::vector<AddressedParameter> list_parameters(const World& world) { return Lister(world).run(); }

std::vector<double> nominal_bias(const World& world) {
  std::vector<double> bias;
  for (const std::string& name : channel_names(world.robot)) {
    const auto found = world.sensor_bias.find(name);
    bias.push_back(found == world.sensor_bias.end() ? 0 : found->second);
  }
  return bias;
}

}  // namespace graze
