#pragma once
// Random worlds with all sorts of shapes, joints and drives, and what their traces show, for tests of bits.

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "engine/model/convex_hull.h"
#include "engine/model/hull.h"
#include "sampling/stream.h"
#include "tests/engine/bullet/worlds.h"

namespace graze::test {

inline constexpr double kStep = 1e-3;  // s

/// Random numbers that are the same with every library.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double within(double low, double high) { return low + (high - low) * unit(); }
  /// From low to high, each power of ten as likely as the next.
  double decades(double low, double high) { return low * std::pow(high / low, unit()); }
  int below(int n) { return static_cast<int>(n * unit()); }
  bool once_in(int n) { return below(n) == 0; }
  Vec3 vector(double size) {
    const double x = within(-size, size), y = within(-size, size);
    return {x, y, within(-size, size)};
  }
  Mat3 turned() { return turn(within(-3, 3), vector(1) + Vec3(0, 0, 1e-3)); }

 private:
  std::mt19937_64 engine_;
};

inline Shape random_mesh(Dice& dice) {
  Mesh corners;
  const int count = 5 + dice.below(dice.once_in(3) ? 120 : 12);
  for (int i = 0; i < count; ++i) corners.vertices.push_back(dice.vector(0.1));
  const Vec3 size(dice.within(0.5, 1.5), dice.within(0.5, 1.5), dice.within(0.5, 1.5));
  const auto whole = convex_hull(corners);
  return {ShapeKind::mesh, size, whole, nullptr, simplified_hull(*whole, size, {24, 1e-3, false})};
}

inline Shape random_shape(Dice& dice) {
  switch (dice.below(6)) {
    case 0:
      return sphere(dice.within(0.02, 0.1));
    case 1:
      return capsule(dice.within(0.02, 0.06), dice.within(0.02, 0.2));
    case 2:
      return box(dice.within(0.03, 0.2), dice.within(0.03, 0.2), dice.within(0.03, 0.2));
    case 3:
      return cylinder(dice.within(0.02, 0.1), dice.within(0.03, 0.2));
    default:
      return random_mesh(dice);
  }
}

inline Shape random_terrain(Dice& dice) {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = grid->ny = 9;
  for (int i = 0; i < 81; ++i) grid->height.push_back(dice.within(-0.1, 0.1));
  return {ShapeKind::heightfield, {2, 2, 1}, nullptr, grid, nullptr, std::make_shared<Spectrum>()};
}

/// The same field with other heights.
inline std::shared_ptr<const HeightGrid> ground_of(std::uint32_t id, const HeightGrid& like) {
  HeightGrid out = like;
  const auto points = static_cast<std::uint32_t>(out.height.size());
  for (std::uint32_t i = 0; i < points; ++i) out.height[i] = 0.2 * uniform(1, id, name_hash("ground"), i) - 0.1;
  return std::make_shared<const HeightGrid>(std::move(out));
}

inline Joint random_joint(Dice& dice, int child, int parent) {
  const JointType types[] = {JointType::revolute, JointType::revolute, JointType::revolute, JointType::prismatic,
                             JointType::fixed};
  const auto name = [](int i) { return "l" + std::to_string(i); };
  Joint out = joint("j" + std::to_string(child), name(parent), name(child), types[dice.below(5)],
                    at(0, 0, 0, dice.turned()), dice.vector(1) + Vec3(1e-3, 0, 0));
  out.X_PJ.translation() = dice.vector(0.15);
  out.axis.normalize();
  if (dice.once_in(2)) out.lower = -dice.within(0, 1), out.upper = dice.within(0.1, 1);
  if (dice.once_in(3)) out.friction = dice.decades(1e-3, 1);
  if (dice.once_in(3)) out.damping = dice.decades(1e-3, 1);
  return out;
}

/// Some of the joints follow others, whether their limits leave them a position or not.
inline void add_mimics(Robot& robot, Dice& dice) {
  for (Joint& one : robot.joints) {
    if (one.type == JointType::fixed || !dice.once_in(4)) continue;
    const Joint& other = robot.joints[dice.below(static_cast<int>(robot.joints.size()))];
    const auto follows_one = [&](const Joint& joint) { return joint.mimic.joint == one.name; };
    if (!other.driven() || &other == &one) continue;
    if (std::any_of(robot.joints.begin(), robot.joints.end(), follows_one)) continue;
    one.mimic = {other.name, dice.decades(0.1, 10) * (dice.once_in(2) ? -1 : 1), dice.within(-0.5, 0.5)};
  }
}

/// A tree of up to eight links in a world of things, some of which overlap.
inline World random_world(Dice& dice) {
  World world;
  const int links = 1 + dice.below(8);
  for (int i = 0; i < links; ++i) {
    const std::string name = "l" + std::to_string(i);
    world.robot.links.push_back(link(name, random_shape(dice), dice.decades(0.01, 10), at(0, 0, 0, dice.turned())));
    if (i > 0) world.robot.joints.push_back(random_joint(dice, i, dice.below(i)));
  }
  add_mimics(world.robot, dice);
  world.robot.floating_base = links == 1 || !dice.once_in(4);
  const Pose tilted = at(0, 0, 0, dice.once_in(2) ? Mat3(Mat3::Identity()) : turn(0.1, dice.vector(1)));
  if (!dice.once_in(4))
    world.objects.push_back(fixed("ground", dice.once_in(2) ? plane() : random_terrain(dice), tilted));
  const int things = dice.below(4);
  for (int i = 0; i < things; ++i) {
    const std::string name = "thing" + std::to_string(i);
    const Pose X = at(0, 0, dice.within(0, 0.3), dice.turned());
    const bool moves = dice.once_in(2);
    world.objects.push_back(moves ? movable(name, random_shape(dice), dice.decades(0.01, 10), X)
                                  : fixed(name, random_shape(dice), X));
    world.objects.back().X_WO.translation() += dice.vector(0.4);
  }
  world.contact.friction = dice.once_in(5) ? 0 : dice.within(0.1, 1.5);
  world.contact.restitution = dice.once_in(2) ? 0 : dice.within(0, 1);
  return world;
}

/// A random world whose links begin in each other: the joints of its robot are near each other.
inline World tangled_world(Dice& dice) {
  World world = random_world(dice);
  for (Joint& each : world.robot.joints) each.X_PJ.translation() *= 0.2;
  return world;
}

/// One particle of the world: its own masses, ground, place, speeds and contact model.
inline Particle random_particle(World world, std::uint32_t id, const std::vector<std::string>& models, Dice& dice) {
  const double wild = dice.once_in(3) ? 1e5 : dice.once_in(2) ? 300 : 3;  // bound of the speeds, rad/s and m/s
  for (Link& each : world.robot.links) each.inertia = each.inertia.scaled(dice.within(0.5, 2));
  world.contact.model = models[dice.below(static_cast<int>(models.size()))];
  world.initial.position = dice.once_in(8) ? dice.vector(3) : Vec3(dice.vector(0.3) + Vec3(0, 0, 0.3));
  world.initial.rpy = dice.once_in(4) ? Vec3(Vec3::Zero()) : dice.vector(3);
  world.initial.linear_velocity = dice.once_in(2) ? Vec3(Vec3::Zero()) : Vec3(dice.vector(1) * dice.decades(0.1, wild));
  world.initial.angular_velocity =
      dice.once_in(2) ? Vec3(Vec3::Zero()) : Vec3(dice.vector(1) * dice.decades(0.1, wild));
  for (Joint& each : world.robot.joints) {
    if (each.type == JointType::fixed) continue;
    const double low = std::isfinite(each.lower) ? each.lower : -3, high = std::isfinite(each.upper) ? each.upper : 3;
    const double most = each.type == JointType::prismatic ? 0.2 : 3;
    world.initial.joint_position[each.name] = dice.within(std::max(low, -most), std::min(high, most));
    if (dice.once_in(2)) world.initial.joint_velocity[each.name] = dice.within(-1, 1) * dice.decades(0.1, wild);
  }
  for (Object& each : world.objects) {
    if (each.shape.grid) each.shape.grid = ground_of(id, *each.shape.grid);
  }
  Particle out = particle_of(world);
  out.id = id;
  for (const Body& body : out.model.bodies) {
    if (body.mimics < 0 || dice.once_in(2)) continue;  // else it begins off its line
    out.initial.q[body.q] += dice.within(-0.1, 0.1);
    out.initial.v[body.v] += dice.within(-1, 1) * dice.decades(0.1, wild);
  }
  return out;
}

/// What drives a particle's joints: springs, bounded torques and prescribed motion, or torques alone.
struct Driver {
  bool torques_alone;
  std::vector<std::array<double, 6>> joint;  // kp, kd, bound, amplitude, frequency, prescribed

  Driver(int na, bool alone, Dice& dice) : torques_alone(alone) {
    for (int k = 0; k < na; ++k) {
      const bool spring = !dice.once_in(3);
      joint.push_back({spring ? dice.decades(0.1, 1e4) : 0, spring ? dice.decades(1e-3, 100) : 0,
                       dice.decades(1e-2, 1e3), dice.decades(0.01, 3), dice.within(1, 100),
                       dice.once_in(6) ? 1.0 : 0.0});
    }
  }
  void fill(int step, int lane, Drive& drive) const {
    for (int k = 0; k < static_cast<int>(joint.size()); ++k) {
      const auto [kp, kd, bound, amplitude, frequency, prescribed] = joint[k];
      const double wave = amplitude * std::sin(frequency * step * kStep);
      drive.q(k, lane) = wave, drive.v(k, lane) = 0;
      drive.kp(k, lane) = kp, drive.kd(k, lane) = kd;
      drive.lower(k, lane) = -bound, drive.upper(k, lane) = bound;
      drive.prescribed(k, lane) = prescribed;
      drive.tau(k, lane) = kp > 0 || prescribed > 0 ? 0 : bound * wave;
    }
  }
};

/// Everything that a trace shows, as bytes; `ends` marks the steps, to tell where two differ.
struct Trace {
  std::string bytes, fault;
  std::vector<std::size_t> ends;

  void add(double x) { bytes.append(reinterpret_cast<const char*>(&x), sizeof x); }
  void add(const Vec3& x) { add(x.x()), add(x.y()), add(x.z()); }
};

inline void add_contacts(const BlockPhysics& physics, int lane, Trace& out) {
  for (const Contact& c : physics.contacts(lane)) {
    for (double x :
         {double(c.a), double(c.b), double(c.feature_a), double(c.feature_b), c.phi, double(c.mode), c.age}) {
      out.add(x);
    }
    out.add(c.p_W), out.add(c.n_W), out.add(c.impulse_W);
  }
}

/// Where two traces part, in words; empty if they do not.
inline std::string difference(const Trace& a, const Trace& b) {
  if (a.bytes == b.bytes && a.fault == b.fault) return "";
  const auto [p, q] = std::mismatch(a.bytes.begin(), a.bytes.end(), b.bytes.begin(), b.bytes.end());
  const auto step = std::upper_bound(a.ends.begin(), a.ends.end(), static_cast<std::size_t>(p - a.bytes.begin()));
  const std::size_t index = step - a.ends.begin(), begin = index ? a.ends[index - 1] : 0;
  const std::size_t number = (p - a.bytes.begin() - begin) / sizeof(double);
  double x = 0, y = 0;
  const std::size_t place = begin + number * sizeof(double);
  if (place + sizeof x <= a.bytes.size()) std::memcpy(&x, a.bytes.data() + place, sizeof x);
  if (place + sizeof y <= b.bytes.size()) std::memcpy(&y, b.bytes.data() + place, sizeof y);
  return fmt::format("step {} of {} against {}, number {}: {:a} against {:a}; '{}' against '{}'", index + 1,
                     a.ends.size(), b.ends.size(), number, x, y, a.fault, b.fault);
}

}  // namespace graze::test
