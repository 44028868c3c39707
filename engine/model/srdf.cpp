#include "engine/model/srdf.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "engine/model/limits.h"
#include "engine/model/urdf_spelling.h"
#include "engine/model/xml_text.h"
#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

/// A glob that matches the name, and hardly another.
std::string glob_of(std::string name) {
  for (char& c : name) {
    if (std::string_view("*{},").find(c) != std::string_view::npos) c = '?';
  }
  return name;
}

class SrdfReader {
 public:
  SrdfReader(const std::string& file, const Robot& robot, const std::function<void(const std::string&)>& warn)
      : file_(file), warn_(warn) {
    robot_ = robot.name;
    for (const Link& link : robot.links) {
      names_.push_back(link.name);
      touches_[link.name] = !link.collisions.empty();
    }
  }

  std::vector<std::pair<std::string, std::string>> run(const std::string& text) {
    tinyxml2::XMLDocument document;
    if (const auto fault = read_xml(text, document)) {
      fail(fault->line, fmt::format("{}; an SRDF file is an XML document <robot name=\"…\">…</robot>", fault->what));
    }
    const tinyxml2::XMLElement* robot = document.RootElement();
    if (!robot || std::string_view(robot->Name()) != "robot") {
      fail(robot ? robot->GetLineNum() : 1,
           fmt::format("root element <{}>: must be <robot>", clipped(robot ? robot->Name() : "", 40)));
    }
    const char* const tag = "disable_collisions";
    doubt(*robot, tag);
    for (const auto* e = robot->FirstChildElement(tag); e; e = e->NextSiblingElement(tag)) read_pair(*e);
    if (unknown_ > kMaxWarnings) warn_(fmt::format("{}: {} more unknown links", file_, unknown_ - kMaxWarnings));
    return {pairs_.begin(), pairs_.end()};
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", file_, line, message));
  }

  /// What is taken, and hardly meant so: a URDF, the file of another robot, misspelt elements, no pairs at all.
  void doubt(const tinyxml2::XMLElement& robot, const char* tag) {
    const char* const name = robot.Attribute("name");
    if (name && name != robot_) {
      tell(robot, fmt::format("the SRDF is of robot '{}', and the URDF of '{}'", clipped(name, 80), robot_));
    }
    if (const auto* link = robot.FirstChildElement("link")) {
      return tell(*link, "<link>: an SRDF has none; is this file a URDF? No pairs of links are taken from it");
    }
    const std::vector<std::string> known = {tag,
                                            "enable_collisions",
                                            "disable_default_collisions",
                                            "group",
                                            "group_state",
                                            "end_effector",
                                            "virtual_joint",
                                            "passive_joint",
                                            "link_sphere_approximation",
                                            "joint_property"};
    std::size_t misspelt = 0;
    for (const auto* e = robot.FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string near = nearest(e->Name(), known);
      if (near.empty() || near == e->Name() || ++misspelt > kMaxWarnings) continue;
      tell(*e, fmt::format("unknown element <{}> is ignored; did you mean <{}>?", clipped(e->Name(), 40), near));
    }
    if (misspelt > kMaxWarnings) {
      warn_(fmt::format("{}: {} more unknown elements are ignored", file_, misspelt - kMaxWarnings));
    }
    if (!robot.FirstChildElement(tag))
      tell(robot, fmt::format("no <{}>: the file names no pair of links that never touch", tag));
  }

  void tell(const tinyxml2::XMLElement& e, const std::string& what) {
    warn_(fmt::format("{}:{}: {}", file_, e.GetLineNum(), what));
  }

  void read_pair(const tinyxml2::XMLElement& e) {
    std::string links[2];
    bool both = true;
    for (int i = 0; i < 2; ++i) {
      const char* const attribute = i == 0 ? "link1" : "link2";
      const char* name = e.Attribute(attribute);
      if (!name || !*name) {
        fail(e.GetLineNum(),
             fmt::format("<{}> needs a non-empty {}{}", e.Name(), attribute, misspelt_attribute(e, attribute)));
      }
      const auto found = touches_.find(name);
      if (found == touches_.end()) tell_unknown(e, name);
      both = both && found != touches_.end() && found->second;
      links[i] = name;
    }
    if (!both) return;
    pairs_.insert(std::minmax(glob_of(links[0]), glob_of(links[1])));
    if (pairs_.size() > kMaxSrdfPairs) fail(e.GetLineNum(), fmt::format("more than {} pairs of links", kMaxSrdfPairs));
  }

  void tell_unknown(const tinyxml2::XMLElement& e, const std::string& name) {
    if (!told_.insert(name).second || ++unknown_ > kMaxWarnings) return;
    const std::string near = nearest(name, names_);
    warn_(fmt::format("{}:{}: link '{}' is not in the robot{}", file_, e.GetLineNum(), clipped(name, 80),
                      near.empty() ? "" : "; did you mean '" + near + "'?"));
  }

  const std::string& file_;
  const std::function<void(const std::string&)>& warn_;
  std::string robot_;  // its name in the URDF
  std::vector<std::string> names_;
  std::map<std::string, bool> touches_;  // by link: whether it has collision shapes
  std::set<std::string> told_;
  std::set<std::pair<std::string, std::string>> pairs_;
  std::size_t unknown_ = 0;
};

}  // namespace

std::vector<std::pair<std::string, std::string>> load_srdf(const std::string& file, const Robot& robot,
                                                           const std::function<void(const std::string&)>& warn) {
  const std::string text = read_input(file, "", kMaxUrdfBytes);
  return SrdfReader(file, robot, warn).run(text);
}

}  // namespace graze
