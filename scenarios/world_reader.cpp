#include "scenarios/world_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "engine/control/joint_values.h"
#include "engine/model/limits.h"
#include "engine/model/rotation.h"
#include "engine/model/srdf.h"
#include "engine/physics.h"
#include "engine/settings/warnings.h"
#include "scenarios/disturbances.h"
#include "scenarios/doubts.h"
#include "scenarios/keys.h"
#include "scenarios/limits.h"
#include "scenarios/names.h"
#include "scenarios/robot_file.h"
#include "scenarios/rotors.h"
#include "scenarios/spectrum.h"
#include "scenarios/springs.h"

namespace graze {
namespace {

Vec3 read_vec3(const Settings& map, const char* key, Quantity quantity) {
  const auto value = map.find(key);
  if (!value) return Vec3::Zero();
  const std::vector<double> v = quantity == Quantity::length ? checked_lengths(*value, 3) : value->numbers(3, quantity);
  return {v[0], v[1], v[2]};
}

class WorldReader {
 public:
  WorldReader(const Settings& scenario, const WorldOptions& options) : root_(scenario), options_(options) {
    out_.world = std::make_shared<World>();
  }

  ReadWorld read() {
    world().contact_models = contact_models_of(options_.physics);
    world().knows_rotors = physics_text(options_.physics).knows_rotors;
    read_robot(root_.at("robot"));
    read_rotors(root_, options_.physics, world());
    read_contact();
    if (const auto environment = root_.find("environment")) {
      const auto objects = environment->entries();
      check_count(*environment, objects.size(), kMaxObjects, "objects");
      for (const auto& [name, value] : objects) add_object(name, value);
    }
    read_springs(root_, options_.physics, world(),
                 [this](const Settings& map, const char* key, const Parameter& parameter, double& value) {
                   number(map, key, parameter, value);
                 });
    read_disturbances(root_, world(),
                      [this](const Settings& map, const char* key, const Parameter& parameter, double& value) {
                        number(map, key, parameter, value);
                      });
    if (root_.has("gravity")) read_gravity(root_.at("gravity"));
    if (const auto control = root_.find("control")) {
      control->allow(keys_of("control"));
      Parameter lag = at_least_zero("control.lag");
      lag.quantity = Quantity::time;
      lag.transient = true;
      number(*control, "lag", lag, world().control_lag);
    }
    return std::move(out_);
  }

 private:
  World& world() { return *out_.world; }

  /// A number, or a distribution whose mean is the number.
  void number(const Settings& map, const char* key, Parameter parameter, double& value) {
    const auto settings = map.find(key);
    if (!settings) return;
    parameter.nominal = value;
    Spread spread = read_spread(*settings, parameter, Standing::as_nominal);
    value = spread.persistent.mean();
    if (is_spread(*settings)) out_.uncertain.push_back({parameter.path, *settings, std::move(spread)});
  }

  void read_robot(const Settings& robot) {
    robot.allow(keys_of("robot"));
    UrdfOptions urdf = read_urdf_options(robot, options_.ignore_missing_meshes);
    if (const auto density = robot.find("density")) doubt_density(*density, urdf.density);
    urdf.warn = [this](const std::string& warning) { out_.warnings.push_back(warning); };
    world().robot = read_robot_file(robot, urdf);
    if (const auto srdf = robot.find("srdf")) read_srdf(*srdf, urdf);
    if (const auto initial = robot.find("initial")) read_initial(*initial);
  }

  void read_srdf(const Settings& srdf, const UrdfOptions& urdf) {
    try {
      world().contact.ignore = load_srdf(srdf.resolve_file(srdf.text()), world().robot, urdf.warn);
    } catch (const InputError& e) {
      srdf.fail(e.what());
    }
  }

  void read_initial(const Settings& initial) {
    initial.allow(keys_of("initial"));
    InitialState& state = world().initial;
    state.position = read_vec3(initial, "position", Quantity::length);
    read_orientation(initial);
    if (const auto height = initial.find("height")) read_height(initial, *height);
    if (const auto clearance = initial.find("clearance")) {
      state.clearance = checked_length(*clearance, clearance->number(Quantity::length));
    }
    if (state.clearance != 0 && !state.on_ground) initial.at("clearance").fail_key("goes with 'height: on_ground'");
    state.linear_velocity = read_vec3(initial, "velocity", Quantity::velocity);
    state.angular_velocity = read_vec3(initial, "angular_velocity", Quantity::angular_velocity);
    read_joints(initial, "joints", Quantity::angle, Quantity::length, state.joint_position);
    read_joints(initial, "joint_velocities", Quantity::angular_velocity, Quantity::velocity, state.joint_velocity);
  }

  void read_orientation(const Settings& initial) {
    world().initial.rpy = read_vec3(initial, "rpy", Quantity::angle);
    const auto orientation = initial.find("orientation");
    if (!orientation) return;
    if (initial.has("rpy")) orientation->fail_key("either 'orientation' (quaternion w, x, y, z) or 'rpy'");
    const std::vector<double> q = orientation->numbers(4);
    const Quat quaternion(q[0], q[1], q[2], q[3]);
    constexpr double kRounding = 1e-3;  // of a quaternion written with three digits
    if (std::abs(quaternion.norm() - 1) > kRounding) {
      orientation->fail(fmt::format("a quaternion of length {:g}; it must be 1", quaternion.norm()));
    }
    world().initial.rpy = rpy_from_rotation(quaternion.normalized().toRotationMatrix());
  }

  void read_height(const Settings& initial, const Settings& height) {
    InitialState& state = world().initial;
    if (height.is_scalar() && height.text() == "on_ground") {
      state.on_ground = true;
      return;
    }
    const std::string first = height.is_scalar() ? height.text().substr(0, 1) : "";
    if (!first.empty() && std::isalpha(static_cast<unsigned char>(first[0]))) height.choice({"on_ground"});
    if (initial.has("position")) height.fail_key("either 'height' or the z of 'position'; or 'height: on_ground'");
    state.position.z() = checked_length(height, height.number(Quantity::length));
  }

  /// Joints that follow others begin where these put them; globs pass over them.
  void refuse_mimic(const Settings& value, const std::string& name) {
    for (const Joint& joint : world().robot.joints) {
      if (joint.name != name || joint.mimic.joint.empty()) continue;
      value.fail_key(
          fmt::format("'{0}' follows '{1}' (<mimic> of the URDF: {2:g} times its position{3}) and begins "
                      "where that puts it; say where '{1}' begins",
                      name, joint.mimic.joint, joint.mimic.multiplier,
                      joint.mimic.offset == 0 ? "" : fmt::format(" + {:g}", joint.mimic.offset)));
    }
  }

  void read_joints(const Settings& initial, const char* key, Quantity angular, Quantity linear,
                   std::map<std::string, double>& out) {
    const auto joints = initial.find(key);
    if (!joints) return;
    std::vector<const Joint*> moving;
    std::vector<std::string> names;
    for (const Joint& joint : world().robot.joints) {
      if (!joint.driven()) continue;
      moving.push_back(&joint);
      names.push_back(joint.name);
    }
    check_count(*joints, joints->entries().size(), kMaxJointEntries, "entries");
    for (const auto& [pattern, value] : joints->entries()) {
      refuse_mimic(value, pattern);
      for (const int i : match_names(value, pattern, names, "joint")) {
        const Quantity quantity = moving[i]->type == JointType::revolute ? angular : linear;
        const double number = value.number(quantity);
        if (quantity == Quantity::length) checked_length(value, number);
        if (quantity == Quantity::angle) checked_angle(value, number);
        out[names[i]] = number;
        if (&out != &world().initial.joint_position) continue;
        const auto [lower, upper] = world().robot.room(names[i]);
        const JointRoom room{names[i], lower, upper, quantity == Quantity::angle};
        doubt_position(value, room, out[names[i]]);
      }
    }
  }

  static void doubt_density(const Settings& value, double density) {
    constexpr double kFoam = 10;  // kg/m^3, of the lightest foams that are sold
    if (density >= kFoam) return;
    warn(value, fmt::format("{:g} kg/m^3 is lighter than foam; did you mean {:g} g/cm^3?", density, density));
  }

  static Parameter at_least_zero(const std::string& path) {
    Parameter out;
    out.path = path;
    out.lower = 0;
    return out;
  }

  static Parameter restitution(const std::string& path) {
    Parameter out = at_least_zero(path);
    out.upper = 1;
    return out;
  }

  void read_contact() {
    const auto contact = root_.find("contact");
    ContactSettings& out = world().contact;
    out.model = world().contact_models.front();
    if (!contact) return;
    contact->allow(keys_of("contact"));
    number(*contact, "friction", at_least_zero("contact.friction"), out.friction);
    number(*contact, "restitution", restitution("contact.restitution"), out.restitution);
    read_model(*contact);
    read_solver(*contact);
    out.self_collision = contact->flag_or("self_collision", true);
    if (const auto pairs = contact->find("pairs")) {
      check_count(*pairs, pairs->items().size(), kMaxContactRules, "pairs");
      for (const Settings& pair : pairs->items()) add_pair(pair);
    }
    if (const auto ignore = contact->find("ignore")) {
      check_count(*ignore, ignore->items().size(), kMaxContactRules, "pairs");
      for (const Settings& pair : ignore->items()) out.ignore.push_back(two_names(pair));
    }
  }

  void read_model(const Settings& contact) {
    const auto model = contact.find("model");
    if (!model) return;
    Parameter parameter;
    parameter.path = "contact.model";
    parameter.choices = world().contact_models;
    Spread spread = read_spread(*model, parameter);
    const auto index = static_cast<std::size_t>(spread.persistent.median());
    world().contact.model = world().contact_models.at(index);
    if (is_spread(*model)) out_.uncertain.push_back({parameter.path, *model, std::move(spread)});
  }

  void read_solver(const Settings& contact) {
    const auto solver = contact.find("solver");
    if (!solver) return;
    const std::string name = solver->choice({"auto", "sweeps", "newton"});
    if (options_.physics != "lanes") warn(*solver, fmt::format("'{}' has a solver of its own", options_.physics));
    ContactSolver& out = world().contact.solver;
    out = name == "auto" ? ContactSolver::automatic : name == "sweeps" ? ContactSolver::sweeps : ContactSolver::newton;
  }

  static std::pair<std::string, std::string> two_names(const Settings& pair) {
    const std::vector<Settings> names = pair.items();
    if (!pair.is_list() || names.size() != 2) pair.fail("must be a list of two globs of part names, [a, b]");
    return {names[0].glob(), names[1].glob()};
  }

  void add_pair(const Settings& pair) {
    pair.allow(keys_of("pair"));
    ContactPair out;
    std::tie(out.a, out.b) = two_names(pair.at("between"));
    if (const auto friction = pair.find("friction")) {
      out.friction = friction->non_negative();
      if (out.friction > kMostFriction) warn(*friction, friction_doubt(out.friction));
    }
    if (const auto restitution = pair.find("restitution")) out.restitution = restitution->within(0, 1);
    world().contact.pairs.push_back(out);
  }

  void add_object(const std::string& name, const Settings& settings) {
    settings.allow(keys_of("object"));
    Object object;
    object.name = name;
    if (name.empty()) settings.fail_key("an object needs a name");
    if (name.find_first_of("*?{}") != std::string::npos) {
      settings.fail_key("an object's name must have none of * ? { }, which globs of names are made of");
    }
    if (std::any_of(name.begin(), name.end(),
                    [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; })) {
      settings.fail_key("an object's name must have no control characters");
    }
    for (const Link& link : world().robot.links) {
      if (link.name == name)
        settings.fail_key("a link of the robot has this name; call the object otherwise (graze new does)");
    }
    object.more = read_shapes(settings);
    object.shape = object.more.front();
    object.more.erase(object.more.begin());
    object.X_WO = read_object_pose(settings, object.shape);
    const std::string path = "environment." + name;
    if (object.shape.spectrum) {
      read_spectrum_spreads(shape_settings(settings).at("spectrum"), path, object.shape,
                            [this](const Settings& map, const char* key, const Parameter& parameter, double& value) {
                              number(map, key, parameter, value);
                            });
    }
    // NaN, the engine's "as the contact settings say", stays unless the file has a value.
    const auto coefficient = [&](const char* key, const Parameter& parameter, double fallback, double& value) {
      if (!settings.has(key)) return;
      value = fallback;
      number(settings, key, parameter, value);
    };
    const ContactSettings& contact = world().contact;
    coefficient("friction", at_least_zero(path + ".friction"), contact.friction, object.friction);
    coefficient("restitution", restitution(path + ".restitution"), contact.restitution, object.restitution);
    object.movable = settings.flag_or("movable", false);
    read_inertia(settings, object, path);
    world().objects.push_back(std::move(object));
  }

  void read_inertia(const Settings& settings, Object& object, const std::string& path) {
    const auto density = settings.find("density"), mass = settings.find("mass");
    if (!object.movable) {
      if (density) density->fail_key("only a movable object has a density; add 'movable: true'");
      if (mass) mass->fail_key("only a movable object has a mass; add 'movable: true'");
      return;
    }
    check_movable(settings, object);
    const double volume = object.volume();
    if (static_cast<bool>(density) == static_cast<bool>(mass)) {
      settings.fail(density ? "has both; a movable object needs either 'density' or 'mass'"
                            : "a movable object needs either 'density' or 'mass'");
    }
    double value = 0, robot = 0;
    for (const Link& link : world().robot.links) robot += link.inertia.mass;
    if (density) {
      number(settings, "density", positive(path + ".density", Quantity::density), value);
      doubt_density(*density, value);
      doubt_weight(shape_settings(settings), value, volume, robot);
    } else {
      number(settings, "mass", positive(path + ".mass", Quantity::mass), value);
      if (robot > 0 && value > kHeaviest * robot) {
        warn(*mass, fmt::format("{:g} kg is {:.3g} times the robot's {:g} kg; did you mean {:g} g?", value,
                                value / robot, robot, value));
      } else {
        doubt_mass(*mass, shape_settings(settings), value, volume);
      }
      value /= volume;
    }
    object.inertia = MassMoments::of_shape(object.shape, value);
    for (const Shape& part : object.more) object.inertia = object.inertia + MassMoments::of_shape(part, value);
    const Settings& said = density ? *density : *mass;
    check_inertia(said, object.inertia);
    const double weighs = object.inertia.mass;
    if (!(weighs >= kLeastMass && weighs <= kMostMass)) {
      said.fail(fmt::format("{:g} kg; a movable object weighs {:g} to {:g} kg", weighs, kLeastMass, kMostMass));
    }
  }

  /// A movable object's shape has a volume, and is larger than the gap that counts as none.
  static void check_movable(const Settings& settings, const Object& object) {
    const Shape& shape = object.shape;
    if (shape.kind == ShapeKind::plane || shape.kind == ShapeKind::heightfield) {
      settings.fail("a plane or a heightfield cannot be movable");
    }
    double least = smallest_length(shape);
    for (const Shape& part : object.more) least = std::min(least, smallest_length(part));
    if (least >= kMinMovable) return;
    shape_settings(settings).fail(fmt::format(
        "{:g} m: a movable object is at least {:g} m long, wide and high; parts with smaller gaps count as touching",
        least, kMinMovable));
  }

  /// Smallest radius or edge of a shape or of a box about it, m.
  static double smallest_length(const Shape& shape) {
    if (shape.kind == ShapeKind::sphere) return shape.size.x();
    if (shape.kind != ShapeKind::mesh)
      return shape.kind == ShapeKind::box ? shape.size.minCoeff() : shape.size.head<2>().minCoeff();
    Eigen::AlignedBox3d box;
    for (const Vec3& vertex : shape.mesh->vertices) box.extend(vertex.cwiseProduct(shape.size));
    return box.sizes().minCoeff();
  }

  /// What a mass or density comes to must be numbers that can be computed with.
  static void check_inertia(const Settings& where, const MassMoments& inertia) {
    const double least = inertia.inertia_about_com().diagonal().minCoeff();
    if (inertia.mass > 0 && std::isfinite(inertia.mass) && inertia.second.allFinite() && std::isnormal(least)) return;
    where.fail(
        fmt::format("gives a mass of {:g} kg and a smallest inertia of {:g} kg m^2; both must be positive and finite",
                    inertia.mass, least));
  }

  static Parameter positive(const std::string& path, Quantity quantity) {
    Parameter out = at_least_zero(path);
    out.quantity = quantity;
    out.strict = true;
    return out;
  }

  void read_gravity(const Settings& gravity) {
    if (gravity.is_list()) {
      world().gravity = read_vec3(root_, "gravity", Quantity::acceleration);
    } else {
      const double down = gravity.number(Quantity::acceleration);
      if (down < 0) {
        gravity.fail(
            fmt::format("{:g}: pulls down where it is a single number, so must be >= 0; did you mean {:g}, or "
                        "[0, 0, {:g}] for one that lifts?",
                        down, -down, -down));
      }
      world().gravity = {0, 0, -down};
    }
  }

  const Settings& root_;
  const WorldOptions& options_;
  ReadWorld out_;
};

}  // namespace

ReadWorld read_world(const Settings& scenario, const WorldOptions& options) {
  return WorldReader(scenario, options).read();
}

void check_contact_names(const Settings& scenario, const Model& model) {
  const auto contact = scenario.find("contact");
  if (!contact) return;
  const std::vector<std::string> names = part_names(model);
  const auto check = [&](const Settings& pair) {
    for (const Settings& name : pair.items()) match_names(name, name.text(), names, "part");
  };
  if (const auto pairs = contact->find("pairs")) {
    for (const Settings& pair : pairs->items()) check(pair.at("between"));
  }
  if (const auto ignore = contact->find("ignore")) {
    for (const Settings& pair : ignore->items()) check(pair);
  }
}

}  // namespace graze
