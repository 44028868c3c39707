#include "engine/model/urdf_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/model/inertia_rules.h"
#include "engine/model/limits.h"
#include "engine/model/urdf_values.h"

namespace graze {

namespace {

/// Links that move as one.
struct MovingBody {
  std::vector<const Link*> links;  // the one that the joint leads to first
  std::vector<Pose> X_BL;
  MassMoments moments;  // in the frame of the first
};

/// Mass and form that a link gets from its shapes.
struct MadeUp {
  MassMoments moments;
  std::string from;  // "its collision shapes"
};

/// Of a positive number, by Newton's method from the power of two that is next to it: the C library's has bits of its
/// own.
double cube_root(double x) {
  int exponent = 0;
  std::frexp(x, &exponent);
  double root = std::ldexp(1.0, exponent / 3);
  constexpr int kSteps = 8;  // from a factor of 2 at most: 5 reach the last bit
  for (int i = 0; i < kSteps; ++i) root = (2 * root + x / (root * root)) / 3;
  return root;
}

/// A homogeneous ball about the link's origin.
MassMoments ball(double mass, double density) {
  const double radius = cube_root(3 * mass / (4 * M_PI * density));
  return MassMoments::from_inertia(mass, Vec3::Zero(), 0.4 * mass * radius * radius * Mat3::Identity());
}

/// The box about a mesh, which need not enclose a volume itself.
MassMoments of_box_about(const Geometry& picture, double density) {
  if (picture.shape.kind != ShapeKind::mesh) {
    return MassMoments::of_shape(picture.shape, density).transformed(picture.X_LG.linear(), picture.X_LG.translation());
  }
  Eigen::AlignedBox3d box;
  for (const Vec3& vertex : picture.shape.mesh->vertices) box.extend(vertex.cwiseProduct(picture.shape.size));
  const Shape shape{ShapeKind::box, box.sizes(), nullptr, nullptr};
  return MassMoments::of_shape(shape, density)
      .transformed(picture.X_LG.linear(), picture.X_LG.linear() * box.center() + picture.X_LG.translation());
}

MadeUp from_shapes(const Link& link, double density) {
  MadeUp out;
  for (const Geometry& shape : link.collisions) {
    out.moments =
        out.moments +
        MassMoments::of_shape(shape.shape, density).transformed(shape.X_LG.linear(), shape.X_LG.translation());
  }
  out.from = "its collision shapes";
  if (out.moments.mass > 0) return out;
  for (const Geometry& shape : link.visuals) out.moments = out.moments + of_box_about(shape, density);
  out.from = "the boxes about its visual shapes";
  return out;
}

constexpr double kPoint = 1e-2;  // of the mass: shapes of less are mere contact points

constexpr const char* kMayStand =
    "; if it is bolted to the world: robot.base: fixed in the scenario, or <mass value=\"0\"/> here";

class Bodies {
 public:
  Bodies(const Robot& robot, const UrdfOutline& outline, const UrdfOptions& options, UrdfProblems& problems)
      : robot_(robot), options_(options), problems_(problems) {
    for (const UrdfOutline::LinkEntry& entry : outline.links) entries_[entry.name] = &entry;
    for (const Link& link : robot.links) mass_ += link.inertia.mass;
    collect();
  }

  void check() {
    for (const MovingBody& body : bodies_) {
      const bool sound =
          std::all_of(body.links.begin(), body.links.end(), [&](const Link* l) { return entry(*l).sound; });
      if (!sound) continue;  // what there is to say of it has been said
      const std::string no_mass = mass_problem(body.moments.mass);
      if (!no_mass.empty()) {
        const bool may_stand = robot_.floating_base && &body == &bodies_.front() && bodies_.size() > 1;
        give_mass(body, no_mass + (may_stand ? kMayStand : ""));
        continue;
      }
      const std::string no_inertia = inertia_problem(body.moments.inertia_about_com());
      if (!no_inertia.empty()) give_inertia(body, no_inertia);
      for (const Link* link : body.links) doubt_size(*link);
    }
    tell_made_up();
  }

 private:
  const UrdfOutline::LinkEntry& entry(const Link& link) const { return *entries_.at(link.name); }

  static int line(const UrdfOutline::LinkEntry& entry) {
    return entry.inertial_line ? entry.inertial_line : entry.line;
  }

  void collect() {
    struct Place {
      int body;  // -1: the world
      Pose X_BL;
    };
    std::map<std::string, Place> places;
    const auto put = [&](const Link& link, int body, const Pose& X_BL) {
      places[link.name] = {body, X_BL};
      if (body < 0) return;
      MovingBody& of = bodies_[static_cast<std::size_t>(body)];
      of.links.push_back(&link);
      of.X_BL.push_back(X_BL);
      of.moments = of.moments + link.inertia.transformed(X_BL.linear(), X_BL.translation());
    };
    const auto begin = [&](const Link& link) {
      bodies_.emplace_back();
      put(link, static_cast<int>(bodies_.size()) - 1, Pose::Identity());
    };
    if (robot_.floating_base) {
      begin(robot_.links.front());
    } else {
      put(robot_.links.front(), -1, Pose::Identity());
    }
    for (std::size_t i = 0; i < robot_.joints.size(); ++i) {
      const Joint& joint = robot_.joints[i];
      const Link& child = robot_.links[i + 1];
      const Place parent = places.at(joint.parent);
      if (joint.type == JointType::fixed) {
        put(child, parent.body, parent.X_BL * joint.X_PJ);
      } else {
        begin(child);
      }
    }
  }

  void refuse(const MovingBody& body, const std::string& problem) {
    const Link& link = *body.links.front();
    problems_.refuse(line(entry(link)), fmt::format("link '{}': {}", link.name, problem));
  }

  void repair(const MovingBody& body, const std::string& problem, const std::string& how) {
    const Link& link = *body.links.front();
    problems_.repair(line(entry(link)), fmt::format("link '{}': {}", link.name, problem), how);
  }

  /// False when the numbers are of no use.
  bool write(const Link& link, const MassMoments& moments) {
    const Mat3 inertia = moments.inertia_about_com();
    if (!std::isfinite(moments.mass) || !moments.com().allFinite() || !inertia.allFinite()) return false;
    write_inertial(*entry(link).element, moments.mass, moments.com(), inertia);
    return true;
  }

  void give_mass(const MovingBody& body, const std::string& problem) {
    constexpr double kShare = 1e-3, kLeast = 1e-3;  // of the robot's mass; kg
    const double least = std::max(kLeast, kShare * mass_);
    double sum = 0;
    std::vector<MadeUp> made;
    std::string how;
    for (const Link* link : body.links) {
      made.push_back(from_shapes(*link, options_.density));
      const MassMoments& moments = made.back().moments;
      sum += moments.mass;
      if (moments.mass <= 0) continue;
      how += fmt::format("{}{:.3g} kg for link '{}' from {} at {:g} kg/m^3", how.empty() ? "makes up " : ", ",
                         moments.mass, link->name, made.back().from, options_.density);
    }
    bool written = std::isfinite(body.moments.mass) && std::isfinite(sum) && std::isfinite(mass_);
    if (sum < least) {
      how = fmt::format("makes up a ball of {:.3g} kg for link '{}', which has no shape {}", least,
                        body.links.front()->name, sum > 0 ? "of such a mass" : "to make it from");
      written = written && write(*body.links.front(), ball(least, options_.density));
    } else {
      for (std::size_t i = 0; i < made.size(); ++i) {
        if (made[i].moments.mass > 0) written = written && write(*body.links[i], made[i].moments);
      }
    }
    if (!written) return refuse(body, problem);
    repair(body, problem, how);
  }

  /// To the heaviest of the links.
  void give_inertia(const MovingBody& body, const std::string& problem) {
    const auto heaviest = std::max_element(body.links.begin(), body.links.end(), [](const Link* a, const Link* b) {
      return a->inertia.mass < b->inertia.mass;
    });
    const auto index = static_cast<std::size_t>(heaviest - body.links.begin());
    const Link& link = **heaviest;
    const double mass = link.inertia.mass, trace = body.moments.inertia_about_com().trace();
    Mat3 inertia = link.inertia.inertia_about_com();
    std::string how;
    if (is_of_point(inertia, mass) || !(inertia.trace() > 0)) {
      const MadeUp made = from_shapes(link, options_.density);
      const bool shaped = made.moments.mass > kPoint * mass;
      const MassMoments form = shaped ? made.moments.scaled(mass / made.moments.mass) : ball(mass, options_.density);
      inertia = form.inertia_about_com();
      how = fmt::format("takes for link '{}' the inertia of {} with its mass, {:g} kg", link.name,
                        shaped ? made.from : fmt::format("a ball at {:g} kg/m^3", options_.density), mass);
    }
    const auto whole = [&] {
      const MassMoments more = MassMoments::from_inertia(0, Vec3::Zero(), inertia - link.inertia.inertia_about_com());
      return body.moments + more.transformed(body.X_BL[index].linear(), Vec3::Zero());
    };
    constexpr double kFloor = 1e-6;  // of the trace
    if (!inertia_problem(whole().inertia_about_com()).empty()) {
      inertia += kFloor * std::max(trace, inertia.trace()) * Mat3::Identity();
      how += fmt::format("{}adds {:g} of their sum to each", how.empty() ? "" : " and ", kFloor);
    }
    if (!inertia_problem(whole().inertia_about_com()).empty() ||
        !write(link, MassMoments::from_inertia(mass, link.inertia.com(), inertia))) {
      return refuse(body, problem);
    }
    repair(body, problem, how);
  }

  /// Inertias in kg mm^2 and centres in mm, which CAD programs write, make bodies of tens of metres.
  void doubt_size(const Link& link) {
    constexpr double kMost = 10;  // m; no link of a robot that walks, flies or grasps is as large
    if (!entry(link).inertial_line || !(link.inertia.mass > 0)) return;
    const double radius = std::sqrt(link.inertia.inertia_about_com().trace() / (2 * link.inertia.mass));
    if (radius > kMost) {
      problems_.doubt(
          line(entry(link)),
          fmt::format("link '{}': {:g} kg with moments of inertia of {:.3g} kg m^2 in all lie {:.3g} m from their "
                      "centre; URDF has kg and metres: are they meant in kg mm^2?",
                      link.name, link.inertia.mass, link.inertia.inertia_about_com().trace(), radius));
    } else {
      doubt_compactness(link);
    }
    const double away = link.inertia.com().norm();
    if (away > kMost) {
      problems_.doubt(line(entry(link)), fmt::format("link '{}': its centre of mass lies {:.3g} m from its origin; "
                                                     "URDF has metres: is it meant in mm?",
                                                     link.name, away));
    }
  }

  /// What CAD programs write in kg and decimetres or millimetres, or someone made up, is a link that the least torque
  /// throws about, or none moves.
  void doubt_compactness(const Link& link) const {
    constexpr double kMost = 1e3;  // times what its shapes would have, or as many times less: thirty times their size
    const double own = link.inertia.inertia_about_com().trace();
    const MassMoments shapes = from_shapes(link, options_.density).moments;
    if (!(own > 0) || is_of_point(link.inertia.inertia_about_com(), link.inertia.mass) || !(shapes.mass > 0)) return;
    const double expected = shapes.inertia_about_com().trace() * link.inertia.mass / shapes.mass;
    const bool large = own > kMost * expected && shapes.mass > kPoint * link.inertia.mass;
    if (kMost * own >= expected && !large) return;
    problems_.doubt(
        line(entry(link)),
        fmt::format("link '{}': {:g} kg with moments of inertia of {:.3g} kg m^2 in all, {:.3g} {} what its shapes "
                    "would have with that mass; URDF has kg and metres: {}?",
                    link.name, link.inertia.mass, own, own / expected, large ? "times" : "of",
                    own > 1e5 * expected ? "are they meant in kg mm^2" : "is the unit right"));
  }

  void doubt_mass(const Link& link) {
    constexpr double kMost = 1e5;  // kg; no link of a robot that walks, flies or grasps weighs as much
    if (link.inertia.mass <= kMost) return;
    problems_.doubt(line(entry(link)),
                    fmt::format("link '{}': its shapes make {:.3g} kg at {:g} kg/m^3, more than {:g} kg; URDF has "
                                "metres: are they meant in mm (scale=\"0.001 0.001 0.001\" of a mesh)?",
                                link.name, link.inertia.mass, options_.density, kMost));
  }

  void tell_made_up() {
    std::string text;
    std::size_t told = 0;
    for (const MovingBody& body : bodies_) {
      for (const Link* link : body.links) {
        if (entry(*link).inertial_line || !(link->inertia.mass > 0)) continue;
        doubt_mass(*link);
        if (++told > kMaxProblems) continue;
        const double rest = body.moments.mass - link->inertia.mass;
        text += fmt::format("{}{} {:.3g} kg{}{}", text.empty() ? "" : ", ", link->name, link->inertia.mass,
                            link->collisions.empty() ? " (visual)" : "",
                            rest > 0 ? fmt::format(" (beside {:.3g} kg of links fixed to it)", rest) : "");
      }
    }
    if (told == 0) return;
    if (told > kMaxProblems) text += fmt::format(" and {} more", told - kMaxProblems);
    problems_.warn(
        fmt::format("{}: mass made up from collision shapes at {:g} kg/m^3 (robot.density) for links "
                    "without <inertial>: {}",
                    problems_.name(), options_.density, text));
  }

  const Robot& robot_;
  const UrdfOptions& options_;
  UrdfProblems& problems_;
  double mass_ = 0;  // kg, of all links
  std::map<std::string, const UrdfOutline::LinkEntry*> entries_;
  std::vector<MovingBody> bodies_;
};

}  // namespace

void write_inertial(tinyxml2::XMLElement& link, double mass, const Vec3& com, const Mat3& inertia) {
  while (tinyxml2::XMLElement* old = link.FirstChildElement("inertial")) link.DeleteChild(old);
  tinyxml2::XMLElement* inertial = link.GetDocument()->NewElement("inertial");
  link.InsertFirstChild(inertial);
  inertial->InsertNewChildElement("origin")->SetAttribute("xyz", number_text({com.x(), com.y(), com.z()}).c_str());
  inertial->InsertNewChildElement("mass")->SetAttribute("value", number_text({mass}).c_str());
  write_inertia(*inertial->InsertNewChildElement("inertia"), inertia);
}

void write_inertia(tinyxml2::XMLElement& element, const Mat3& inertia) {
  const char* const names[3][3] = {{"ixx", "ixy", "ixz"}, {"", "iyy", "iyz"}, {"", "", "izz"}};
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) element.SetAttribute(names[i][j], number_text({inertia(i, j)}).c_str());
  }
}

void leave_mass_to_fixed_links(Robot& robot, const UrdfOutline& outline, UrdfProblems& problems) {
  constexpr double kShare = 1e-2;  // of what its shapes would weigh: no body is so hollow, a camera may be so light
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < robot.links.size(); ++i) index[robot.links[i].name] = i;
  std::vector<double> carried(robot.links.size(), 0);   // kg, written for the links that are fixed to each
  for (std::size_t i = robot.links.size(); i-- > 0;) {  // children stand behind their parents
    MassMoments& inertia = robot.links[i].inertia;
    const UrdfOutline::LinkEntry& entry = outline.links[i];
    const bool written = entry.inertial_line != 0;
    if (!written && inertia.mass > 0 && carried[i] >= kShare * inertia.mass) {
      problems.warn(
          fmt::format("{}:{}: link '{}' has no <inertial>, and links that are fixed to it weigh {:.3g} kg: "
                      "no mass is made up for it ({:.3g} kg by its shapes)",
                      problems.name(), entry.line, entry.name, carried[i], inertia.mass));
      inertia = {};
    }
    if (i == 0 || robot.joints[i - 1].type != JointType::fixed) continue;
    carried[index.at(robot.joints[i - 1].parent)] += carried[i] + (written ? inertia.mass : 0);
  }
}

void check_bodies(const Robot& robot, const UrdfOutline& outline, const UrdfOptions& options, UrdfProblems& problems) {
  Bodies(robot, outline, options, problems).check();
}

}  // namespace graze
