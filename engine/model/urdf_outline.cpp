#include "engine/model/urdf_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <set>
#include <string_view>

#include "engine/model/limits.h"
#include "engine/model/urdf_bodies.h"
#include "engine/model/urdf_joints.h"
#include "engine/model/urdf_mimics.h"
#include "engine/model/urdf_spelling.h"
#include "engine/model/urdf_tree.h"
#include "engine/model/urdf_values.h"
#include "engine/model/xacro.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using tinyxml2::XMLElement;

class Reader {
 public:
  explicit Reader(UrdfProblems& problems) : problems_(problems), values_(problems), printer_(values_.printer()) {}

  UrdfOutline run(tinyxml2::XMLDocument& document) {
    XMLElement& robot = root_of(document);
    if (const auto use = xacro_use(document); use && use->element) {
      fail(use->line, fmt::format("{}: this is a xacro file; {}", use->what, xacro_advice(problems_.name())));
    }
    leave_out_macros(robot);
    check_spelling(robot, problems_);
    name_robot(robot);
    printer_.OpenElement("robot");
    printer_.PushAttribute("name", out_.robot.c_str());
    for (XMLElement* e = robot.FirstChildElement(); e; e = e->NextSiblingElement()) read_part(*e);
    declare_parents(robot);
    printer_.CloseElement();
    if (nameless_) problems_.raise();
    out_.xml = printer_.CStr();
    order_as_tree(out_, problems_);
    settle_mimics(out_, problems_);
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const { problems_.stop(line, message); }

  XMLElement& root_of(tinyxml2::XMLDocument& document) const {
    XMLElement* root = document.RootElement();
    if (!root) fail(1, "the document has no element; a URDF file is an XML document <robot name=\"…\">…</robot>");
    if (std::string_view(root->Name()) != "robot") {
      fail(root->GetLineNum(), fmt::format("root element <{}>: must be <robot>{}", clipped(root->Name(), 40),
                                           std::string_view(root->Name()) == "sdf" ? "; this is SDF, not URDF" : ""));
    }
    return *root;
  }

  /// Whether a link or joint stands in an element, at any depth.
  static bool holds_part(const XMLElement& e) {
    for (const XMLElement* child = e.FirstChildElement(); child; child = child->NextSiblingElement()) {
      const std::string_view name = child->Name();
      if (name == "link" || name == "joint" || holds_part(*child)) return true;
    }
    return false;
  }

  /// What xacro left of macros that nothing defines.
  void leave_out_macros(XMLElement& e) {
    for (XMLElement* child = e.FirstChildElement(); child;) {
      XMLElement* const next = child->NextSiblingElement();
      if (is_of_xacro(*child)) {
        if (holds_part(*child)) {
          fail(line_of(*child),
               fmt::format("<{}>: xacro left it, and links or joints in it, which nobody knows the fate of; "
                           "run xacro on the file's source, or take the element away and leave what is in it",
                           clipped(child->Name(), 40)));
        }
        problems_.repair(line_of(*child),
                         fmt::format("<{}>: a call of a macro that xacro did not know and left as it was",
                                     clipped(child->Name(), 40)),
                         "leaves it out");
        e.DeleteChild(child);
      } else {
        leave_out_macros(*child);
      }
      child = next;
    }
  }

  void name_robot(XMLElement& robot) {
    const char* const name = robot.Attribute("name");
    const std::string file = std::filesystem::path(problems_.name()).stem().string();
    if ((!name || !*name) && !file.empty()) {
      problems_.repair(line_of(robot), "robot: <robot> needs a non-empty name" + misspelt_attribute(robot, "name"),
                       fmt::format("takes the file's, '{}'", clipped(file, 40)));
      robot.SetAttribute("name", file.substr(0, kMaxAttributeBytes).c_str());
    }
    out_.robot = values_.required(robot, "name", "robot");
  }

  /// "World", " world".
  static bool is_nearly_world(const std::string& name) {
    std::string bare;
    for (const char c : name) {
      if (std::isspace(static_cast<unsigned char>(c)) == 0)
        bare += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return bare == "world";
  }

  /// Some files join their robot to a `world`, or to the flange of an arm, that they do not have.
  void declare_parents(XMLElement& robot) {
    for (const UrdfOutline::JointEntry& joint : out_.joints) {
      const std::string& parent = joint.parent;
      if (parent.empty() || link_names_.count(parent) > 0) continue;
      const bool world = parent == "world";
      if (!world && !nearest(parent, {link_names_.begin(), link_names_.end()}).empty()) continue;  // misspelt
      if (!world && is_nearly_world(parent)) {
        fail(joint.line,
             fmt::format("joint '{}': parent link '{}' is not there; did you mean 'world', which fixes what is "
                         "joined to it?",
                         joint.name, clipped(parent, 80)));
      }
      problems_.repair(
          joint.line,
          fmt::format("joint '{}': parent link '{}' is not there; write <link name=\"{}\"/> into the file{}",
                      joint.name, clipped(parent, 80), clipped(parent, 80),
                      world ? ", which fixes what is joined to it, or leave the joint out and say 'base: fixed' in the "
                              "scenario"
                            : ", or leave the joint out"),
          fmt::format("writes <link name=\"{}\"/>", clipped(parent, 80)));
      XMLElement* link = robot.GetDocument()->NewElement("link");
      link->SetAttribute("name", parent.c_str());
      robot.InsertFirstChild(link);
      read_link(*link);
    }
  }

  void read_part(XMLElement& e) {
    const std::string_view tag = e.Name();
    if (tag == "link") {
      read_link(e);
    } else if (tag == "joint") {
      read_joint(e);
    } else if (tag == "transmission") {
      note_reduction(e, e.Attribute("name"), 0);
    }
  }

  /// Gears count in what a joint's own numbers say, and not once more.
  void note_reduction(const XMLElement& e, const char* transmission, int depth) {
    constexpr int kDeepest = 3;  // <transmission><joint|actuator><…>
    for (const XMLElement* part = e.FirstChildElement(); part; part = part->NextSiblingElement()) {
      if (std::string_view(part->Name()) == "mechanicalReduction" && part->GetText()) {
        const std::vector<std::string_view> words = words_of(part->GetText());
        if (words.size() == 1 && parse_number(words[0]) == 1.0) continue;
        if (++reductions_ > kMaxWarnings) return;
        problems_.warn(fmt::format(
            "{}:{}: transmission '{}': mechanicalReduction {} is not used: torques and speeds are those of the joint, "
            "behind the gear",
            problems_.name(), line_of(*part), clipped(transmission ? transmission : "", 80),
            clipped(part->GetText(), 40)));
      } else if (depth < kDeepest) {
        note_reduction(*part, transmission, depth + 1);
      }
    }
  }

  /// What there may be only so many of: counts one more.
  void count(std::size_t& sum, std::size_t most, int line, const char* what) const {
    if (++sum > most) fail(line, fmt::format("more than {} {}; a robot has at most {}", most, what, most));
  }

  // ---- links

  void read_link(XMLElement& e) {
    count(links_, kMaxLinks, line_of(e), "links");
    UrdfOutline::LinkEntry link;
    link.element = &e;
    link.name = values_.required(e, "name", "link");
    link.line = line_of(e);
    const std::string where = "link '" + link.name + "'";
    named(link_names_, link.name, link.line, where, "links");
    printer_.OpenElement("link");
    printer_.PushAttribute("name", link.name.c_str());
    for (XMLElement* part = e.FirstChildElement(); part;) {
      XMLElement* next = part->NextSiblingElement();  // a repair may take the part away
      read_link_part(e, *part, where, link);
      part = next;
    }
    printer_.CloseElement();
    out_.links.push_back(std::move(link));
  }

  /// Without names of its own for each, nothing can be said of how they hang together.
  void named(std::set<std::string>& names, const std::string& name, int line, const std::string& where,
             const char* what) {
    if (name.empty()) {
      nameless_ = true;
    } else if (!names.insert(name).second) {
      problems_.refuse(line, fmt::format("{}: there are two {} of this name", where, what));
      nameless_ = true;
    }
  }

  void read_link_part(XMLElement& e, XMLElement& part, const std::string& where, UrdfOutline::LinkEntry& link) {
    const std::string_view tag = part.Name();
    if (tag == "inertial") {
      read_inertial(e, part, where, link);
    } else if (tag == "collision") {
      count(collisions_, kMaxShapes, line_of(part), "collision shapes");
      read_shape(e, part, where, false, link.collisions);
    } else if (tag == "visual") {
      count(visuals_, kMaxVisuals, line_of(part), "visual shapes");
      if (!invisible(part)) read_shape(e, part, where, true, link.visuals);
    }
  }

  void read_inertial(XMLElement& e, XMLElement& inertial, const std::string& where, UrdfOutline::LinkEntry& link) {
    if (link.inertial_line) {
      problems_.repair(line_of(inertial), where + ": a second <inertial>; a link has at most one", "takes the first");
      e.DeleteChild(&inertial);
      return;
    }
    XMLElement* mass = inertial.FirstChildElement("mass");
    if (!mass) {
      problems_.repair(line_of(inertial), where + ": <inertial> has no <mass>" + misspelt_element(inertial, "mass"),
                       "takes the link as one without <inertial>");
      e.DeleteChild(&inertial);
      return;
    }
    link.inertial_line = line_of(inertial);
    const std::size_t before = problems_.refused();
    printer_.OpenElement("inertial");
    link.inertial_rpy = values_.origin(inertial, where);
    printer_.OpenElement("mass");
    if (const double given = values_.non_negative(*mass, "value", where); given > kMostMass) {
      problems_.refuse(line_of(*mass),
                       fmt::format("{}: <mass> value: {:g} kg is out of range; a link weighs at most {:g} kg", where,
                                   given, kMostMass));
    }
    printer_.CloseElement();
    read_inertia(inertial, where);
    printer_.CloseElement();
    link.sound = problems_.refused() == before;
  }

  void read_inertia(XMLElement& inertial, const std::string& where) {
    XMLElement* inertia = inertial.FirstChildElement("inertia");
    if (!inertia) {
      problems_.repair(line_of(inertial),
                       where + ": <inertial> has no <inertia>" + misspelt_element(inertial, "inertia"),
                       "takes a point mass");
      inertia = inertial.InsertNewChildElement("inertia");
      write_inertia(*inertia, Mat3::Zero());
    }
    printer_.OpenElement("inertia");
    for (const char* entry : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
      const bool product = entry[1] != entry[2];
      if (product && !inertia->Attribute(entry)) {
        problems_.repair(
            line_of(*inertia),
            fmt::format("{}: <inertia> needs a non-empty {}{}", where, entry, misspelt_attribute(*inertia, entry)),
            "takes 0");
        inertia->SetAttribute(entry, "0");
      }
      values_.number(*inertia, entry, where);
    }
    printer_.CloseElement();
  }

  /// A picture of no size, which some files use to draw nothing.
  static bool invisible(const XMLElement& visual) {
    const XMLElement* geometry = visual.FirstChildElement("geometry");
    const XMLElement* shape = geometry ? geometry->FirstChildElement() : nullptr;
    if (!shape) return false;
    for (const char* attribute : {"radius", "length", "size"}) {
      const char* text = shape->Attribute(attribute);
      for (std::string_view word : words_of(text ? text : "")) {
        if (parse_number(word) == 0.0) return true;
      }
    }
    return false;
  }

  /// What is wrong with the kind of a shape, or nothing.
  static std::string shape_problem(const XMLElement& e, const XMLElement* shape) {
    if (!e.FirstChildElement("geometry")) {
      return fmt::format("<{}> has no <geometry>{}", e.Name(), misspelt_element(e, "geometry"));
    }
    if (!shape) return fmt::format("<{}> has an empty <geometry>", e.Name());
    const std::string tag = shape->Name();
    const std::vector<std::string> known = {"box", "sphere", "cylinder", "capsule", "mesh"};
    if (std::find(known.begin(), known.end(), tag) != known.end()) return "";
    const std::string near = nearest(tag, known);
    return fmt::format("unknown shape <{}>; shapes are box, sphere, cylinder, capsule, mesh{}", clipped(tag, 40),
                       near.empty() ? "" : "; did you mean <" + near + ">?");
  }

  void read_shape(XMLElement& link, XMLElement& e, const std::string& where, bool picture,
                  std::vector<UrdfOutline::ShapeEntry>& out) {
    XMLElement* geometry = e.FirstChildElement("geometry");
    XMLElement* shape = geometry ? geometry->FirstChildElement() : nullptr;
    const std::string problem = shape_problem(e, shape);
    if (!problem.empty() && picture) {
      problems_.repair(line_of(e), where + ": " + problem, "leaves the picture out");
      link.DeleteChild(&e);
      return;
    }
    if (!problem.empty()) return problems_.refuse(line_of(shape ? *shape : e), where + ": " + problem);
    UrdfOutline::ShapeEntry entry;
    entry.line = line_of(e);
    entry.element = &e;
    printer_.OpenElement(e.Name());
    entry.rpy = values_.origin(e, where);
    printer_.OpenElement("geometry");
    read_geometry(*shape, where, entry);
    printer_.CloseElement();
    printer_.CloseElement();
    out.push_back(entry);
  }

  void read_geometry(XMLElement& shape, const std::string& where, UrdfOutline::ShapeEntry& entry) {
    const std::string tag = shape.Name();
    entry.capsule = tag == "capsule";
    printer_.OpenElement(entry.capsule ? "cylinder" : tag.c_str());
    if (tag == "mesh") {
      read_mesh(shape, where);
    } else if (tag == "box") {
      values_.sizes(shape, "size", 3, where);
    } else {
      values_.sizes(shape, "radius", 1, where);
      if (tag != "sphere") values_.sizes(shape, "length", 1, where);
    }
    printer_.CloseElement();
  }

  void read_mesh(XMLElement& mesh, const std::string& where) {
    printer_.PushAttribute("filename", values_.required(mesh, "filename", where).c_str());
    if (!mesh.Attribute("scale")) return;
    for (double value : values_.numbers(mesh, "scale", 3, where, 1)) {
      if (value != 0) continue;
      problems_.refuse(line_of(mesh), where + ": <mesh> scale: 0 flattens the mesh; factors must not be 0");
    }
  }

  // ---- joints

  void read_joint(XMLElement& e) {
    UrdfOutline::JointEntry joint = read_urdf_joint(e, values_);
    const std::string where = "joint '" + joint.name + "'";
    named(joint_names_, joint.name, joint.line, where, "joints");
    if (joint.parent.empty() || joint.child.empty()) nameless_ = true;
    if (joint.type != "fixed") count(joints_, kMaxJoints, joint.line, "joints that move");
    out_.joints.push_back(std::move(joint));
  }

  UrdfProblems& problems_;
  UrdfValues values_;
  tinyxml2::XMLPrinter& printer_;  // of values_
  std::set<std::string> link_names_, joint_names_;
  std::size_t links_ = 0, joints_ = 0, collisions_ = 0, visuals_ = 0, reductions_ = 0;
  bool nameless_ = false;  // some link or joint has no name of its own
  UrdfOutline out_;
};

}  // namespace

UrdfOutline outline_urdf(tinyxml2::XMLDocument& document, UrdfProblems& problems) {
  return Reader(problems).run(document);
}

}  // namespace graze
