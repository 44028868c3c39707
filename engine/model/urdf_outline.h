#pragma once
// The first pass over a URDF: is it XML, is it a tree of links and joints, is every number a number? urdfdom reads
// leniently and says neither where nor what; this pass does both, so that what it hands on (a clean document of exactly
// the elements that matter) cannot surprise urdfdom. What can be repaired is repaired in the document itself.

#include <tinyxml2.h>

#include <array>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "engine/model/urdf_problems.h"
#include "engine/model/world.h"

namespace graze {

struct UrdfOutline {
  /// <origin rpy>, rad; urdfdom returns only quaternions of it, by the C library's sines.
  using Angles = std::array<double, 3>;

  struct ShapeEntry {
    int line = 0;
    bool capsule = false;  // an extension that urdfdom does not know: handed on as a cylinder
    Angles rpy{};
    tinyxml2::XMLElement* element = nullptr;  // <collision> or <visual>
  };
  struct LinkEntry {
    std::string name;
    int line = 0;
    int inertial_line = 0;  // 0: no <inertial>
    bool sound = true;      // nothing of its <inertial> is a stand-in
    Angles inertial_rpy{};
    tinyxml2::XMLElement* element = nullptr;  // <link>
    std::vector<ShapeEntry> collisions, visuals;
  };
  struct JointEntry {
    std::string name, type, parent, child;
    int line = 0;
    Angles rpy{};
    tinyxml2::XMLElement* element = nullptr;  // <joint>
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
    Mimic mimic;         // of the joint that it is written to follow; settle_mimics() leads it to one that follows none
    int mimic_line = 0;  // 0: no <mimic> that counts
  };

  std::string robot;
  std::vector<LinkEntry> links;    // in depth-first order from the root, children in file order
  std::vector<JointEntry> joints;  // the joint of links[i + 1] is joints[i]
  std::string xml;                 // clean document
};

/// Tells `problems` what is wrong, and repairs what can be in `document`, which the outline then points into. What it
/// returns is a tree. Throws InputError with all problems where there is none, and for files beyond the bounds of
/// engine/model/limits.h.
UrdfOutline outline_urdf(tinyxml2::XMLDocument& document, UrdfProblems& problems);

}  // namespace graze
