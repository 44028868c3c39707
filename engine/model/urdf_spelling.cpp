#include "engine/model/urdf_spelling.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

#include "engine/model/limits.h"
#include "engine/model/urdf_values.h"
#include "engine/settings/settings.h"

namespace graze {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

namespace {

using Words = std::vector<std::string>;

/// What URDF has in an element of this name.
struct UrdfWord {
  std::string tag;
  Words attributes, children;
};

const std::vector<UrdfWord>& urdf_words() {
  const Words shape = {"origin", "geometry", "name", "material", "verbose", "contact_coefficients"};
  static const std::vector<UrdfWord> words = {
      {"robot", {"name", "version"}, {"link", "joint", "material", "transmission", "gazebo", "sensor"}},
      {"link",
       {"name"},
       {"inertial", "collision", "visual", "contact", "sensor", "material", "self_collision_checking"}},
      {"joint",
       {"name", "type"},
       {"origin", "parent", "child", "axis", "limit", "dynamics", "calibration", "safety_controller",
        "joint_properties", "mimic"}},
      {"inertial", {}, {"origin", "mass", "inertia"}},
      {"collision", {}, shape},
      {"visual", {}, shape},
      {"geometry", {}, {"box", "sphere", "cylinder", "capsule", "mesh"}},
      {"origin", {"xyz", "rpy"}, {}},
      {"mass", {"value"}, {}},
      {"inertia", {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}, {}},
      {"box", {"size"}, {}},
      {"sphere", {"radius"}, {}},
      {"cylinder", {"radius", "length"}, {}},
      {"capsule", {"radius", "length"}, {}},
      {"mesh", {"filename", "scale"}, {}},
      {"parent", {"link"}, {}},
      {"child", {"link"}, {}},
      {"axis", {"xyz"}, {}},
      {"limit", {"lower", "upper", "effort", "velocity"}, {}},
      {"dynamics", {"damping", "friction"}, {}},
      {"mimic", {"joint", "multiplier", "offset"}, {}},
      {"disable_collisions", {"link1", "link2", "reason"}, {}},  // of SRDF
  };
  return words;
}

const UrdfWord* word_of(const XMLElement& e) {
  const std::vector<UrdfWord>& all = urdf_words();
  const auto found = std::find_if(all.begin(), all.end(), [&](const UrdfWord& word) { return word.tag == e.Name(); });
  return found == all.end() ? nullptr : &*found;
}

bool has_word(const Words& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// Whether an element has at most one such child. (Axes that are repeated are told where they are read.)
bool has_one_of(std::string_view element, std::string_view child) {
  if (element == "joint") return child != "axis";
  return element == "collision" || element == "visual" || element == "inertial";
}

class SpellingReader {
 public:
  explicit SpellingReader(UrdfProblems& problems) : problems_(problems) {}

  void check(const XMLElement& robot) {
    check_element(robot, "robot", "robot");
    if (unknown_ > kMaxWarnings) {
      problems_.warn(
          fmt::format("{}: {} more unknown elements are ignored", problems_.name(), unknown_ - kMaxWarnings));
    }
  }

 private:
  void tell(const XMLElement& e, const std::string& where, const std::string& what) {
    if (++unknown_ > kMaxWarnings) return;
    problems_.warn(fmt::format("{}:{}: {}: {}", problems_.name(), line_of(e), where, what));
  }

  void check_element(const XMLElement& e, const std::string& where, std::string_view under) {
    const UrdfWord* const word = word_of(e);
    if (!word) return;
    check_attributes(e, *word, where);
    std::set<std::string> seen;
    for (const XMLElement* part = e.FirstChildElement(); part; part = part->NextSiblingElement()) {
      const std::string tag = part->Name();
      if (!has_word(word->children, tag)) {
        const std::string near = nearest(tag, word->children);
        // An unknown shape is told where it is read.
        if (near.empty() || under == "geometry") continue;
        tell(*part, where, fmt::format("unknown element <{}> is ignored; did you mean <{}>?", clipped(tag, 40), near));
        continue;
      }
      if (under == "geometry" && !seen.empty()) {
        tell(*part, where,
             fmt::format("<{}>, a second shape in a <geometry>, is ignored; write another <collision>", tag));
      } else if (seen.count(tag) > 0 && has_one_of(under, tag)) {
        tell(*part, where, fmt::format("a second <{}> is ignored; the first one is taken", tag));
      }
      seen.insert(tag);
      const char* const name = part->Attribute("name");
      const bool part_of_robot = under == "robot";
      check_element(*part, part_of_robot ? fmt::format("{} '{}'", tag, clipped(name ? name : "", 80)) : where, tag);
    }
  }

  void check_attributes(const XMLElement& e, const UrdfWord& word, const std::string& where) {
    Words lacking;  // a name near to one that is there is not a misspelt form of it
    for (const std::string& one : word.attributes) {
      if (!e.Attribute(one.c_str())) lacking.push_back(one);
    }
    for (const XMLAttribute* a = e.FirstAttribute(); a; a = a->Next()) {
      if (has_word(word.attributes, a->Name())) continue;
      const std::string near = nearest(a->Name(), lacking);
      if (near.empty()) continue;
      tell(e, where,
           fmt::format("<{}>: unknown attribute {}=\"{}\" is ignored; did you mean {}?", e.Name(),
                       clipped(a->Name(), 40), clipped(a->Value(), 40), near));
    }
  }

  UrdfProblems& problems_;
  std::size_t unknown_ = 0;
};

}  // namespace

void check_spelling(const XMLElement& robot, UrdfProblems& problems) { SpellingReader(problems).check(robot); }

std::string misspelt_element(const XMLElement& parent, const std::string& tag) {
  const UrdfWord* const word = word_of(parent);
  for (const XMLElement* e = parent.FirstChildElement(); e; e = e->NextSiblingElement()) {
    if ((word && has_word(word->children, e->Name())) || nearest(e->Name(), {tag}).empty()) continue;
    return fmt::format("; did you mean <{}> by <{}> in line {}?", tag, clipped(e->Name(), 40), line_of(*e));
  }
  return "";
}

std::string misspelt_attribute(const XMLElement& e, const std::string& attribute) {
  if (e.Attribute(attribute.c_str())) return "";
  const UrdfWord* const word = word_of(e);
  for (const XMLAttribute* a = e.FirstAttribute(); a; a = a->Next()) {
    if ((word && has_word(word->attributes, a->Name())) || nearest(a->Name(), {attribute}).empty()) continue;
    return fmt::format("; did you mean {} by {}=\"{}\"?", attribute, clipped(a->Name(), 40), clipped(a->Value(), 40));
  }
  return "";
}

}  // namespace graze
