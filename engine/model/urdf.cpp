#include "engine/model/urdf.h"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <tinyxml2.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>
#include <string_view>

#include "engine/model/direction.h"
#include "engine/model/inertia_rules.h"
#include "engine/model/limits.h"
#include "engine/model/mesh_files.h"
#include "engine/model/mesh_parts.h"
#include "engine/model/mesh_size.h"
#include "engine/model/model.h"
#include "engine/model/rotation.h"
#include "engine/model/urdf_bodies.h"
#include "engine/model/urdf_outline.h"
#include "engine/model/xacro.h"
#include "engine/model/xml_text.h"
#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

/// Keeps what urdfdom would print.
class Messages : public console_bridge::OutputHandler {
 public:
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first_.empty()) first_ = text;
  }
  const std::string& first() const { return first_; }

 private:
  std::string first_;
};

/// urdfdom's reading of the clean document. Its messages go through a handler that is global to the process, hence the
/// lock.
urdf::ModelInterfaceSharedPtr parse_with_urdfdom(const UrdfOutline& outline, const UrdfProblems& problems) {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  Messages messages;
  console_bridge::useOutputHandler(&messages);
  urdf::ModelInterfaceSharedPtr model;
  std::string thrown;
  try {
    model = urdf::parseURDF(outline.xml);
  } catch (const std::exception& error) {
    thrown = error.what();
  }
  console_bridge::restorePreviousOutputHandler();
  if (!model) {
    problems.raise();  // a stand-in may be what it cannot read
    throw InputError(
        fmt::format("{}: not a valid URDF: {}", problems.name(), thrown.empty() ? messages.first() : thrown));
  }
  return model;
}

Vec3 vector(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Pose pose(const urdf::Pose& p, const UrdfOutline::Angles& rpy) {
  Pose X = Pose::Identity();
  X.linear() = rotation_from_rpy({rpy[0], rpy[1], rpy[2]});
  X.translation() = vector(p.position);
  return X;
}

/// One reading of the document. What it tells `problems` may be more than one reading finds: a repair can bring others
/// to light.
class Builder {
 public:
  Builder(const UrdfOptions& options, MeshFiles& meshes, UrdfProblems& problems)
      : name_(problems.name()), options_(options), meshes_(meshes), problems_(problems) {}

  Robot build(tinyxml2::XMLDocument& document) {
    const UrdfOutline outline = outline_urdf(document, problems_);
    const urdf::ModelInterfaceSharedPtr model = parse_with_urdfdom(outline, problems_);
    robot_.name = outline.robot;
    for (const UrdfOutline::LinkEntry& entry : outline.links) {
      robot_.links.push_back(build_link(*model->links_.at(entry.name), entry));
    }
    for (const UrdfOutline::JointEntry& entry : outline.joints) {
      robot_.joints.push_back(build_joint(*model->joints_.at(entry.name), entry));
    }
    tell_whole();
    leave_mass_to_fixed_links(robot_, outline, problems_);
    choose_base(outline);
    check_bodies(robot_, outline, options_, problems_);
    problems_.raise();
    if (!problems_.changed()) check_compiles();
    return std::move(robot_);
  }

 private:
  // ---- links

  Link build_link(const urdf::Link& from, const UrdfOutline::LinkEntry& entry) {
    Link link;
    link.name = entry.name;
    link.source = fmt::format("{}:{}", name_, entry.inertial_line ? entry.inertial_line : entry.line);
    for (std::size_t i = 0; i < from.collision_array.size(); ++i) {
      const urdf::Collision& collision = *from.collision_array[i];
      add_geometry(*collision.geometry, pose(collision.origin, entry.collisions[i].rpy), entry.collisions[i], link,
                   link.collisions, true);
    }
    for (std::size_t i = 0; i < from.visual_array.size(); ++i) {
      const urdf::Visual& visual = *from.visual_array[i];
      add_geometry(*visual.geometry, pose(visual.origin, entry.visuals[i].rpy), entry.visuals[i], link, link.visuals,
                   false);
    }
    link.inertia = from.inertial ? given_inertia(*from.inertial, entry) : inertia_of_shapes(link);
    return link;
  }

  void add_geometry(const urdf::Geometry& from, const Pose& X_LG, const UrdfOutline::ShapeEntry& entry,
                    const Link& link, std::vector<Geometry>& out, bool collision) {
    const std::vector<Shape> shapes = from.type == urdf::Geometry::MESH
                                          ? mesh_shapes(static_cast<const urdf::Mesh&>(from), entry, link, collision)
                                          : std::vector<Shape>{primitive(from, entry.capsule)};
    if (collision) doubt_extent(shapes, entry, link);
    for (const Shape& shape : shapes) {
      out.push_back({out.empty() ? link.name : fmt::format("{}.{}", link.name, out.size()), shape, X_LG});
      if (collision && ++collisions_ > kMaxShapes) {
        problems_.stop(entry.line,
                       fmt::format("more than {0} collision shapes, with the parts of meshes; a robot has at "
                                   "most {0}",
                                   kMaxShapes));
      }
    }
  }

  void doubt_extent(const std::vector<Shape>& shapes, const UrdfOutline::ShapeEntry& entry, const Link& link) {
    constexpr double kLarge = 100;  // m, along an edge, or of a mesh's vertices from its origin
    double most = 0;
    for (const Shape& shape : shapes) {
      most = std::max(most, shape.kind == ShapeKind::mesh ? largest_coordinate(shape) : shape.size.maxCoeff());
    }
    if (most < kLarge) return;
    problems_.doubt(
        entry.line,
        fmt::format("link '{}': <collision> is as large as {:.4g} m; URDF has metres: is it "
                    "meant in mm{}?",
                    link.name, most, shapes.front().kind == ShapeKind::mesh ? " (scale=\"0.001 0.001 0.001\")" : ""));
  }

  static Shape primitive(const urdf::Geometry& from, bool capsule) {
    if (from.type == urdf::Geometry::BOX) {
      return {ShapeKind::box, vector(static_cast<const urdf::Box&>(from).dim), nullptr, nullptr};
    }
    if (from.type == urdf::Geometry::SPHERE) {
      return {ShapeKind::sphere, Vec3(static_cast<const urdf::Sphere&>(from).radius, 0, 0), nullptr, nullptr};
    }
    const auto& cylinder = static_cast<const urdf::Cylinder&>(from);
    return {capsule ? ShapeKind::capsule : ShapeKind::cylinder, Vec3(cylinder.radius, cylinder.length, 0), nullptr,
            nullptr};
  }

  /// None when the mesh is to be left out: pictures without their file silently, collision shapes on request. More
  /// than one where it is split.
  std::vector<Shape> mesh_shapes(const urdf::Mesh& from, const UrdfOutline::ShapeEntry& entry, const Link& link,
                                 bool collision) {
    const std::filesystem::path file = meshes_.find(from.filename);
    if (file.empty()) {
      if (collision && !from.filename.empty()) missing_mesh(from.filename, entry, link);
      return {};
    }
    const Vec3 scale = vector(from.scale);
    if (!collision) {
      try {
        return {Shape{ShapeKind::mesh, scale, meshes_.triangles(file), nullptr}};
      } catch (const InputError&) {
        return {};  // a picture in a format that cannot be read is as good as none
      }
    }
    std::vector<Shape> out;
    try {
      for (const std::shared_ptr<const Mesh>& hull : hulls_of(file, link)) {
        out.push_back({ShapeKind::mesh, scale, hull, nullptr, simplified_hull(*hull, scale, options_.hull)});
      }
    } catch (const InputError& error) {
      problems_.refuse(entry.line, fmt::format("link '{}': collision mesh: {}", link.name, error.what()));
      return {};
    }
    for (const Shape& shape : out) check_extent(shape, entry, link);
    return out;
  }

  std::vector<std::shared_ptr<const Mesh>> hulls_of(const std::filesystem::path& file, const Link& link) {
    const bool split = std::any_of(options_.split.begin(), options_.split.end(),
                                   [&](const std::string& pattern) { return matches(pattern, link.name); });
    if (!split && !options_.split_all) return {meshes_.hull(file)};
    try {
      return meshes_.parts(file);
    } catch (const ConcavePiece& piece) {
      if (!options_.split_all) {
        throw InputError(fmt::format("{}, or leave this link out of the list of 'hulls'", piece.what()));
      }
      whole_.insert(fmt::format("{} ({})", file.string(), piece.lacks()));
      return {meshes_.hull(file)};
    }
  }

  void tell_whole() {
    constexpr std::size_t kTold = 3;
    const std::vector<std::string>& doubts = meshes_.doubts();
    for (std::size_t i = 0; i < std::min(kTold, doubts.size()); ++i) problems_.warn(doubts[i]);
    if (doubts.size() > kTold) problems_.warn(fmt::format("… and {} more such parts", doubts.size() - kTold));
    if (whole_.empty()) return;
    problems_.warn(
        fmt::format("{}: concave meshes of one piece that stay one hull each, since 'hulls' finds no convex "
                    "parts of them: {}",
                    name_, fmt::join(whole_, ", ")));
  }

  void check_extent(const Shape& shape, const UrdfOutline::ShapeEntry& entry, const Link& link) {
    const std::string problem = length_problem(largest_coordinate(shape));
    if (!problem.empty()) {
      problems_.refuse(entry.line, fmt::format("link '{}': collision mesh '{}' reaches as far as {}", link.name,
                                               shape.mesh->file, problem));
    }
  }

  void missing_mesh(const std::string& filename, const UrdfOutline::ShapeEntry& entry, const Link& link) {
    const std::string text =
        fmt::format("link '{}': collision mesh '{}' is not there{}", link.name, filename, meshes_.not_found(filename));
    if (options_.ignore_missing_meshes) {
      return problems_.warn(fmt::format("{}:{}: {}: left out", name_, entry.line, text));
    }
    problems_.repair(entry.line,
                     text +
                         "; put the file there, name the folder of its package, or go on without it by "
                         "--ignore-missing-meshes",
                     "leaves this shape out");
    entry.element->Parent()->DeleteChild(entry.element);
  }

  MassMoments inertia_of_shapes(const Link& link) const {
    MassMoments sum;
    for (const Geometry& geometry : link.collisions.empty() ? link.visuals : link.collisions) {
      if (link.collisions.empty() && geometry.shape.kind == ShapeKind::mesh) continue;  // need not enclose a volume
      sum = sum + MassMoments::of_shape(geometry.shape, options_.density)
                      .transformed(geometry.X_LG.linear(), geometry.X_LG.translation());
    }
    return sum;
  }

  MassMoments given_inertia(const urdf::Inertial& from, const UrdfOutline::LinkEntry& entry) {
    if (from.mass == 0 || !entry.sound) return {};
    Mat3 inertia;
    inertia << from.ixx, from.ixy, from.ixz, from.ixy, from.iyy, from.iyz, from.ixz, from.iyz, from.izz;
    const Pose X_LI = pose(from.origin, entry.inertial_rpy);
    if (is_of_point(inertia, from.mass)) inertia.setZero();
    const MassMoments about_com = MassMoments::from_inertia(from.mass, Vec3::Zero(), physical(inertia, entry));
    return about_com.transformed(X_LI.linear(), X_LI.translation());
  }

  /// The inertia, if it belongs to a real body. Numbers in a file are rounded, so a flat body may break the triangle
  /// inequality a little: up to 1e-3 of the largest principal moment (three digits) is taken as rounding, and the
  /// nearest inertia that is physical is used.
  Mat3 physical(const Mat3& inertia, const UrdfOutline::LinkEntry& entry) {
    const std::string where = fmt::format("link '{}': <inertia>", entry.name);
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia);
    const Vec3& I = solver.eigenvalues();  // ascending
    if (!I.allFinite()) {
      problems_.refuse(entry.inertial_line, where + ": too large to compute with");
      return Mat3::Zero();
    }
    if (I[0] < 0) {
      return nearest(
          inertia, entry,
          fmt::format("{}: principal moments {:g}, {:g}, {:g} kg m^2: none may be negative", where, I[0], I[1], I[2]));
    }
    if (I[0] + I[1] < I[2] * (1 - 1e-3)) {
      return nearest(
          inertia, entry,
          fmt::format("{0}: principal moments {1:g}, {2:g}, {3:g} kg m^2 break the triangle inequality: no rigid body "
                      "has {1:g} + {2:g} < {3:g}",
                      where, I[0], I[1], I[2]));
    }
    if (I[0] + I[1] >= I[2]) return inertia;
    const Vec3 nearest_I(I[0], I[1], I[0] + I[1]);
    return solver.eigenvectors() * nearest_I.asDiagonal() * solver.eigenvectors().transpose();
  }

  Mat3 nearest(const Mat3& inertia, const UrdfOutline::LinkEntry& entry, const std::string& problem) {
    const Mat3 out = nearest_physical_inertia(inertia);
    const Vec3 I = Eigen::SelfAdjointEigenSolver<Mat3>(out, Eigen::EigenvaluesOnly).eigenvalues();
    problems_.repair(entry.inertial_line, problem,
                     fmt::format("takes the nearest inertia of a rigid body (in the Frobenius norm), {:g}, {:g}, {:g} "
                                 "kg m^2",
                                 I[0], I[1], I[2]));
    write_inertia(*entry.element->FirstChildElement("inertial")->FirstChildElement("inertia"), out);
    return out;
  }

  // ---- joints

  Joint build_joint(const urdf::Joint& from, const UrdfOutline::JointEntry& entry) const {
    Joint joint;
    joint.name = entry.name;
    joint.parent = entry.parent;
    joint.child = entry.child;
    joint.source = fmt::format("{}:{}", name_, entry.line);
    joint.mimic = entry.mimic;
    joint.X_PJ = pose(from.parent_to_joint_origin_transform, entry.rpy);
    joint.type = type_of(from);
    if (joint.type == JointType::revolute || joint.type == JointType::prismatic) {
      joint.axis = direction(vector(from.axis));
    }
    if (from.limits) set_limits(from, joint);
    if (from.dynamics) {
      joint.damping = from.dynamics->damping;
      joint.friction = from.dynamics->friction;
    }
    return joint;
  }

  static JointType type_of(const urdf::Joint& from) {
    switch (from.type) {
      case urdf::Joint::REVOLUTE:
      case urdf::Joint::CONTINUOUS:
        return JointType::revolute;
      case urdf::Joint::PRISMATIC:
        return JointType::prismatic;
      case urdf::Joint::FLOATING:
        return JointType::floating;
      default:
        return JointType::fixed;
    }
  }

  static void set_limits(const urdf::Joint& from, Joint& joint) {
    joint.effort = from.limits->effort;
    joint.velocity = from.limits->velocity;
    if (from.type == urdf::Joint::CONTINUOUS) return;
    joint.lower = from.limits->lower;
    joint.upper = from.limits->upper;
  }

  // ---- base

  /// A root called "world" is the world: what is fixed or jointed to it has a fixed base, and a single floating joint
  /// to it means the floating base that is there anyway.
  void choose_base(const UrdfOutline& outline) {
    const bool world = robot_.links.front().name == "world";
    if (world && robot_.links.size() > 1 && robot_.joints.front().type == JointType::floating &&
        std::count_if(robot_.joints.begin(), robot_.joints.end(), [](const Joint& j) { return j.parent == "world"; }) ==
            1) {
      robot_.links.erase(robot_.links.begin());
      robot_.joints.erase(robot_.joints.begin());
      robot_.floating_base = !options_.fixed_base;
    } else {
      robot_.floating_base = !options_.fixed_base && !world && !massless_base(outline);
    }
  }

  /// A base whose <inertial> says mass 0, on a robot that moves, is bolted down: the habit of Bullet's URDF files.
  bool massless_base(const UrdfOutline& outline) {
    if (!outline.links.front().inertial_line || robot_.links.front().inertia.mass > 0) return false;
    std::set<std::string> heavy, merged{robot_.links.front().name};
    for (const Link& link : robot_.links) {
      if (link.inertia.mass > 0) heavy.insert(link.name);
    }
    bool moves = false;
    for (const Joint& joint : robot_.joints) {
      if (merged.count(joint.parent) == 0) continue;
      if (joint.type != JointType::fixed) {
        moves = true;
      } else if (heavy.count(joint.child) > 0) {
        return false;
      } else {
        merged.insert(joint.child);
      }
    }
    if (moves) {
      problems_.warn(fmt::format("{}:{}: link '{}' has mass 0: taken as a base that is fixed to the world", name_,
                                 outline.links.front().inertial_line, outline.links.front().name));
    }
    return moves;
  }

  /// What compile() would refuse later is refused here, where it was read.
  void check_compiles() const {
    World world;
    world.robot = robot_;
    world.contact.self_collision = false;  // which pairs may touch is the scenario's matter
    compile(world);
  }

  const std::string& name_;
  const UrdfOptions& options_;
  MeshFiles& meshes_;
  UrdfProblems& problems_;
  std::size_t collisions_ = 0;   // shapes
  std::set<std::string> whole_;  // meshes that were to be split and cannot, with the reason
  Robot robot_;
};

/// The document is to be kept elsewhere: mesh files that would not be found from there get their absolute names.
void name_meshes(tinyxml2::XMLElement& e, const MeshFiles& meshes, const MeshFiles& from_there) {
  const char* name = e.Attribute("filename");
  if (name && std::string_view(e.Name()) == "mesh") {
    const std::filesystem::path file = meshes.find(name);
    if (!file.empty() && input_path(from_there.find(name).string()) != input_path(file.string())) {
      e.SetAttribute("filename", input_path(file.string()).c_str());
    }
  }
  for (tinyxml2::XMLElement* child = e.FirstChildElement(); child; child = child->NextSiblingElement()) {
    name_meshes(*child, meshes, from_there);
  }
}

void parse_xml(const std::string& xml, const std::string& name, tinyxml2::XMLDocument& document) {
  if (xml.size() > kMaxUrdfBytes) {
    throw InputError(
        fmt::format("{}: {} bytes; a URDF file has at most {}", name, xml.size(), bytes_in_words(kMaxUrdfBytes)));
  }
  const auto fault = read_xml(xml, document);
  if (!fault) return;
  UrdfProblems(name, false)
      .stop(fault->line, fmt::format("{}; a URDF file is an XML document <robot name=\"…\">…</robot>", fault->what));
}

bool needs_xacro(const std::string& xml) {
  tinyxml2::XMLDocument document;
  return !read_xml(xml, document) && xacro_use(document);
}

/// The document without what stands beside its root: parsers differ in what they let stand there.
std::string text_of(const tinyxml2::XMLDocument& document) {
  tinyxml2::XMLPrinter printer;
  for (const tinyxml2::XMLNode* node = document.FirstChild(); node; node = node->NextSibling()) {
    if (node == document.RootElement() || node->ToComment() || node->ToDeclaration()) node->Accept(&printer);
  }
  return printer.CStr();
}

/// Reads the document again after every round of repairs, until there is none: what is returned is what a reader that
/// repairs nothing makes of the repaired document.
Robot read_document(tinyxml2::XMLDocument& document, const std::string& name, const UrdfOptions& options) {
  constexpr int kMostRounds = 8;  // of what was tried none took more than three
  MeshFiles meshes(std::filesystem::path(name).parent_path(), options.package_path);
  std::vector<std::string> told;
  for (int round = 0; round < kMostRounds; ++round) {
    UrdfProblems problems(name, options.repair);
    Robot robot = Builder(options, meshes, problems).build(document);
    const std::vector<std::string> repairs = problems.repairs();
    told.insert(told.end(), repairs.begin(), repairs.end());
    if (problems.changed()) continue;
    told.insert(told.end(), problems.warnings().begin(), problems.warnings().end());
    for (const std::string& text : told) {
      if (options.warn) options.warn(text);
    }
    if (!options.read) return robot;
    name_meshes(*document.RootElement(), meshes, MeshFiles(options.read_folder, {}, false));
    options.read(text_of(document));
    return robot;
  }
  throw InputError(fmt::format("{}: every repair brings up another problem; the last: {}", name, told.back()));
}

}  // namespace

Robot parse_urdf(const std::string& xml, const std::string& name, const UrdfOptions& options) {
  try {
    tinyxml2::XMLDocument document;
    parse_xml(xml, name, document);
    return read_document(document, name, options);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {  // of a library that the file drove beyond its bounds
    throw InputError(fmt::format("{}: cannot be read as a URDF: {}", name, error.what()));
  }
}

Robot load_urdf(const std::string& file, const UrdfOptions& options) {
  const std::string text = read_input(file, "", kMaxUrdfBytes);
  if (text.empty()) throw InputError(fmt::format("{}: is empty", file));
  if (!needs_xacro(text)) return parse_urdf(text, file, options);
  const auto expanded = expanded_by_xacro(file, text);
  return expanded ? parse_urdf(*expanded, expanded_name(file), options) : parse_urdf(text, file, options);
}

}  // namespace graze
