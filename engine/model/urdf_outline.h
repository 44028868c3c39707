#pragma once
// The first pass over a URDF: is it XML, is it a tree of links and joints, is every number a number? urdfdom reads
// leniently and says neither where nor what; this pass does both, so that what it hands on (a clean document of exactly
// the elements that matter) cannot surprise urdfdom.

#include <array>
#include <set>
#include <string>
#include <vector>

namespace graze {

struct UrdfOutline {
  /// <origin rpy>, rad; urdfdom returns only quaternions of it, by the C library's sines.
  using Angles = std::array<double, 3>;

  struct ShapeEntry {
    int line = 0;
    bool capsule = false;  // an extension that urdfdom does not know: handed on as a cylinder
    Angles rpy{};
  };
  struct LinkEntry {
    std::string name;
    int line = 0;
    int inertial_line = 0;  // 0: no <inertial>
    Angles inertial_rpy{};
    std::vector<ShapeEntry> collisions, visuals;
  };
  struct JointEntry {
    std::string name, type, parent, child;
    int line = 0;
    Angles rpy{};
  };

  std::string robot;
  std::vector<LinkEntry> links;    // in depth-first order from the root, children in file order
  std::vector<JointEntry> joints;  // the joint of links[i + 1] is joints[i]
  std::string xml;                 // clean document
  std::vector<std::string> warnings;
};

/// Throws InputError "name:line: …".
UrdfOutline outline_urdf(const std::string& xml, const std::string& name);

}  // namespace graze
