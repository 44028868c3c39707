#pragma once
// What a user describes: robots, objects, contact, initial state, sensors. A World holds the nominal numbers p0 by
// name; fabrication perturbs a copy of it, and compile() turns it into a Model for the dynamics.

#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/model/disturbance.h"
#include "engine/model/geometry.h"
#include "engine/model/spectrum.h"

namespace graze {

/// A convex hull or triangle mesh, shared between particles (scaled per particle by Shape::size).
struct Mesh {
  std::string file;
  std::vector<Vec3> vertices;              // in the mesh's frame, m
  std::vector<Eigen::Vector3i> triangles;  // indices, outward counter-clockwise
};

/// What contact sees of a mesh: corners of its convex hull, all or so many that the error is small.
struct Hull {
  std::vector<Vec3> corners;   // in the mesh's frame, before Shape::size, m; each is one of the mesh's vertices
  Vec3 centre = Vec3::Zero();  // of their bounding box, likewise
  std::size_t of = 0;          // corners of the whole hull
  double error = 0;            // how far the whole hull reaches out of this one, at the nominal Shape::size, m
};

/// Terrain, shared between particles unless it has a spectrum: heights on a regular grid, centred on the shape's
/// origin; row along y, column along x.
struct HeightGrid {
  int nx = 0, ny = 0;
  std::vector<double> height;  // [iy][ix], m, times Shape::size.z()
};

enum class ShapeKind { box, sphere, cylinder, capsule, mesh, plane, heightfield };

/// `size` by kind: box: full edge lengths; sphere: (radius, -, -); cylinder and capsule: (radius, length, -), axis z,
/// capsule length without caps; mesh: scale factors; plane: unused, normal +z, fills z < 0; heightfield: extent in x
/// and y and factor of the heights.
struct Shape {
  ShapeKind kind = ShapeKind::box;
  Vec3 size = Vec3::Zero();
  std::shared_ptr<const Mesh> mesh;
  std::shared_ptr<const HeightGrid> grid;
  std::shared_ptr<const Hull> hull = nullptr;  // meshes, for contact; null: all corners of the mesh's hull (hull_of)
  std::shared_ptr<const Spectrum> spectrum = nullptr;  // heightfields whose grid was drawn from it

  /// m^3; convex hull's for a mesh; 0 for planes and heightfields.
  double volume() const;
};

/// A shape on a link. The name identifies the part in contacts and tasks: the link's name, with ".1", ".2" … behind it
/// for further collision shapes of the same link.
struct Geometry {
  std::string name;
  Shape shape;
  Pose X_LG = Pose::Identity();  // pose in the link (or object) frame
};

/// Mass, and the second moment about the link frame's origin: sum over mass of x and of x x^T. Affine changes of the
/// geometry act on it exactly (x -> A x), and it is physical if and only if the second moment about the centre of mass
/// is positive semidefinite, which is the triangle inequality of the inertia.
struct MassMoments {
  double mass = 0;             // kg
  Vec3 first = Vec3::Zero();   // kg m, mass * com
  Mat3 second = Mat3::Zero();  // kg m^2, sum m x x^T about the link origin

  static MassMoments from_inertia(double mass, const Vec3& com, const Mat3& inertia_about_com);
  static MassMoments of_shape(const Shape& shape, double density);  // homogeneous, in the shape's frame
  Vec3 com() const;
  Mat3 inertia_about_com() const;
  /// x -> A x + t, mass unchanged.
  MassMoments transformed(const Mat3& A, const Vec3& t) const;
  MassMoments operator+(const MassMoments& other) const;
  MassMoments scaled(double factor) const;  // mass factor
};

struct Link {
  std::string name;
  MassMoments inertia;  // in the link frame
  std::vector<Geometry> collisions;
  std::vector<Geometry> visuals;  // primitives and meshes whose file is there; for pictures, and for volume when a link
                                  // has no collision shape
  double friction = 1.0;          // factor on the other surface's coefficient
  double restitution = 0.0;
  std::string source;  // file:line where it is described
};

enum class JointType { fixed, revolute, prismatic, floating };

/// A joint that follows another: position = multiplier times the other's + offset.
struct Mimic {
  std::string joint;      // the one it follows, which follows none; empty: the joint is free
  double multiplier = 1;  // not 0
  double offset = 0;      // rad or m
};

/// Joint frame = child link frame. Continuous is revolute without limits.
struct Joint {
  std::string name, parent, child;
  JointType type = JointType::fixed;
  Pose X_PJ = Pose::Identity();  // joint frame in the parent link's frame at zero
  Vec3 axis = Vec3::UnitX();     // unit, in the joint frame
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();  // rad or m
  double effort = std::numeric_limits<double>::infinity();                                                   // N m or N
  double velocity = std::numeric_limits<double>::infinity();  // rad/s or m/s: no-load speed
  double damping = 0;                                         // N m s/rad
  double friction = 0;                                        // N m, dry
  double zero = 0;                                            // rad: encoder tare; the encoder reads q - zero
  double gear = 1;           // turns of the drive's rotor per turn of the joint; of a prismatic joint rad/m
  double rotor_inertia = 0;  // kg m^2, of the drive's rotor about its own axis
  Mimic mimic;
  std::string source;

  /// It moves, and no other joint says how: such joints have drives, encoders and initial positions of their own.
  bool driven() const { return type != JointType::fixed && type != JointType::floating && mimic.joint.empty(); }
  /// What the rotor adds to the joint's own entry of the mass matrix, kg m^2 or kg.
  double armature() const { return gear * gear * rotor_inertia; }
};

/// A kinematic tree with a fixed or floating base.
struct Robot {
  std::string name;
  std::vector<Link> links;    // root first, parents before children
  std::vector<Joint> joints;  // parents before children
  bool floating_base = true;

  const Link& link(const std::string& name) const;    // throws std::out_of_range
  const Joint& joint(const std::string& name) const;  // throws std::out_of_range
  /// Limits of a joint, its own and those of the joints that follow it, rad or m.
  std::pair<double, double> room(const std::string& joint) const;
  /// Where a driven joint begins if nothing says otherwise, rad or m: at 0, or as near to it as its limits and those of
  /// the joints that follow it allow. Throws std::out_of_range.
  double default_position(const std::string& joint) const;
};

/// The contact model whose contacts have springs and dampers.
inline constexpr const char* kCompliant = "compliant";

/// What carries each point of a compliant contact: the force k x + d v at depth x and closing speed v, never a pull.
struct Spring {
  double stiffness = std::numeric_limits<double>::quiet_NaN();  // k, N/m; NaN: not given
  double damping = std::numeric_limits<double>::quiet_NaN();    // d, N s/m; NaN: not given

  /// These numbers where they are given, else those of `other`.
  Spring or_else(const Spring& other) const;
};

/// `given` with what it lacks: the stiffness on which `mass` kg sink in by half a millimetre on one point, and the
/// damping that is critical for `mass` on that stiffness.
Spring default_spring(double mass, const Spring& given = {});

/// Something in the environment: fixed, or movable with six degrees of freedom.
struct Object {
  std::string name;
  Shape shape;
  std::vector<Shape> more;       // of a concave mesh: its further convex parts, in the object frame as the first
  Pose X_WO = Pose::Identity();  // for movable objects: initial pose
  bool movable = false;
  MassMoments inertia;                                         // movable only, in the object frame
  double friction = std::numeric_limits<double>::quiet_NaN();  // NaN: the default of ContactSettings
  double restitution = std::numeric_limits<double>::quiet_NaN();
  Spring spring = {};  // what it lacks: from ContactSettings

  double volume() const;  // of all its parts, m^3; 0 for planes and heightfields
};

/// Coefficients of a pair that differ from the rule below.
/// How `lanes` finds the impulses of a step (docs/physics.md).
enum class ContactSolver { automatic, sweeps, newton };

struct ContactPair {
  std::string a, b;  // glob patterns of part names
  double friction = std::numeric_limits<double>::quiet_NaN(), restitution = std::numeric_limits<double>::quiet_NaN();
  Spring spring = {};
};

/// Contact of a link and an object: mu = link.friction * object.friction; of two links: contact.friction times both
/// factors; of two objects: the smaller. Restitution: the larger of both sides. Spring: the object's; of two links:
/// the one here; of two objects: the softer one's. `pairs` override; `ignore` removes.
struct ContactSettings {
  double friction = 1.0;     // default of objects
  double restitution = 0.0;  // default of objects and links
  Spring spring = {};        // default of objects, and the spring of links among themselves
  std::string model;         // one of the back end's models; empty: its first
  ContactSolver solver = ContactSolver::automatic;
  std::vector<ContactPair> pairs;
  std::vector<std::pair<std::string, std::string>> ignore;  // globs; pairs of parts that never touch
  std::vector<std::pair<std::string, std::string>> apart;   // names; likewise, in the order of the model's colliders
  bool self_collision = true;  // links of one robot that are not adjacent (parent and child) may touch
};

struct InitialState {
  Vec3 position = Vec3::Zero();          // base origin, m
  Vec3 rpy = Vec3::Zero();               // base orientation, rad: R = Rz(yaw) Ry(pitch) Rx(roll)
  bool on_ground = false;                // raise or lower so that the robot touches z = 0, or terrain below it, …
  double clearance = 0;                  // … plus this, m
  Vec3 linear_velocity = Vec3::Zero();   // of the base origin, world axes, m/s
  Vec3 angular_velocity = Vec3::Zero();  // world axes, rad/s
  std::map<std::string, double> joint_position, joint_velocity;  // by joint name; absent: 0, or the nearest limit
};

struct World {
  Robot robot;
  std::vector<Object> objects;
  ContactSettings contact;
  std::vector<std::string> contact_models = {""};  // of the back end, in the order of a choice's index; "": its first
  bool knows_rotors = true;                        // the back end has Body::armature
  InitialState initial;
  Vec3 gravity = {0, 0, -9.81};
  double control_lag = 0;                     // s, between the policy's command and the tracker that follows it
  std::map<std::string, double> sensor_bias;  // by channel name (engine/sensing), persistent error
  std::vector<Disturbance> disturbances = {};

  /// Mass of the movable objects and of the robot without what is welded to the world, kg: moving_mass() of the model.
  double moving_mass() const;
  /// Whether the back end has the contact model in which springs count, kCompliant.
  bool has_springs() const;
};

/// Names of all sensor and actuator channels of a robot, "sensor.encoder.LF_X_1.position", … in a fixed order
/// (Figure 15). Defined beside the sensors' layout in engine/model/channels.cpp, because parameters address them.
std::vector<std::string> channel_names(const Robot& robot);

}  // namespace graze
