#include "jobs/cli/key_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>
#include <sstream>

#include "engine/settings/units.h"
#include "jobs/cli/description_text.h"
#include "jobs/cli/scenario_schema.h"
#include "scenarios/components.h"
#include "scenarios/keys.h"

namespace graze {
namespace {

/// Paths of parameters as a person writes them, for `uncertain`.
constexpr const char* kParameterPaths =
    R"(  robot.link.LINK.{density,mass,length,radius,friction,restitution}
  robot.link.LINK.size.{x,y,z}, robot.link.LINK.com.{x,y,z}
  robot.joint.JOINT.{zero,damping,friction,effort,velocity}
  robot.joint.JOINT.{gear,rotor_inertia}
  robot.joint.JOINT.axis: {cone: {std: …}}
  environment.OBJECT.{friction,restitution,stiffness,damping}
  environment.OBJECT.{density,mass,radius,length}
  environment.OBJECT.size.{x,y,z}, environment.OBJECT.position.{x,y,z}
  environment.OBJECT.rotation.{roll,pitch,yaw}
  contact.{friction,restitution,stiffness,damping,model}, gravity.{x,y,z}, control.lag
  initial.base.{x,y,z,roll,pitch,yaw}, initial.base.velocity.{…}
  initial.joint.JOINT.{position,velocity}
  disturbances.NAME.{at,impulse,force,duration,azimuth,elevation,mass}
  disturbances.NAME.point.{x,y,z}
  sensor.…, actuator.…: graze help sensors
)";

const ComponentGroup& group_of(const std::vector<ComponentGroup>& groups, const std::string& topic) {
  return *std::find_if(groups.begin(), groups.end(), [&](const ComponentGroup& one) { return one.topic == topic; });
}

std::string section_help(const std::string& name, std::size_t width) {
  const std::vector<ComponentGroup>& groups = component_groups();
  for (const Component& one : group_of(groups, "sections").all) {
    if (one.name == name) return component_help(group_of(groups, "sections"), one, width);
  }
  return "";
}

std::string list_of(const std::string& topic, std::size_t width) {
  return group_help(group_of(component_groups(), topic), width);
}

std::string environment_help(std::size_t width) {
  return wrapped(
             "environment, a map of a scenario: objects by names that you give, each with a shape\n"
             "Example: environment: {ground: {plane: z}, step: {box: [1, 1, 3 cm]}}\n\n",
             width) +
         section_help("object", width) + "\n" + list_of("shapes", width);
}

std::string disturbances_help(std::size_t width) {
  return wrapped(
             "disturbances, a map of a scenario: pushes and payloads by names that you give\n"
             "Example: disturbances: {shove: {push: BODY0, impulse: 0.3 N s, azimuth: 90 deg, at: 1 s}}\n\n",
             width) +
         section_help("disturbance", width);
}

std::string uncertain_help(std::size_t width) {
  return wrapped(
             "uncertain, a map of a scenario: what is drawn for which parameters, by globs of their paths; later "
             "entries win\n"
             "Example: uncertain: {contact.friction: {uniform: [0.8, 1.2]}, '*.density': {normal: {std: 5 %}}}\n\n"
             "Paths of parameters (graze check FILE lists those of a scenario; more: docs/scenario.md, uncertain, "
             "and docs/parameters.md):\n\n",
             width) +
         wrapped(kParameterPaths, width, 2) + "\n" + list_of("distributions", width) + "\n" +
         section_help("spread", width) + "\n" + section_help("correlated", width);
}

std::string witnesses_help(const std::string& what, std::size_t width) {
  return wrapped(what, width) + "\n" + section_help("requirement", width) + "\n" + list_of("witnesses", width);
}

std::string units_help(std::size_t width) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (std::size_t i = 0; i < quantity_names().size(); ++i) {
    std::string name = quantity_names()[i];
    std::replace(name.begin(), name.end(), '_', ' ');
    rows.emplace_back(name, units_of(static_cast<Quantity>(i)));
  }
  return list_text(
      "Units that may stand behind a number, by what it measures; without one it is the first (a share of "
      "1, where it is %):",
      rows,
      "In a list: [1 m, 1 cm], or one for all, [1, 2, cm]. More: docs/scenario.md, Numbers and "
      "units.",
      width);
}

constexpr const char* kOver =
    "over, a key of a policy: one policy for each value of a setting, and for several settings one for each "
    "combination; all meet the same particles\n"
    "Value: {PATH: [VALUE, …]}, where PATH begins below the policy's name\n"
    "Example: over: {gait.step_height: [1 cm, 2 cm]}\n"
    "The policy `step` becomes step/1cm and step/2cm. More: docs/scenario.md, policies.\n";
constexpr const char* kInclude =
    "include, a key of any map: files whose maps are merged under this one; keys that stand here win\n"
    "Value: FILE or [FILE, …], relative to the file in which the key stands\n"
    "Example: include: base.yaml\n"
    "A map tagged !replace is not merged; `key: ~` takes a key out. More: docs/scenario.md, Several files.\n";
constexpr const char* kRequirements =
    "requirements, a map of task: witnesses by names that you give, which stay >= 0, or the trace is a known failure\n"
    "Example: requirements: {upright: {tilt: {link: BODY0, below: 45 deg}}}\n";
constexpr const char* kMeasures =
    "measures, a map of task: witnesses by names that you give, which are watched as requirements are and decide "
    "nothing\n"
    "Example: measures: {calm: {speed: {link: BODY0, below: 1 m/s}}}\n";

using MapHelp = std::function<std::string(std::size_t)>;

const std::vector<std::pair<std::string, MapHelp>>& maps() {
  static const std::vector<std::pair<std::string, MapHelp>> all = {
      {"environment", environment_help},
      {"disturbances", disturbances_help},
      {"uncertain", uncertain_help},
      {"over", [](std::size_t width) { return wrapped(plain(kOver), width); }},
      {"include", [](std::size_t width) { return wrapped(plain(kInclude), width); }},
      {"requirements", [](std::size_t width) { return witnesses_help(kRequirements, width); }},
      {"measures", [](std::size_t width) { return witnesses_help(kMeasures, width); }},
      {"predicate", [](std::size_t width) { return list_of("objectives", width); }},
      {"units", units_help}};
  return all;
}

/// A key and whose it is.
struct OwnedKey {
  std::string path;  // "gait.stance.length"
  std::string name;  // "stance.length"
  std::string owner, kind;
  Description description;
  Key key;
};

/// Channels of sensors and values of `physics` are no keys that anybody writes in a map.
std::vector<OwnedKey> all_keys() {
  std::vector<OwnedKey> out;
  for (const ComponentGroup& group : component_groups()) {
    if (group.topic == "sensors" || group.topic == "physics" || group.topic == "contact_models") continue;
    for (const Component& one : group.all) {
      for (const KeyRow& row : key_rows(one.text)) {
        out.push_back({one.name + "." + row.path, row.path, one.name, group.one, *row.description, *row.key});
      }
    }
  }
  return out;
}

std::string told(const std::string& title, const std::vector<OwnedKey>& keys, std::size_t width) {
  std::vector<KeyRow> rows;
  std::string owners;
  std::set<std::string> seen;
  for (const OwnedKey& key : keys) {
    rows.push_back({key.path, &key.description, &key.key});
    if (seen.insert(key.owner).second) owners += (owners.empty() ? "" : ", ") + key.owner;
  }
  return wrapped(title, width) + "\n\n" + keys_text(rows, width) + "\n" +
         wrapped(fmt::format("graze help NAME tells all keys of one of them: {}.", owners), width) + "\n";
}

/// What the map that it holds is called; empty: it holds none that has a name.
std::string section_of_key(const Key& key) {
  const auto at = std::find_if(key.forms.begin(), key.forms.end(),
                               [](const Form& form) { return form.kind == Form::Kind::section; });
  return at == key.forms.end() ? "" : at->what;
}

bool is_section(const Key& key) { return !section_of_key(key).empty(); }

std::vector<OwnedKey> matching(const std::function<bool(const OwnedKey&)>& test) {
  std::vector<OwnedKey> out;
  for (OwnedKey& key : all_keys()) {
    if (test(key)) out.push_back(std::move(key));
  }
  return out;
}

/// The first part of a path is what stands at the top of a scenario, or of a parameter's path.
bool begins_a_path(const std::string& topic) {
  const std::string first = topic.substr(0, topic.find('.'));
  const std::vector<std::string> top = keys_of("scenario");
  return first == "initial" || std::find(top.begin(), top.end(), first) != top.end();
}

/// On `robot.initial`, `sensor.encoder.JOINT.position`, `policies.walk.gait`: what one of the parts names, the last
/// that does.
std::optional<std::string> part_help(const std::string& topic, std::size_t width) {
  const bool channel = topic.starts_with("sensor.") || topic.starts_with("actuator.");
  if (!channel && !begins_a_path(topic)) return std::nullopt;
  for (const ComponentGroup& group : component_groups()) {
    if (group.topic != (channel ? "sensors" : group.topic)) continue;
    for (const Component& one : group.all) {
      const bool last = topic.ends_with("." + one.name);
      if (last || (channel && ("." + topic + ".").find("." + one.name + ".") != std::string::npos)) {
        return component_help(group, one, width);
      }
    }
  }
  return std::nullopt;
}

/// A path of kParameterPaths as a glob: "robot.link.*.{density,mass}".
std::string parameter_glob(const std::string& path) {
  constexpr std::string_view kRest = "…";
  std::string out;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool rest = std::string_view(path).substr(i).starts_with(kRest);
    if (rest) i += kRest.size() - 1;
    if (rest || (path[i] >= 'A' && path[i] <= 'Z')) {
      if (!out.ends_with('*')) out += '*';
    } else if (path[i] != ' ') {
      out += path[i];
    }
  }
  return out;
}

/// Those of all of them; what stands behind a ':' says how a path is used.
const std::vector<std::string>& parameter_globs() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> out;
    std::istringstream lines(kParameterPaths);
    for (std::string line; std::getline(lines, line);) {
      line = line.substr(0, line.find(':'));
      int braces = 0;
      std::size_t begin = 0;
      for (std::size_t i = 0; i <= line.size(); ++i) {
        if (i < line.size()) braces += line[i] == '{' ? 1 : line[i] == '}' ? -1 : 0;
        if (i < line.size() && (line[i] != ',' || braces > 0)) continue;
        out.push_back(parameter_glob(line.substr(begin, i - begin)));
        begin = i + 1;
      }
    }
    return out;
  }();
  return all;
}

/// Whether a parameter may have this path; a channel's has its own help.
bool is_parameter(const std::string& topic) {
  const std::vector<std::string>& globs = parameter_globs();
  return std::any_of(globs.begin(), globs.end(), [&](const std::string& glob) { return matches(glob, topic); });
}

}  // namespace

std::optional<std::string> map_help(const std::string& topic, std::size_t width) {
  for (const auto& [name, help] : maps()) {
    if (name == topic || topic == "task." + name) return help(width);
  }
  return std::nullopt;
}

std::optional<std::string> key_help(const std::string& topic, std::size_t width) {
  const std::string dotted = "." + topic;
  if (topic.find('.') == std::string::npos) {
    const auto named = matching([&](const OwnedKey& key) { return ("." + key.name).ends_with(dotted); });
    if (!named.empty()) return told(topic + ", a key of:", named, width);
    const auto valued = matching([&](const OwnedKey& key) {
      return std::any_of(key.key.forms.begin(), key.key.forms.end(), [&](const Form& form) {
        return form.kind == Form::Kind::word &&
               std::find(form.words.begin(), form.words.end(), topic) != form.words.end();
      });
    });
    if (!valued.empty()) return told(topic + ", a value of:", valued, width);
    return std::nullopt;
  }
  const auto by_path = matching([&](const OwnedKey& key) { return dotted.ends_with("." + key.path); });
  const auto keys = [&] { return told(topic + ", a key of " + by_path.front().owner + ":", by_path, width); };
  if (!by_path.empty() && !is_section(by_path.front().key)) return keys();
  if (!by_path.empty()) {
    if (const std::string section = section_help(section_of_key(by_path.front().key), width); !section.empty()) {
      return by_path.front().key.forms.size() == 1 ? section : keys() + "\n" + section;
    }
  }
  if (const auto part = part_help(topic, width)) return part;
  if (!by_path.empty()) return keys();
  if (is_parameter(topic)) {
    return wrapped(topic + ", as the path of a parameter:", width) + "\n\n" + uncertain_help(width);
  }
  const auto ending = matching([&](const OwnedKey& key) { return ("." + key.name).ends_with(dotted); });
  if (!ending.empty()) return told(topic + ", a key of:", ending, width);
  return std::nullopt;
}

std::vector<std::string> key_topics() {
  std::set<std::string> out;
  for (const OwnedKey& key : all_keys()) {
    out.insert(key.path);
    if (key.name.find('.') == std::string::npos) out.insert(key.name);
    for (const Form& form : key.key.forms) {
      if (form.kind == Form::Kind::word) out.insert(form.words.begin(), form.words.end());
    }
  }
  for (const auto& [name, help] : maps()) out.insert(name);
  return {out.begin(), out.end()};
}

}  // namespace graze
