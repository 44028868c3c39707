// Where other people's robots come to rest: every URDF below a folder, dropped and held as
// data/scenarios/drop_and_stand.yaml does it, with repair and the stiffness and damping that graze new proposes: what
// is held too softly for its weight falls over, to one of many places. On lanes at 1 ms and 0.1 ms and on Bullet at 0.1
// ms, the same particles. The table of docs/robots.md.
//   bench_robots FOLDER [PART OF A NAME …] [--particles N] [--end TIME] [--model CONTACT_MODEL] [--set PATH=VALUE]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "scenarios/proposal.h"
#include "scenarios/scenario.h"
#include "simulation/simulation.h"

namespace graze {
namespace {

namespace fs = std::filesystem;
using Overrides = std::vector<Override>;

const std::string kScenario = std::string(GRAZE_SOURCE_DIR) + "/data/scenarios/drop_and_stand.yaml";

struct Request {
  fs::path folder;
  std::vector<std::string> names;  // parts of file names; none: all
  std::uint32_t particles = 4;
  std::string model;  // of lanes
  Overrides more;
};

/// What became of some particles of one robot in one way.
struct Rests {
  int invalid = 0, rested = 0;
  std::vector<TraceRecord> traces;
  std::string reason;  // why the first of the invalid ones is
};

Scenario scenario_of(const Request& request, const fs::path& urdf, const Overrides& way) {
  ScenarioOptions options;
  const HoldGains gains = propose_hold({urdf.string(), kScenario, true, false});
  options.overrides = {{"robot.urdf", urdf.string()},
                       {"robot.repair", "true"},
                       {"policies.hold.control.joint_pd.kp", fmt::format("{:g}", gains.stiffness)},
                       {"policies.hold.control.joint_pd.kd", fmt::format("{:g}", gains.damping)}};
  for (const Overrides& some : {request.more, way}) {
    options.overrides.insert(options.overrides.end(), some.begin(), some.end());
  }
  return load_scenario(kScenario, options);
}

Rests run(const Request& request, const fs::path& urdf, const Overrides& way) {
  const Simulation simulation(scenario_of(request, urdf, way), request.particles);
  Rests out;
  out.traces = Simulator(simulation, "hold").run(0, request.particles);
  for (const TraceRecord& trace : out.traces) {
    out.rested += trace.outcome == Outcome::success;
    if (trace.outcome != Outcome::invalid) continue;
    if (out.invalid++ == 0) out.reason = trace.invalid_reason;
  }
  return out;
}

/// Largest difference of where two ways leave the same particles: of the base's height, m, or of any joint of a robot
/// that stands on the world, rad or m.
double difference(const Rests& a, const Rests& b, bool floats) {
  double most = 0;
  for (std::size_t i = 0; i < a.traces.size(); ++i) {
    if (a.traces[i].outcome == Outcome::invalid || b.traces[i].outcome == Outcome::invalid) continue;
    for (std::size_t k = floats ? 6 : 0; k < (floats ? 7 : a.traces[i].q.size()); ++k) {
      most = std::max(most, std::abs(a.traces[i].q[k] - b.traces[i].q[k]));
    }
  }
  return most;
}

std::string height(const Rests& rests, bool floats) {
  return floats ? fmt::format("{:.4f}", rests.traces.front().q[6]) : "fixed";
}

void compare(const Request& request, const fs::path& urdf) {
  const std::string name = fs::relative(urdf, request.folder).string();
  std::vector<Rests> all;
  bool floats = true;
  try {
    Overrides lanes = {{"physics", "lanes"}};
    if (!request.model.empty()) lanes.push_back({"contact.model", request.model});
    Overrides fine = lanes;
    fine.push_back({"time.step", "0.1 ms"});
    floats = scenario_of(request, urdf, {}).model.floating_base;
    for (const Overrides& way : {lanes, fine, Overrides{{"physics", "bullet"}, {"time.step", "0.1 ms"}}}) {
      all.push_back(run(request, urdf, way));
    }
  } catch (const InputError& error) {
    const std::string text = error.what();
    fmt::print("{:44} refused: {}\n", name, text.substr(0, text.find('\n')));
    return;
  }
  const auto counts = [&](int Rests::*count) {
    return fmt::format("{}/{}/{}", all[0].*count, all[1].*count, all[2].*count);
  };
  fmt::print("{:44} {:8} {:8} {:>8} {:>8} {:>8} {:>8.2f} {:>8.2f}\n", name, counts(&Rests::invalid),
             counts(&Rests::rested), height(all[0], floats), height(all[1], floats), height(all[2], floats),
             1000 * difference(all[0], all[2], floats), 1000 * difference(all[1], all[2], floats));
  for (const Rests& rests : all) {
    if (rests.invalid > 0) fmt::print("  {}\n", rests.reason);
  }
  std::fflush(stdout);
}

bool wanted(const Request& request, const fs::path& file) {
  const auto has = [&](const std::string& part) { return file.string().find(part) != std::string::npos; };
  return request.names.empty() || std::any_of(request.names.begin(), request.names.end(), has);
}

Request request_of(int argc, char** argv) {
  Request out;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i], value = i + 1 < argc ? argv[i + 1] : "";
    const bool option = word.starts_with("--");
    i += option;
    if (word == "--particles") out.particles = static_cast<std::uint32_t>(std::stoul(value));
    if (word == "--end") out.more.push_back({"time.end", value});
    if (word == "--model") out.model = value;
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

int compare_all(const Request& request) {
  if (request.folder.empty()) {
    fmt::print(
        "usage: bench_robots FOLDER [PART OF A NAME …] [--particles N] [--end TIME] [--model CONTACT_MODEL] "
        "[--set PATH=VALUE]\n");
    return 2;
  }
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(request.folder)) {
    if (entry.path().extension() == ".urdf" && wanted(request, entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  fmt::print(
      "lanes 1 ms / lanes 0.1 ms / bullet 0.1 ms, {} particles each; differences from bullet: the largest, of the "
      "base's height in mm, of a fixed robot's joints in mrad\n",
      request.particles);
  fmt::print("{:44} {:8} {:8} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "robot", "invalid", "rested", "lanes, m", "fine",
             "bullet", "off", "fine off");
  for (const fs::path& file : files) compare(request, file);
  return 0;
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) { return graze::compare_all(graze::request_of(argc, argv)); }
