#pragma once
// Bounds on robots and meshes, so that no file can exhaust memory or time. The largest robots that were tried have 78
// links, 45 collision shapes, 37 driven joints, 64 kB of URDF and meshes of 2.5 MB and 51,000 triangles each.

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <string>

namespace graze {

/// Bytes of a URDF file: its tree of elements takes some thirty times as many.
inline constexpr std::size_t kMaxUrdfBytes = 16u << 20;
/// Links, those that are fixed to others included.
inline constexpr std::size_t kMaxLinks = 20'000;
/// Joints that move: the mass matrix of a serial chain of n has n^2 / 2 entries for each lane.
inline constexpr std::size_t kMaxJoints = 1'000;
/// Joints that follow others: every two of them are looked at in each step.
inline constexpr std::size_t kMaxMimics = 100;
/// Bytes of one attribute (a name, a file name, three numbers), which messages repeat.
inline constexpr std::size_t kMaxAttributeBytes = 1'000;
/// Warnings about one file; the rest is counted.
inline constexpr std::size_t kMaxWarnings = 50;
/// Problems of one file that a message lists, and repairs; the rest is counted. A file of a public robot that needs
/// many has one per link.
inline constexpr std::size_t kMaxProblems = 200;

/// Collision shapes of the robot and the environment: every two of them are looked at.
inline constexpr std::size_t kMaxShapes = 2'000;
/// Visual shapes of a robot.
inline constexpr std::size_t kMaxVisuals = 10'000;
/// Pairs of shapes that may touch: each keeps 2 kB of contacts from step to step.
inline constexpr std::size_t kMaxPairs = 100'000;

/// Pairs of links that an SRDF file may say never touch.
inline constexpr std::size_t kMaxSrdfPairs = 20'000;

/// Bytes of a mesh file; 1.3 million triangles of a binary STL file. Reading takes eight times as many.
inline constexpr std::size_t kMaxMeshBytes = 64u << 20;
/// Bytes of a mesh file of another kind than OBJ, STL or DAE, which is read as a library reads it; and of one of a kind
/// that can be packed, a thousandfold at most.
inline constexpr std::size_t kMaxOtherMeshBytes = 16u << 20;
inline constexpr std::size_t kMaxPackedMeshBytes = 1u << 20;
/// Vertices of an OBJ file, and corners of all its faces: a corner is written in two bytes and takes a hundred.
inline constexpr std::size_t kMaxMeshCorners = 4'000'000;
/// Corners of one face: cutting a polygon into triangles takes the square of them.
inline constexpr std::size_t kMaxPolygon = 1'000;
/// Objects, groups, materials or solids of a mesh file.
inline constexpr std::size_t kMaxMeshParts = 10'000;
/// Convex parts of one collision mesh: each is looked at on its own. V-HACD makes 64 unless it is told otherwise.
inline constexpr std::size_t kMaxMeshHulls = 64;
inline constexpr std::size_t kMaxXmlAttributes = 256;  // of one element
/// Vertices of a mesh whose convex hull is sought: a million on a ball take some ten seconds, most meshes a tenth of
/// one.
inline constexpr std::size_t kMaxHullPoints = 1'000'000;
/// Corners of the hull, before it is simplified.
inline constexpr std::size_t kMaxHullCorners = 50'000;

/// Lengths of shapes, and coordinates of places, m. A double has 53 bits, so that near 1e6 m its neighbours are 1.2e-10
/// m apart: gaps keep a tenth of a nanometre, and the smallest overlap that is told is 1e-9 m.
inline constexpr double kMaxLength = 1e6;
/// Mass of a movable object, kg: beyond, rounding hides what others weigh.
inline constexpr double kLeastMass = 1e-12, kMostMass = 1e9;
/// Angles of joints, rad: as lengths, near it an angle has ten decimals; farther out a joint may turn and its angle
/// not.
inline constexpr double kMaxAngle = 1e6;
/// Smallest length of a movable object, m: parts whose gap is smaller count as touching when a trace begins.
inline constexpr double kMinMovable = 1e-6;

/// Stiffness of a contact point, N/m, and its damping, N s/m. Steel on steel has 1e8 N/m. A point of 1e12 N/m is rigid
/// within rounding, and one of 1e-6 N/m carries nothing: within these bounds the compliance 1 / (h (h k + d)) of any
/// step is a number.
inline constexpr double kMinStiffness = 1e-6;
inline constexpr double kMaxStiffness = 1e12;
inline constexpr double kMaxDamping = 1e12;

/// Gear ratio of a drive, rad/rad or rad/m, and inertia of its rotor, kg m^2. A spindle of 1 mm behind a reduction of
/// 100 has 6e5 rad/m; a rotor of 1e3 kg m^2 is a power station's.
inline constexpr double kMaxGear = 1e6;
inline constexpr double kMaxRotor = 1e3;

/// What is wrong with a length or coordinate in m, for a message: "1e+12 m: at most 1e+06 m, …". Empty: nothing.
inline std::string length_problem(double length) {
  if (std::abs(length) <= kMaxLength) return "";
  return fmt::format("{:g} m: at most {:g} m; beyond it rounding makes gaps wrong", length, kMaxLength);
}

/// The same of a joint's angle, rad.
inline std::string angle_problem(double angle) {
  if (std::abs(angle) <= kMaxAngle) return "";
  return fmt::format("{:g} rad: at most {:g} rad; beyond it rounding keeps joints from turning", angle, kMaxAngle);
}

}  // namespace graze
