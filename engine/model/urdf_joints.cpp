#include "engine/model/urdf_joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/model/limits.h"
#include "engine/model/urdf_spelling.h"
#include "engine/settings/settings.h"

namespace graze {

using tinyxml2::XMLElement;

namespace {

const std::vector<std::string> kStandardTypes = {"revolute", "continuous", "prismatic", "fixed", "floating", "planar"};

/// Bounds of a slide that has none: as far as coordinates go.
constexpr double kFarthest = kMaxLength;

class JointReader {
 public:
  JointReader(XMLElement& joint, UrdfValues& values)
      : e_(joint), values_(values), problems_(values.problems()), printer_(values.printer()) {}

  UrdfOutline::JointEntry run() {
    out_.element = &e_;
    out_.line = line_of(e_);
    out_.name = values_.required(e_, "name", "joint");
    where_ = "joint '" + out_.name + "'";
    read_type();
    out_.parent = link_of("parent");
    out_.child = link_of("child");
    printer_.OpenElement("joint");
    printer_.PushAttribute("name", out_.name.c_str());
    printer_.PushAttribute("type", out_.type.c_str());
    out_.rpy = values_.origin(e_, where_);
    print_link("parent", out_.parent);
    print_link("child", out_.child);
    read_axis();
    read_limit();
    read_dynamics();
    printer_.CloseElement();
    return std::move(out_);
  }

 private:
  void read_type() {
    out_.type = values_.required(e_, "type", where_);
    if (!out_.type.empty() &&
        std::find(kStandardTypes.begin(), kStandardTypes.end(), out_.type) == kStandardTypes.end()) {
      const std::string near = nearest(out_.type, kStandardTypes);
      problems_.refuse(out_.line, fmt::format("{}: type '{}' is not a joint type of URDF; the standard types are {}{}",
                                              where_, out_.type, fmt::join(kStandardTypes, ", "),
                                              near.empty() ? "" : "; did you mean '" + near + "'?"));
      out_.type.clear();
    }
    if (out_.type.empty()) {
      out_.type = "continuous";  // a stand-in
      guessed_ = true;
    }
    read_mimic();
    if (out_.type != "revolute" || e_.FirstChildElement("limit")) return;
    problems_.repair(out_.line,
                     where_ +
                         ": a revolute joint needs <limit lower upper effort velocity> (without bounds it is a "
                         "continuous joint)" +
                         misspelt_element(e_, "limit"),
                     "makes it continuous");
    e_.SetAttribute("type", "continuous");
    out_.type = "continuous";
  }

  /// What it follows is looked at when all joints are known.
  void read_mimic() {
    XMLElement* mimic = e_.FirstChildElement("mimic");
    if (!mimic || !turns_or_slides()) return;
    out_.mimic_line = line_of(*mimic);
    const char* leader = mimic->Attribute("joint");
    out_.mimic.joint = leader ? leader : "";
    if (mimic->Attribute("multiplier")) out_.mimic.multiplier = values_.unprinted(*mimic, "multiplier", where_, 1);
    if (mimic->Attribute("offset")) out_.mimic.offset = values_.unprinted(*mimic, "offset", where_, 0);
  }

  std::string link_of(const char* role) {
    const XMLElement* found = e_.FirstChildElement(role);
    if (found) return values_.required(*found, "link", where_);
    problems_.refuse(out_.line, fmt::format("{}: <joint> has no <{}>{}", where_, role, misspelt_element(e_, role)));
    return "";
  }

  void print_link(const char* tag, const std::string& link) {
    printer_.OpenElement(tag);
    printer_.PushAttribute("link", link.c_str());
    printer_.CloseElement();
  }

  bool turns_or_slides() const {
    return out_.type == "revolute" || out_.type == "continuous" || out_.type == "prismatic";
  }

  /// The first axis counts, as in other programs.
  void read_axis() {
    XMLElement* axis = e_.FirstChildElement("axis");
    if (!axis || !turns_or_slides()) return;
    printer_.OpenElement("axis");
    const std::size_t before = problems_.refused();
    const std::vector<double> xyz = values_.numbers(*axis, "xyz", 3, where_);
    if (xyz[0] == 0 && xyz[1] == 0 && xyz[2] == 0 && problems_.refused() == before) {
      problems_.refuse(line_of(*axis),
                       where_ + ": <axis> xyz: the axis has no direction; it must not be the zero vector");
    }
    printer_.CloseElement();
    for (const XMLElement* other = axis->NextSiblingElement("axis"); other; other = other->NextSiblingElement("axis")) {
      const char* text = other->Attribute("xyz");
      if (text && axis->Attribute("xyz", text)) continue;
      problems_.warn(fmt::format("{}:{}: {}: another <axis>: the first one, \"{}\", is taken", problems_.name(),
                                 line_of(*other), where_, number_text(xyz)));
    }
  }

  void read_limit() {
    const bool bounded = out_.type == "revolute" || out_.type == "prismatic";
    if (!bounded && (out_.type != "continuous" || guessed_)) return;
    XMLElement* limit = e_.FirstChildElement("limit");
    if (!limit && !bounded) return;
    if (!limit) limit = &slide_limit();
    printer_.OpenElement("limit");
    if (bounded) read_bounds(*limit);
    values_.bound(*limit, "effort", where_);
    values_.bound(*limit, "velocity", where_);
    doubt_limit(*limit);
    printer_.CloseElement();
  }

  /// A <limit> for a prismatic joint that has none.
  XMLElement& slide_limit() {
    problems_.repair(
        out_.line,
        where_ + ": a prismatic joint needs <limit lower upper effort velocity>" + misspelt_element(e_, "limit"),
        fmt::format("writes bounds of {:g} m, effort and velocity without limit", kFarthest));
    XMLElement* limit = e_.InsertNewChildElement("limit");
    limit->SetAttribute("lower", number_text({-kFarthest}).c_str());
    limit->SetAttribute("upper", number_text({kFarthest}).c_str());
    limit->SetAttribute("effort", number_text({kNoBound}).c_str());
    limit->SetAttribute("velocity", number_text({kNoBound}).c_str());
    return *limit;
  }

  /// Absent bounds are 0 in URDF.
  void read_bounds(XMLElement& limit) {
    double lower = limit.Attribute("lower") ? values_.number(limit, "lower", where_) : 0;
    double upper = limit.Attribute("upper") ? values_.number(limit, "upper", where_) : 0;
    if (lower > upper) {
      problems_.repair(line_of(limit), fmt::format("{}: <limit> lower {} is above upper {}", where_, lower, upper),
                       "swaps them");
      std::swap(lower, upper);
      limit.SetAttribute("lower", number_text({lower}).c_str());
      limit.SetAttribute("upper", number_text({upper}).c_str());
    }
    out_.lower = lower, out_.upper = upper;
    if (out_.type != "prismatic") return;
    // Bounds that leave a slide free may be any numbers, but not those that begin far away.
    values_.check_length(limit, "lower", std::max(lower, 0.0), where_);
    values_.check_length(limit, "upper", std::min(upper, 0.0), where_);
  }

  /// Numbers that stop the joint, and angles that look like degrees.
  void doubt_limit(const XMLElement& limit) {
    for (const char* attribute : {"effort", "velocity"}) {
      const char* const text = limit.Attribute(attribute);
      if (!text || parse_number(text) != 0.0 || out_.mimic_line) continue;  // what follows another joint has no motor
      problems_.doubt(line_of(limit), fmt::format("{}: <limit> {}: 0 leaves the motor no torque; a joint that is "
                                                  "driven needs one > 0",
                                                  where_, attribute));
    }
    // Several turns are hardly limits; more than two turns in degrees are none, but stand for "no limit".
    constexpr double kSeveral = 8 * M_PI, kMostDegrees = 720;
    const double most = std::max(std::abs(out_.lower), std::abs(out_.upper));
    if (out_.type != "revolute" || !(most > kSeveral && most <= kMostDegrees)) return;
    problems_.doubt(line_of(limit),
                    fmt::format("{}: <limit> {:g} … {:g} rad: as far as {:.3g} turns; URDF has radians: is it meant in "
                                "degrees ({:.6g} … {:.6g} rad)?",
                                where_, out_.lower, out_.upper, most / (2 * M_PI), out_.lower * M_PI / 180,
                                out_.upper * M_PI / 180));
  }

  void read_dynamics() {
    XMLElement* dynamics = e_.FirstChildElement("dynamics");
    if (!dynamics) return;
    const bool damping = dynamics->Attribute("damping"), friction = dynamics->Attribute("friction");
    if (!damping && !friction) return;  // urdfdom wants at least one
    printer_.OpenElement("dynamics");
    if (damping) values_.non_negative(*dynamics, "damping", where_);
    if (friction) values_.non_negative(*dynamics, "friction", where_);
    printer_.CloseElement();
  }

  XMLElement& e_;
  UrdfValues& values_;
  UrdfProblems& problems_;
  tinyxml2::XMLPrinter& printer_;
  UrdfOutline::JointEntry out_;
  std::string where_;     // "joint 'NAME'"
  bool guessed_ = false;  // the type is a stand-in
};

}  // namespace

UrdfOutline::JointEntry read_urdf_joint(XMLElement& joint, UrdfValues& values) {
  return JointReader(joint, values).run();
}

}  // namespace graze
