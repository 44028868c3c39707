#include "engine/model/urdf_outline.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "engine/model/limits.h"
#include "engine/model/urdf_tree.h"
#include "engine/settings/limits.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using tinyxml2::XMLElement;

const std::vector<std::string> kStandardTypes = {"revolute", "continuous", "prismatic", "fixed", "floating", "planar"};

/// A whole decimal number, finite.
std::optional<double> parse_number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::vector<std::string_view> words(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  std::vector<std::string_view> out;
  for (std::size_t begin = text.find_first_not_of(kSpace); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
    out.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kSpace, end);
  }
  return out;
}

class Reader {
 public:
  explicit Reader(const std::string& name) : name_(name), printer_(nullptr, true) {}

  UrdfOutline run(const std::string& xml) {
    if (xml.size() > kMaxUrdfBytes) {
      throw InputError(
          fmt::format("{}: {} bytes; a URDF file has at most {}", name_, xml.size(), bytes_in_words(kMaxUrdfBytes)));
    }
    tinyxml2::XMLDocument document;
    if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) not_xml(document);
    const XMLElement& robot = root_of(document);
    out_.robot = required(robot, "name", "robot");
    printer_.OpenElement("robot");
    printer_.PushAttribute("name", out_.robot.c_str());
    for (const XMLElement* e = robot.FirstChildElement(); e; e = e->NextSiblingElement()) read_part(*e);
    printer_.CloseElement();
    if (unknown_ > kMaxWarnings) {
      out_.warnings.push_back(fmt::format("{}: {} more unknown elements are ignored", name_, unknown_ - kMaxWarnings));
    }
    out_.xml = printer_.CStr();
    order_as_tree(out_, name_);
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", name_, line, message));
  }

  [[noreturn]] void not_xml(const tinyxml2::XMLDocument& document) const {
    fail(document.ErrorLineNum(),
         fmt::format("not XML ({}); a URDF file is an XML document <robot name=\"…\">…</robot>",
                     tinyxml2::XMLDocument::ErrorIDToName(document.ErrorID())));
  }

  const XMLElement& root_of(const tinyxml2::XMLDocument& document) const {
    const XMLElement* root = document.RootElement();
    if (!root) fail(1, "the document has no element; a URDF file is an XML document <robot name=\"…\">…</robot>");
    if (std::string_view(root->Name()) != "robot") {
      fail(root->GetLineNum(), fmt::format("root element <{}>: must be <robot>{}", clipped(root->Name(), 40),
                                           std::string_view(root->Name()) == "sdf" ? "; this is SDF, not URDF" : ""));
    }
    return *root;
  }

  void read_part(const XMLElement& e) {
    const std::string_view tag = e.Name();
    if (tag.substr(0, 6) == "xacro:") {
      fail(e.GetLineNum(),
           fmt::format("<{}>: this is a xacro file; expand it first: xacro in.xacro > out.urdf", clipped(tag, 40)));
    }
    if (tag == "link") {
      read_link(e);
    } else if (tag == "joint") {
      read_joint(e);
    } else {
      note_unknown(e, {"link", "joint", "material", "transmission", "gazebo", "sensor"}, "robot");
    }
  }

  /// Extensions are left out silently; what looks like a misspelt standard element is told.
  void note_unknown(const XMLElement& e, const std::vector<std::string>& known, const std::string& where) {
    const std::string near = nearest(e.Name(), known);
    if (near.empty() || near == e.Name()) return;
    if (++unknown_ > kMaxWarnings) return;
    out_.warnings.push_back(fmt::format("{}:{}: {}: unknown element <{}> is ignored; did you mean <{}>?", name_,
                                        e.GetLineNum(), where, e.Name(), near));
  }

  std::string required(const XMLElement& e, const char* attribute, const std::string& where) const {
    const char* text = e.Attribute(attribute);
    if (!text || !*text) fail(e.GetLineNum(), fmt::format("{}: <{}> needs a non-empty {}", where, e.Name(), attribute));
    const std::size_t size = std::strlen(text);
    if (size > kMaxAttributeBytes) {
      fail(e.GetLineNum(), fmt::format("{}: <{}> {}: {}: {} bytes; at most {}", where, e.Name(), attribute,
                                       clipped(text, 40), size, kMaxAttributeBytes));
    }
    if (std::strstr(text, "$(") || std::strstr(text, "${")) {
      fail(e.GetLineNum(), fmt::format("{}: <{}> {}: '{}' is an expression of xacro; expand the file first: xacro "
                                       "file.xacro > file.urdf",
                                       where, e.Name(), attribute, clipped(text, 80)));
    }
    return text;
  }

  /// What there may be only so many of: counts one more.
  void count(std::size_t& sum, std::size_t most, int line, const char* what) const {
    if (++sum > most) fail(line, fmt::format("more than {} {}; a robot has at most {}", most, what, most));
  }

  const XMLElement& child(const XMLElement& e, const char* tag, const std::string& where) const {
    const XMLElement* found = e.FirstChildElement(tag);
    if (!found) fail(e.GetLineNum(), fmt::format("{}: <{}> has no <{}>", where, e.Name(), tag));
    return *found;
  }

  // ---- numbers: read, checked, and printed into the clean document

  std::vector<double> numbers(const XMLElement& e, const char* attribute, std::size_t count, const std::string& where) {
    const std::string text = required(e, attribute, where);
    std::vector<double> out;
    for (std::string_view word : words(text)) {
      const std::optional<double> value = parse_number(word);
      if (!value)
        fail(e.GetLineNum(), fmt::format("{}: <{}> {}: '{}' is not a number", where, e.Name(), attribute, word));
      out.push_back(*value);
    }
    if (out.size() != count) {
      fail(e.GetLineNum(), fmt::format("{}: <{}> {}: \"{}\" has {} numbers; it needs {}", where, e.Name(), attribute,
                                       text, out.size(), count));
    }
    printer_.PushAttribute(attribute, fmt::format("{}", fmt::join(out, " ")).c_str());
    return out;
  }

  double number(const XMLElement& e, const char* attribute, const std::string& where) {
    return numbers(e, attribute, 1, where)[0];
  }

  double non_negative(const XMLElement& e, const char* attribute, const std::string& where) {
    const double value = number(e, attribute, where);
    if (value < 0) {
      fail(e.GetLineNum(),
           fmt::format("{}: <{}> {}: {} is negative; it must be >= 0", where, e.Name(), attribute, value));
    }
    return value;
  }

  void positive(const XMLElement& e, const char* attribute, std::size_t count, const std::string& where) {
    for (double value : numbers(e, attribute, count, where)) {
      if (!(value > 0)) {
        fail(e.GetLineNum(),
             fmt::format("{}: <{}> {}: {} is not positive; sizes must be > 0", where, e.Name(), attribute, value));
      }
      check_length(e, attribute, value, where);
    }
  }

  void check_length(const XMLElement& e, const char* attribute, double value, const std::string& where) const {
    const std::string problem = length_problem(value);
    if (!problem.empty()) fail(e.GetLineNum(), fmt::format("{}: <{}> {}: {}", where, e.Name(), attribute, problem));
  }

  /// Returns its rpy.
  UrdfOutline::Angles read_origin(const XMLElement& parent, const std::string& where) {
    UrdfOutline::Angles rpy{};
    const XMLElement* origin = parent.FirstChildElement("origin");
    if (!origin) return rpy;
    printer_.OpenElement("origin");
    if (origin->Attribute("xyz")) {
      for (double value : numbers(*origin, "xyz", 3, where)) check_length(*origin, "xyz", value, where);
    }
    if (origin->Attribute("rpy")) {
      const std::vector<double> angles = numbers(*origin, "rpy", 3, where);
      std::copy(angles.begin(), angles.end(), rpy.begin());
    }
    printer_.CloseElement();
    return rpy;
  }

  // ---- links

  void read_link(const XMLElement& e) {
    count(links_, kMaxLinks, e.GetLineNum(), "links");
    UrdfOutline::LinkEntry link;
    link.name = required(e, "name", "link");
    link.line = e.GetLineNum();
    const std::string where = "link '" + link.name + "'";
    if (!link_names_.insert(link.name).second) fail(link.line, where + ": there are two links of this name");
    printer_.OpenElement("link");
    printer_.PushAttribute("name", link.name.c_str());
    for (const XMLElement* part = e.FirstChildElement(); part; part = part->NextSiblingElement()) {
      read_link_part(*part, where, link);
    }
    printer_.CloseElement();
    out_.links.push_back(std::move(link));
  }

  void read_link_part(const XMLElement& part, const std::string& where, UrdfOutline::LinkEntry& link) {
    const std::string_view tag = part.Name();
    if (tag == "inertial") {
      if (link.inertial_line) fail(part.GetLineNum(), where + ": a second <inertial>; a link has at most one");
      link.inertial_line = part.GetLineNum();
      link.inertial_rpy = read_inertial(part, where);
    } else if (tag == "collision") {
      count(collisions_, kMaxShapes, part.GetLineNum(), "collision shapes");
      link.collisions.push_back(read_shape(part, where));
    } else if (tag == "visual") {
      count(visuals_, kMaxVisuals, part.GetLineNum(), "visual shapes");
      if (!invisible(part)) link.visuals.push_back(read_shape(part, where));
    } else {
      note_unknown(
          part, {"inertial", "collision", "visual", "contact", "sensor", "material", "self_collision_checking"}, where);
    }
  }

  UrdfOutline::Angles read_inertial(const XMLElement& e, const std::string& where) {
    printer_.OpenElement("inertial");
    const UrdfOutline::Angles rpy = read_origin(e, where);
    printer_.OpenElement("mass");
    non_negative(child(e, "mass", where), "value", where);
    printer_.CloseElement();
    printer_.OpenElement("inertia");
    for (const char* entry : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
      number(child(e, "inertia", where), entry, where);
    }
    printer_.CloseElement();
    printer_.CloseElement();
    return rpy;
  }

  /// A picture of no size, which some files use to draw nothing.
  static bool invisible(const XMLElement& visual) {
    const XMLElement* geometry = visual.FirstChildElement("geometry");
    const XMLElement* shape = geometry ? geometry->FirstChildElement() : nullptr;
    if (!shape) return false;
    for (const char* attribute : {"radius", "length", "size"}) {
      const char* text = shape->Attribute(attribute);
      for (std::string_view word : words(text ? text : "")) {
        if (parse_number(word) == 0.0) return true;
      }
    }
    return false;
  }

  UrdfOutline::ShapeEntry read_shape(const XMLElement& e, const std::string& where) {
    UrdfOutline::ShapeEntry entry;
    entry.line = e.GetLineNum();
    const XMLElement* shape = child(e, "geometry", where).FirstChildElement();
    if (!shape) fail(e.GetLineNum(), fmt::format("{}: <{}> has an empty <geometry>", where, e.Name()));
    printer_.OpenElement(e.Name());
    entry.rpy = read_origin(e, where);
    printer_.OpenElement("geometry");
    read_geometry(*shape, where, entry);
    printer_.CloseElement();
    printer_.CloseElement();
    return entry;
  }

  void read_geometry(const XMLElement& shape, const std::string& where, UrdfOutline::ShapeEntry& entry) {
    const std::string tag = shape.Name();
    const std::vector<std::string> known = {"box", "sphere", "cylinder", "capsule", "mesh"};
    if (std::find(known.begin(), known.end(), tag) == known.end()) {
      const std::string near = nearest(tag, known);
      fail(shape.GetLineNum(),
           fmt::format("{}: unknown shape <{}>; shapes are box, sphere, cylinder, capsule, mesh{}", where,
                       clipped(tag, 40), near.empty() ? "" : "; did you mean <" + near + ">?"));
    }
    entry.capsule = tag == "capsule";
    printer_.OpenElement(entry.capsule ? "cylinder" : tag.c_str());
    if (tag == "mesh") {
      read_mesh(shape, where);
    } else if (tag == "box") {
      positive(shape, "size", 3, where);
    } else {
      positive(shape, "radius", 1, where);
      if (tag != "sphere") positive(shape, "length", 1, where);
    }
    printer_.CloseElement();
  }

  void read_mesh(const XMLElement& mesh, const std::string& where) {
    printer_.PushAttribute("filename", required(mesh, "filename", where).c_str());
    if (!mesh.Attribute("scale")) return;
    for (double value : numbers(mesh, "scale", 3, where)) {
      if (value == 0) fail(mesh.GetLineNum(), where + ": <mesh> scale: 0 flattens the mesh; factors must not be 0");
    }
  }

  // ---- joints

  void read_joint(const XMLElement& e) {
    UrdfOutline::JointEntry joint;
    joint.name = required(e, "name", "joint");
    joint.line = e.GetLineNum();
    const std::string where = "joint '" + joint.name + "'";
    if (!joint_names_.insert(joint.name).second) fail(joint.line, where + ": there are two joints of this name");
    joint.type = required(e, "type", where);
    check_type(e, joint, where);
    if (joint.type != "fixed") count(joints_, kMaxJoints, joint.line, "joints that move");
    joint.parent = required(child(e, "parent", where), "link", where);
    joint.child = required(child(e, "child", where), "link", where);
    printer_.OpenElement("joint");
    printer_.PushAttribute("name", joint.name.c_str());
    printer_.PushAttribute("type", joint.type.c_str());
    joint.rpy = read_origin(e, where);
    print_link("parent", joint.parent);
    print_link("child", joint.child);
    read_axis(e, joint, where);
    read_limit(e, joint, where);
    read_dynamics(e, where);
    printer_.CloseElement();
    note_unknown_joint_parts(e, where);
    out_.joints.push_back(std::move(joint));
  }

  void check_type(const XMLElement& e, const UrdfOutline::JointEntry& joint, const std::string& where) const {
    if (std::find(kStandardTypes.begin(), kStandardTypes.end(), joint.type) == kStandardTypes.end()) {
      const std::string near = nearest(joint.type, kStandardTypes);
      fail(joint.line,
           fmt::format("{}: type '{}' is not a joint type of URDF; the standard types are {}{}", where, joint.type,
                       fmt::join(kStandardTypes, ", "), near.empty() ? "" : "; did you mean '" + near + "'?"));
    }
    if (joint.type == "planar") {
      fail(joint.line, where + ": planar joints are not supported; use two prismatic joints and a revolute one");
    }
    if (e.FirstChildElement("mimic")) {
      fail(joint.line, where +
                           ": mimic joints are not supported; make the joint fixed, or drive it on its own "
                           "(remove <mimic>)");
    }
  }

  void print_link(const char* tag, const std::string& link) {
    printer_.OpenElement(tag);
    printer_.PushAttribute("link", link.c_str());
    printer_.CloseElement();
  }

  void read_axis(const XMLElement& e, const UrdfOutline::JointEntry& joint, const std::string& where) {
    const XMLElement* axis = e.FirstChildElement("axis");
    if (!axis || joint.type == "fixed" || joint.type == "floating") return;
    printer_.OpenElement("axis");
    const std::vector<double> xyz = numbers(*axis, "xyz", 3, where);
    if (xyz[0] == 0 && xyz[1] == 0 && xyz[2] == 0) {
      fail(axis->GetLineNum(), where + ": <axis> xyz: the axis has no direction; it must not be the zero vector");
    }
    printer_.CloseElement();
  }

  void read_limit(const XMLElement& e, const UrdfOutline::JointEntry& joint, const std::string& where) {
    const bool bounded = joint.type == "revolute" || joint.type == "prismatic";
    if (!bounded && joint.type != "continuous") return;
    const XMLElement* limit = e.FirstChildElement("limit");
    if (!limit && bounded) {
      fail(joint.line, fmt::format("{}: a {} joint needs <limit lower upper effort velocity>{}", where, joint.type,
                                   joint.type == "revolute" ? " (without bounds it is a continuous joint)" : ""));
    }
    if (!limit) return;
    printer_.OpenElement("limit");
    if (bounded) read_bounds(*limit, joint.type == "prismatic", where);
    non_negative(*limit, "effort", where);
    non_negative(*limit, "velocity", where);
    printer_.CloseElement();
  }

  /// Absent bounds are 0 in URDF.
  void read_bounds(const XMLElement& limit, bool slides, const std::string& where) {
    const double lower = limit.Attribute("lower") ? number(limit, "lower", where) : 0;
    const double upper = limit.Attribute("upper") ? number(limit, "upper", where) : 0;
    if (lower > upper) {
      fail(limit.GetLineNum(), fmt::format("{}: <limit> lower {} is above upper {}", where, lower, upper));
    }
    if (!slides) return;  // bounds that leave a slide free may be any numbers, but not those that begin far away
    check_length(limit, "lower", std::max(lower, 0.0), where);
    check_length(limit, "upper", std::min(upper, 0.0), where);
  }

  void read_dynamics(const XMLElement& e, const std::string& where) {
    const XMLElement* dynamics = e.FirstChildElement("dynamics");
    if (!dynamics) return;
    const bool damping = dynamics->Attribute("damping"), friction = dynamics->Attribute("friction");
    if (!damping && !friction) return;  // urdfdom wants at least one
    printer_.OpenElement("dynamics");
    if (damping) non_negative(*dynamics, "damping", where);
    if (friction) non_negative(*dynamics, "friction", where);
    printer_.CloseElement();
  }

  void note_unknown_joint_parts(const XMLElement& e, const std::string& where) {
    for (const XMLElement* part = e.FirstChildElement(); part; part = part->NextSiblingElement()) {
      note_unknown(*part,
                   {"origin", "parent", "child", "axis", "limit", "dynamics", "calibration", "safety_controller",
                    "joint_properties"},
                   where);
    }
  }

  const std::string& name_;
  tinyxml2::XMLPrinter printer_;
  std::set<std::string> link_names_, joint_names_;
  std::size_t links_ = 0, joints_ = 0, collisions_ = 0, visuals_ = 0, unknown_ = 0;
  UrdfOutline out_;
};

}  // namespace

UrdfOutline outline_urdf(const std::string& xml, const std::string& name) { return Reader(name).run(xml); }

}  // namespace graze
