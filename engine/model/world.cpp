#include "engine/model/world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

namespace graze {

namespace {

constexpr double kPi = std::numbers::pi;

double sphere_volume(double r) { return 4.0 / 3.0 * kPi * r * r * r; }

double cylinder_volume(double r, double length) { return kPi * r * r * length; }

/// Sum over the tetrahedra (origin, triangle) of a closed surface; density 1.
MassMoments mesh_moments(const Mesh& mesh, const Vec3& scale) {
  MassMoments sum;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cwiseProduct(scale);
    const Vec3 b = mesh.vertices[t[1]].cwiseProduct(scale);
    const Vec3 c = mesh.vertices[t[2]].cwiseProduct(scale);
    const double volume = a.dot(b.cross(c)) / 6;
    const Vec3 s = a + b + c;
    sum.mass += volume;
    sum.first += volume / 4 * s;
    sum.second += volume / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  return sum.mass < 0 ? sum.scaled(-1) : sum;  // a mirroring scale turns the triangles inside out
}

/// Diagonal of the second moment about the centre, per unit of volume times the volume (m^5), of a capsule: a cylinder
/// and two hemispheres whose centroids lie 3 r / 8 above their flat faces.
Vec3 capsule_second(double r, double length) {
  const double cylinder = cylinder_volume(r, length), caps = sphere_volume(r), h = length / 2;
  const double across = cylinder * r * r / 4 + caps * r * r / 5;
  return {across, across, cylinder * length * length / 12 + caps * (h * h + 3 * h * r / 4 + r * r / 5)};
}

/// Diagonal of the second moment of a homogeneous primitive of density 1 about its centre.
Vec3 primitive_second(const Shape& shape, double volume) {
  const Vec3& s = shape.size;
  switch (shape.kind) {
    case ShapeKind::box:
      return volume / 12 * s.cwiseAbs2();
    case ShapeKind::sphere:
      return volume / 5 * Vec3::Constant(s.x() * s.x());
    case ShapeKind::cylinder:
      return volume * Vec3(s.x() * s.x() / 4, s.x() * s.x() / 4, s.y() * s.y() / 12);
    case ShapeKind::capsule:
      return capsule_second(s.x(), s.y());
    default:
      return Vec3::Zero();
  }
}

template <typename Items>
const auto& named(const Items& items, const std::string& name, const char* what) {
  const auto found = std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  if (found == items.end()) throw std::out_of_range(std::string("no ") + what + " '" + name + "'");
  return *found;
}

}  // namespace

double Shape::volume() const {
  switch (kind) {
    case ShapeKind::box:
      return size.prod();
    case ShapeKind::sphere:
      return sphere_volume(size.x());
    case ShapeKind::cylinder:
      return cylinder_volume(size.x(), size.y());
    case ShapeKind::capsule:
      return cylinder_volume(size.x(), size.y()) + sphere_volume(size.x());
    case ShapeKind::mesh:
      return mesh_moments(*mesh, size).mass;
    case ShapeKind::plane:
    case ShapeKind::heightfield:
      break;
  }
  return 0;
}

MassMoments MassMoments::from_inertia(double mass, const Vec3& com, const Mat3& inertia_about_com) {
  // I = tr(S) 1 - S, so tr(I) = 2 tr(S).
  const Mat3 central = 0.5 * inertia_about_com.trace() * Mat3::Identity() - inertia_about_com;
  return {mass, mass * com, central + mass * com * com.transpose()};
}

MassMoments MassMoments::of_shape(const Shape& shape, double density) {
  if (shape.kind == ShapeKind::mesh) return mesh_moments(*shape.mesh, shape.size).scaled(density);
  const double volume = shape.volume();
  return {density * volume, Vec3::Zero(), density * Mat3(primitive_second(shape, volume).asDiagonal())};
}

Vec3 MassMoments::com() const { return mass > 0 ? Vec3(first / mass) : Vec3(Vec3::Zero()); }

Mat3 MassMoments::inertia_about_com() const {
  const Vec3 c = com();
  const Mat3 central = second - mass * c * c.transpose();
  return central.trace() * Mat3::Identity() - central;
}

MassMoments MassMoments::transformed(const Mat3& A, const Vec3& t) const {
  const Vec3 moved = A * first;
  const Mat3 cross = moved * t.transpose();
  return {mass, moved + mass * t, A * second * A.transpose() + cross + cross.transpose() + mass * t * t.transpose()};
}

MassMoments MassMoments::operator+(const MassMoments& other) const {
  return {mass + other.mass, first + other.first, second + other.second};
}

MassMoments MassMoments::scaled(double factor) const { return {factor * mass, factor * first, factor * second}; }

Spring Spring::or_else(const Spring& other) const {
  return {std::isnan(stiffness) ? other.stiffness : stiffness, std::isnan(damping) ? other.damping : damping};
}

Spring default_spring(double mass, const Spring& given) {
  constexpr double kGravity = 9.81, kSink = 0.5e-3;  // m/s^2, m
  Spring out = given.or_else({mass * kGravity / kSink, given.damping});
  if (std::isnan(out.damping)) out.damping = 2 * std::sqrt(out.stiffness * mass);
  return out;
}

double Object::volume() const {
  double out = shape.volume();
  for (const Shape& part : more) out += part.volume();
  return out;
}

double World::moving_mass() const {
  std::set<std::string> welded;
  if (!robot.floating_base && !robot.links.empty()) welded.insert(robot.links.front().name);
  for (const Joint& joint : robot.joints) {
    if (joint.type == JointType::fixed && welded.count(joint.parent) > 0) welded.insert(joint.child);
  }
  double out = 0;
  for (const Link& link : robot.links) out += welded.count(link.name) > 0 ? 0 : link.inertia.mass;
  for (const Object& object : objects) out += object.movable ? object.inertia.mass : 0;
  return out;
}

bool World::has_springs() const {
  return contact.model == kCompliant ||
         std::find(contact_models.begin(), contact_models.end(), kCompliant) != contact_models.end();
}

const Link& Robot::link(const std::string& name) const { return named(links, name, "link"); }

const Joint& Robot::joint(const std::string& name) const { return named(joints, name, "joint"); }

std::pair<double, double> Robot::room(const std::string& name) const {
  double lower = joint(name).lower, upper = joint(name).upper;
  for (const Joint& other : joints) {
    if (other.mimic.joint != name) continue;
    const Mimic& mimic = other.mimic;
    const double a = (other.lower - mimic.offset) / mimic.multiplier,
                 b = (other.upper - mimic.offset) / mimic.multiplier;
    const double least = std::max(lower, std::min(a, b)), most = std::min(upper, std::max(a, b));
    if (least <= most) lower = least, upper = most;
  }
  return {lower, upper};
}

double Robot::default_position(const std::string& name) const {
  const auto [lower, upper] = room(name);
  return std::clamp(0.0, lower, upper);
}

}  // namespace graze
