#pragma once
// Other people's robots, dropped and held as data/scenarios/drop_and_stand.yaml does it, with repair and the stiffness
// and damping that graze new proposes: what is held too softly for its weight falls over, to one of many places.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "scenarios/proposal.h"
#include "scenarios/scenario.h"

namespace graze::bench {

namespace fs = std::filesystem;
using Overrides = std::vector<Override>;

/// What a command line asks for.
struct DropRequest {
  fs::path folder;
  std::vector<std::string> names;  // parts of file names; none: all
  std::uint32_t particles = 4;
  std::string model;  // contact model of lanes; "": the scenario's
  std::string keep;   // folder for results; "": none
  Overrides more;
};

inline DropRequest drop_request_of(int argc, char** argv) {
  DropRequest out;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i], value = i + 1 < argc ? argv[i + 1] : "";
    const bool option = word.starts_with("--");
    i += option;
    if (word == "--particles") out.particles = static_cast<std::uint32_t>(std::stoul(value));
    if (word == "--end") out.more.push_back({"time.end", value});
    if (word == "--model") out.model = value;
    if (word == "--keep") out.keep = value;
    if (word == "--set") out.more.push_back({value.substr(0, value.find('=')), value.substr(value.find('=') + 1)});
    if (option) continue;
    if (out.folder.empty()) {
      out.folder = word;
    } else {
      out.names.push_back(word);
    }
  }
  return out;
}

/// The URDFs below the folder whose paths contain one of the names, sorted.
inline std::vector<fs::path> robots_of(const DropRequest& request) {
  const auto wanted = [&](const fs::path& file) {
    const auto has = [&](const std::string& part) { return file.string().find(part) != std::string::npos; };
    return request.names.empty() || std::any_of(request.names.begin(), request.names.end(), has);
  };
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(request.folder)) {
    if (entry.path().extension() == ".urdf" && wanted(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The robot's drop under a back end and step, `way`. Throws InputError: the robot is refused.
inline Scenario drop_scenario(const DropRequest& request, const fs::path& urdf, const Overrides& way) {
  const std::string file = std::string(GRAZE_SOURCE_DIR) + "/data/scenarios/drop_and_stand.yaml";
  const HoldGains gains = propose_hold({urdf.string(), file, true, false});
  ScenarioOptions options;
  options.overrides = {{"robot.urdf", urdf.string()},
                       {"robot.repair", "true"},
                       {"policies.hold.control.joint_pd.kp", fmt::format("{:g}", gains.stiffness)},
                       {"policies.hold.control.joint_pd.kd", fmt::format("{:g}", gains.damping)}};
  for (const Overrides& some : {request.more, way}) {
    options.overrides.insert(options.overrides.end(), some.begin(), some.end());
  }
  return load_scenario(file, options);
}

/// Lanes or Bullet at a step.
inline Overrides way_of(const DropRequest& request, const std::string& physics, const std::string& step) {
  Overrides out = {{"physics", physics}, {"time.step", step}};
  if (physics == "lanes" && !request.model.empty()) out.push_back({"contact.model", request.model});
  return out;
}

}  // namespace graze::bench
