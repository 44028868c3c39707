#include "engine/model/urdf_writer.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>

#include "engine/model/rotation.h"
#include "engine/model/urdf_values.h"
#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

std::string xyz_text(const Vec3& v) { return number_text({v.x(), v.y(), v.z()}); }

class RobotWriter {
 public:
  explicit RobotWriter(const Robot& robot) : robot_(robot) {}

  std::string run() {
    printer_.PushHeader(false, true);
    open("robot", {{"name", robot_.name.empty() ? "robot" : robot_.name}});
    for (const Link& link : robot_.links) write_link(link);
    for (const Joint& joint : robot_.joints) write_joint(joint);
    printer_.CloseElement();
    return printer_.CStr();
  }

 private:
  using Attributes = std::vector<std::pair<const char*, std::string>>;

  void open(const char* name, const Attributes& attributes = {}) {
    printer_.OpenElement(name);
    for (const auto& [key, value] : attributes) printer_.PushAttribute(key, value.c_str());
  }
  void element(const char* name, const Attributes& attributes) {
    open(name, attributes);
    printer_.CloseElement();
  }

  void write_origin(const Pose& X) {
    const Vec3 rpy = rpy_from_rotation(X.linear());
    element("origin", {{"xyz", xyz_text(X.translation())}, {"rpy", xyz_text(rpy)}});
  }

  // ---- links

  void write_link(const Link& link) {
    open("link", {{"name", link.name}});
    if (link.inertia.mass > 0 || !link.collisions.empty() || !link.visuals.empty()) write_inertia(link.inertia);
    for (const Geometry& one : link.visuals.empty() ? link.collisions : link.visuals) write_shape("visual", link, one);
    for (const Geometry& one : link.collisions) write_shape("collision", link, one);
    printer_.CloseElement();
  }

  void write_inertia(const MassMoments& inertia) {
    open("inertial");
    const bool some = inertia.mass > 0;
    const Mat3 I = some ? inertia.inertia_about_com() : Mat3::Zero();
    element("origin", {{"xyz", xyz_text(some ? inertia.com() : Vec3::Zero())}, {"rpy", "0 0 0"}});
    element("mass", {{"value", number_text({inertia.mass})}});
    element("inertia", {{"ixx", number_text({I(0, 0)})},
                        {"ixy", number_text({I(0, 1)})},
                        {"ixz", number_text({I(0, 2)})},
                        {"iyy", number_text({I(1, 1)})},
                        {"iyz", number_text({I(1, 2)})},
                        {"izz", number_text({I(2, 2)})}});
    printer_.CloseElement();
  }

  void write_shape(const char* role, const Link& link, const Geometry& geometry) {
    const std::string length = number_text({geometry.shape.size.y()}), radius = number_text({geometry.shape.size.x()});
    open(role);
    write_origin(geometry.X_LG);
    open("geometry");
    switch (geometry.shape.kind) {
      case ShapeKind::box:
        element("box", {{"size", xyz_text(geometry.shape.size)}});
        break;
      case ShapeKind::sphere:
        element("sphere", {{"radius", radius}});
        break;
      case ShapeKind::cylinder:
        element("cylinder", {{"radius", radius}, {"length", length}});
        break;
      case ShapeKind::capsule:
        element("capsule", {{"radius", radius}, {"length", length}});
        break;
      case ShapeKind::mesh:
        write_mesh(role, link, geometry);
        break;
      default:
        throw InputError(fmt::format("link '{}': terrain on a link cannot be written as URDF", link.name));
    }
    printer_.CloseElement();
    printer_.CloseElement();
  }

  void write_mesh(const char* role, const Link& link, const Geometry& geometry) {
    const Mesh& mesh = *geometry.shape.mesh;
    const bool collides = role == std::string("collision");
    const auto same = [&](const Geometry& one) {
      return one.shape.mesh && one.shape.mesh->file == mesh.file && one.X_LG.isApprox(geometry.X_LG);
    };
    if (collides && std::count_if(link.collisions.begin(), link.collisions.end(), same) > 1) {
      throw InputError(
          fmt::format("link '{}': its collision mesh {} was split into convex parts, which one URDF element "
                      "cannot say; write the parts to files of their own",
                      link.name, mesh.file));
    }
    element("mesh", {{"filename", input_path(mesh.file)}, {"scale", xyz_text(geometry.shape.size)}});
  }

  // ---- joints

  static const char* type_of(const Joint& joint) {
    switch (joint.type) {
      case JointType::revolute:
        return std::isfinite(joint.lower) && std::isfinite(joint.upper) ? "revolute" : "continuous";
      case JointType::prismatic:
        return "prismatic";
      case JointType::floating:
        return "floating";
      default:
        return "fixed";
    }
  }

  void write_joint(const Joint& joint) {
    const std::string type = type_of(joint);
    open("joint", {{"name", joint.name}, {"type", type}});
    write_origin(joint.X_PJ);
    element("parent", {{"link", joint.parent}});
    element("child", {{"link", joint.child}});
    if (joint.type == JointType::revolute || joint.type == JointType::prismatic) write_motion(joint, type);
    printer_.CloseElement();
  }

  void write_motion(const Joint& joint, const std::string& type) {
    element("axis", {{"xyz", xyz_text(joint.axis)}});
    write_limit(joint, type == "continuous");
    element("dynamics", {{"damping", number_text({joint.damping})}, {"friction", number_text({joint.friction})}});
    if (joint.mimic.joint.empty()) return;
    element("mimic", {{"joint", joint.mimic.joint},
                      {"multiplier", number_text({joint.mimic.multiplier})},
                      {"offset", number_text({joint.mimic.offset})}});
  }

  void write_limit(const Joint& joint, bool continuous) {
    if (continuous && !std::isfinite(joint.effort) && !std::isfinite(joint.velocity)) return;
    const auto bound = [](double x) { return number_text({std::isfinite(x) ? x : kNoBound}); };
    Attributes limit = {{"effort", bound(joint.effort)}, {"velocity", bound(joint.velocity)}};
    if (!continuous) {
      limit.emplace_back("lower", number_text({joint.lower}));
      limit.emplace_back("upper", number_text({joint.upper}));
    }
    element("limit", limit);
  }

  const Robot& robot_;
  tinyxml2::XMLPrinter printer_;
};

}  // namespace

std::string write_urdf(const Robot& robot) { return RobotWriter(robot).run(); }

}  // namespace graze
