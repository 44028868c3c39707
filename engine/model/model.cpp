#include "engine/model/model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <set>

#include "engine/model/inertia_rules.h"
#include "engine/model/limits.h"
#include "engine/model/placement.h"
#include "engine/model/rotation.h"
#include "engine/model/terrain_rise.h"
#include "engine/settings/settings.h"
#include "sampling/constants.h"

namespace graze {

namespace {

/// Where a link ended up after merging: a body (-1: the world) and the link frame in its frame.
struct Placement {
  int body = -1;
  Pose X_BL = Pose::Identity();
};

/// For each collider, whether a glob names it by its own or by its link's name.
std::vector<bool> named_by(const std::string& pattern, const std::vector<Collider>& colliders) {
  std::vector<bool> out(colliders.size());
  for (std::size_t i = 0; i < colliders.size(); ++i) {
    out[i] = matches(pattern, colliders[i].name) || matches(pattern, colliders[i].link);
  }
  return out;
}

/// An unordered pair of globs, resolved over all colliders.
struct PairMask {
  std::vector<bool> first, second;
  PairMask(const std::string& a, const std::string& b, const std::vector<Collider>& colliders)
      : first(named_by(a, colliders)), second(named_by(b, colliders)) {}
  bool operator()(int a, int b) const { return (first[a] && second[b]) || (first[b] && second[a]); }
};

class Compiler {
 public:
  explicit Compiler(const World& world) : world_(world) {}

  Model run(const Pose& X_WBase) {
    assert(!world_.robot.links.empty());
    model_.gravity = world_.gravity;
    model_.contact_model = world_.contact.model;
    model_.contact_solver = world_.contact.solver;
    model_.floating_base = world_.robot.floating_base;
    place_root(X_WBase);
    for (const Joint& joint : world_.robot.joints) place_child(joint);
    for (const Joint& joint : world_.robot.joints) couple(joint);
    for (const Link& link : world_.robot.links) add_link(link);
    for (const Object& object : world_.objects) add_object(object);
    finish_inertia();
    mass_ = moving_mass(model_);
    check_names();
    if (model_.colliders.size() > kMaxShapes) {
      throw InputError(fmt::format("{} collision shapes of the robot and the environment; at most {}",
                                   model_.colliders.size(), kMaxShapes));
    }
    add_pairs();
    return std::move(model_);
  }

 private:
  int add_body(const std::string& name, const std::string& joint, int parent, JointType type) {
    Body body;
    body.name = name;
    body.joint = joint;
    body.parent = parent;
    body.type = type;
    body.q = model_.nq;
    body.v = model_.nv;
    body.lower = -kInfinity;
    body.upper = body.effort = body.velocity = kInfinity;
    body.damping = body.friction = 0;
    model_.nq += type == JointType::floating ? 7 : 1;
    model_.nv += type == JointType::floating ? 6 : 1;
    model_.bodies.push_back(std::move(body));
    moments_.emplace_back();
    sources_.emplace_back();
    return static_cast<int>(model_.bodies.size()) - 1;
  }

  void place_root(const Pose& X_WBase) {
    const Link& root = world_.robot.links.front();
    Placement place;
    if (world_.robot.floating_base) {
      place.body = add_body(root.name, "", -1, JointType::floating);
    } else {
      place.X_BL = X_WBase;
    }
    places_[root.name] = place;
  }

  void place_child(const Joint& joint) {
    const Placement parent = places_.at(joint.parent);
    const Pose X_BJ = parent.X_BL * joint.X_PJ;
    if (joint.type == JointType::fixed) {
      places_[joint.child] = {parent.body, X_BJ};
      return;
    }
    const int index = add_body(joint.child, joint.name, parent.body, joint.type);
    Body& body = model_.bodies[index];
    body.X_PB = X_BJ;
    body.axis = joint.axis;
    body.lower = joint.lower;
    body.upper = joint.upper;
    body.effort = joint.effort;
    body.velocity = joint.velocity;
    body.damping = joint.damping;
    body.friction = joint.friction;
    body.armature = joint.armature();
    if (joint.mimic.joint.empty()) model_.actuated.push_back(index);
    places_[joint.child] = {index, Pose::Identity()};
  }

  /// A joint that follows another, which may come later in the tree.
  void couple(const Joint& joint) {
    if (joint.mimic.joint.empty()) return;
    Body& body = model_.bodies[model_.joint(joint.name)];
    body.mimics = model_.joint(joint.mimic.joint);
    body.multiplier = joint.mimic.multiplier;
    body.offset = joint.mimic.offset;
    assert(body.mimics >= 0 && model_.bodies[body.mimics].mimics < 0 && body.multiplier != 0);
  }

  void add_link(const Link& link) {
    const Placement& place = places_.at(link.name);
    model_.frames.push_back({link.name, place.body, place.X_BL});
    if (place.body >= 0) {
      moments_[place.body] =
          moments_[place.body] + link.inertia.transformed(place.X_BL.linear(), place.X_BL.translation());
      if (model_.bodies[place.body].name == link.name) sources_[place.body] = link.source;
    }
    for (const Geometry& geometry : link.collisions) {
      model_.colliders.push_back(
          {geometry.name, link.name, place.body, geometry.shape, place.X_BL * geometry.X_LG, false});
      friction_.push_back(link.friction);
      restitution_.push_back(link.restitution);
      spring_.emplace_back();
    }
  }

  void add_object(const Object& object) {
    int body = -1;
    if (object.movable) {
      body = add_body(object.name, "", -1, JointType::floating);
      moments_[body] = object.inertia;
      model_.frames.push_back({object.name, body, Pose::Identity()});
    }
    add_part(object, object.name, object.shape, body);
    for (std::size_t i = 0; i < object.more.size(); ++i) {
      add_part(object, fmt::format("{}.{}", object.name, i + 1), object.more[i], body);
    }
  }

  void add_part(const Object& object, const std::string& name, const Shape& shape, int body) {
    const Pose X_BG = object.movable ? Pose::Identity() : object.X_WO;
    model_.colliders.push_back({name, object.name, body, shape, X_BG, true});
    const ContactSettings& contact = world_.contact;
    friction_.push_back(std::isnan(object.friction) ? contact.friction : object.friction);
    restitution_.push_back(std::isnan(object.restitution) ? contact.restitution : object.restitution);
    spring_.push_back(object.spring.or_else(contact.spring));
  }

  void finish_inertia() {
    for (std::size_t i = 0; i < model_.bodies.size(); ++i) {
      Body& body = model_.bodies[i];
      body.mass = moments_[i].mass;
      check_mass(i);
      body.com = moments_[i].com();
      body.inertia = moments_[i].inertia_about_com();
      check_inertia(i);
    }
  }

  [[noreturn]] void refuse(std::size_t i, const std::string& rule) const {
    const Body& body = model_.bodies[i];
    const bool object = body.parent < 0 && body.joint.empty() && !(i == 0 && model_.floating_base);
    throw InputError(fmt::format("{}{}{} '{}': {}", sources_[i], sources_[i].empty() ? "" : ": ",
                                 object ? "object" : "link", body.name, rule));
  }

  void check_mass(std::size_t i) const {
    const std::string problem = mass_problem(model_.bodies[i].mass);
    if (!problem.empty()) refuse(i, problem);
  }

  void check_inertia(std::size_t i) const {
    const std::string problem = inertia_problem(model_.bodies[i].inertia);
    if (!problem.empty()) refuse(i, problem);
  }

  void check_names() const {
    std::set<std::string> seen;
    for (const Collider& collider : model_.colliders) {
      if (!seen.insert(collider.name).second) {
        throw InputError(fmt::format(
            "'{}': two parts have this name; names of links' shapes and of objects must differ", collider.name));
      }
    }
  }

  bool adjacent(int a, int b) const {
    if (a == b) return true;
    return (a >= 0 && model_.bodies[a].parent == b) || (b >= 0 && model_.bodies[b].parent == a);
  }

  bool candidate(const Collider& a, const Collider& b) const {
    if (a.body < 0 && b.body < 0) return false;
    if (a.is_object && b.is_object && a.body == b.body) return false;  // parts of one object
    if (a.is_object || b.is_object) return true;
    return world_.contact.self_collision && !adjacent(a.body, b.body);
  }

  /// The rule of ContactSettings, before its `pairs`.
  ColliderPair default_pair(int a, int b) const {
    const bool object_a = model_.colliders[a].is_object, object_b = model_.colliders[b].is_object;
    const ContactSettings& contact = world_.contact;
    double friction = friction_[a] * friction_[b];
    double restitution = std::max(restitution_[a], restitution_[b]);
    if (object_a && object_b) friction = std::min(friction_[a], friction_[b]);
    if (!object_a && !object_b) {
      friction *= contact.friction;
      restitution = std::max(restitution, contact.restitution);
    }
    return {a, b, friction, restitution, default_spring_of(a, b)};
  }

  /// Two objects in series give mostly where the softer one does, and a spring and damper in series with another is
  /// none: the pair has those of the softer, and of the less damped where both are as soft.
  Spring default_spring_of(int a, int b) const {
    const bool object_a = model_.colliders[a].is_object, object_b = model_.colliders[b].is_object;
    if (!object_a && !object_b) return world_.contact.spring;
    if (!object_a || !object_b) return spring_[object_a ? a : b];
    const Spring of_a = default_spring(mass_, spring_[a]), of_b = default_spring(mass_, spring_[b]);
    const bool first =
        of_a.stiffness == of_b.stiffness ? of_a.damping <= of_b.damping : of_a.stiffness < of_b.stiffness;
    return spring_[first ? a : b];
  }

  void add_pairs() {
    const ContactSettings& contact = world_.contact;
    const std::set<std::pair<std::string, std::string>> apart(contact.apart.begin(), contact.apart.end());
    std::vector<PairMask> ignore, special;
    for (const auto& [a, b] : contact.ignore) ignore.emplace_back(a, b, model_.colliders);
    for (const ContactPair& pair : contact.pairs) special.emplace_back(pair.a, pair.b, model_.colliders);
    const int n = static_cast<int>(model_.colliders.size());
    for (int a = 0; a < n; ++a) {
      for (int b = a + 1; b < n; ++b) {
        if (!candidate(model_.colliders[a], model_.colliders[b])) continue;
        if (std::any_of(ignore.begin(), ignore.end(), [&](const PairMask& mask) { return mask(a, b); })) continue;
        if (apart.contains({model_.colliders[a].name, model_.colliders[b].name})) continue;
        ColliderPair pair = default_pair(a, b);
        for (std::size_t i = 0; i < special.size(); ++i) {
          if (special[i](a, b)) override_pair(contact.pairs[i], pair);
        }
        model_.pairs.push_back(pair);
        if (model_.pairs.size() > kMaxPairs) refuse_pairs();
      }
    }
  }

  [[noreturn]] static void refuse_pairs() {
    throw InputError(
        fmt::format("more than {0} pairs of shapes may touch; at most {0}: use fewer shapes, contact.ignore, "
                    "or contact.self_collision: false",
                    kMaxPairs));
  }

  static void override_pair(const ContactPair& given, ColliderPair& pair) {
    if (!std::isnan(given.friction)) pair.friction = given.friction;
    if (!std::isnan(given.restitution)) pair.restitution = given.restitution;
    pair.spring = given.spring.or_else(pair.spring);
  }

  const World& world_;
  Model model_;
  std::map<std::string, Placement> places_;
  std::vector<MassMoments> moments_;            // per body, in its frame
  std::vector<std::string> sources_;            // per body, place of its link
  std::vector<double> friction_, restitution_;  // per collider
  std::vector<Spring> spring_;                  // per collider, of objects
  double mass_ = 0;                             // kg, of all bodies
};

Pose base_pose(const InitialState& initial) {
  Pose X = Pose::Identity();
  X.linear() = rotation_from_rpy(initial.rpy);
  X.translation() = initial.position;
  return X;
}

void set_floating(const Body& body, const Pose& X_WB, State& state) {
  const Quat R(X_WB.linear());
  state.q.segment<7>(body.q) << R.w(), R.x(), R.y(), R.z(), X_WB.translation();
}

void set_joint(const World& world, const Body& body, State& state) {
  const InitialState& initial = world.initial;
  const auto position = initial.joint_position.find(body.joint);
  const auto velocity = initial.joint_velocity.find(body.joint);
  state.q[body.q] =
      position != initial.joint_position.end() ? position->second : world.robot.default_position(body.joint);
  if (velocity != initial.joint_velocity.end()) state.v[body.v] = velocity->second;
}

/// Joints that follow others begin where these put them.
void set_mimics(const Model& model, State& state) {
  for (const Body& body : model.bodies) {
    if (body.mimics < 0) continue;
    const Body& other = model.bodies[body.mimics];
    state.q[body.q] = std::fma(body.multiplier, state.q[other.q], body.offset);
    state.v[body.v] = body.multiplier * state.v[other.v];
  }
}

/// The state with the base's height as it stands in `initial`.
State state_as_written(const World& world, const Model& model) {
  State state{Eigen::VectorXd::Zero(model.nq), Eigen::VectorXd::Zero(model.nv)};
  std::size_t object = 0;
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.type != JointType::floating) {
      set_joint(world, body, state);
    } else if (i == 0 && model.floating_base) {
      set_floating(body, base_pose(world.initial), state);
      state.v.segment<3>(body.v) = world.initial.angular_velocity;
      state.v.segment<3>(body.v + 3) = world.initial.linear_velocity;
    } else {
      while (!world.objects[object].movable) ++object;
      set_floating(body, world.objects[object++].X_WO, state);
    }
  }
  set_mimics(model, state);
  return state;
}

/// How far the robot must be raised so that its lowest point is `clearance` above z = 0, or above the terrain that is
/// below it, whichever is higher where there is a plane, too; 0 if it has no colliders.
double rise(const World& world, const Model& model, const State& state) {
  const std::vector<Pose> X_WB = place_bodies(model, state.q);
  const double lowest = lowest_point(model, X_WB);
  if (!std::isfinite(lowest)) return 0;
  const double onto_zero = world.initial.clearance - lowest;
  const std::optional<double> onto_terrain = rise_onto_terrain(model, X_WB);
  if (!onto_terrain) return onto_zero;
  const auto is_plane = [](const Collider& one) { return one.shape.kind == ShapeKind::plane; };
  const bool plane = std::any_of(model.colliders.begin(), model.colliders.end(), is_plane);
  const double rise = world.initial.clearance + *onto_terrain;
  return plane ? std::max(rise, onto_zero) : rise;
}

template <typename Items>
int index_of(const Items& items, const std::string& name) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

int Model::frame(const std::string& name) const { return index_of(frames, name); }

int Model::collider(const std::string& name) const { return index_of(colliders, name); }

int Model::joint(const std::string& name) const {
  if (name.empty()) return -1;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].joint == name) return static_cast<int>(i);
  }
  return -1;
}

Model compile(const World& world) {
  Pose X_WBase = base_pose(world.initial);
  Model model = Compiler(world).run(X_WBase);
  if (world.robot.floating_base || !world.initial.on_ground) return model;
  // A fixed base has no coordinates: its height must be found before it is merged into the world.
  X_WBase.translation().z() += rise(world, model, state_as_written(world, model));
  return Compiler(world).run(X_WBase);
}

State initial_state(const World& world, const Model& model) {
  State state = state_as_written(world, model);
  if (world.initial.on_ground && model.floating_base) {
    state.q[model.bodies[0].q + 6] += rise(world, model, state);
  }
  return state;
}

void add_point_mass(Body& body, const Vec3& p_B, double mass) {
  const double sum = body.mass + mass;
  if (!(sum > 0)) return;
  const Vec3 com = (body.mass * body.com + mass * p_B) / sum;
  const auto about = [](const Vec3& r) { return Mat3(r.squaredNorm() * Mat3::Identity() - r * r.transpose()); };
  body.inertia += body.mass * about(body.com - com) + mass * about(p_B - com);
  body.com = com;
  body.mass = sum;
}

double moving_mass(const Model& model) {
  double mass = 0;
  for (const Body& body : model.bodies) mass += body.mass;
  return mass;
}

std::size_t contact_model_index(const std::string& name, const std::string& back_end,
                                const std::vector<std::string>& models) {
  if (name.empty()) return 0;
  const auto found = std::find(models.begin(), models.end(), name);
  if (found != models.end()) return static_cast<std::size_t>(found - models.begin());
  const std::string near = nearest(name, models);
  throw InputError(fmt::format("contact.model: {}: unknown to the back end '{}', which has {}{}", name, back_end,
                               fmt::join(models, ", "), near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

}  // namespace graze
