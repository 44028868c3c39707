// Where other people's robots come to rest: every URDF below a folder, dropped and held (bench/dropped_robots.h), on
// lanes at 1 ms and 0.1 ms and on Bullet at 0.1 ms, the same particles. The table of docs/robots.md.
//   bench_robots FOLDER [PART OF A NAME …] [--particles N] [--end TIME] [--model CONTACT_MODEL] [--set PATH=VALUE]
#include <cmath>
#include <cstdio>

#include "bench/dropped_robots.h"
#include "simulation/simulation.h"

namespace graze {
namespace {

using namespace bench;

/// What became of some particles of one robot in one way.
struct Rests {
  int invalid = 0, rested = 0;
  std::vector<TraceRecord> traces;
  std::string reason;  // why the first of the invalid ones is
};

Rests run(const DropRequest& request, const fs::path& urdf, const Overrides& way) {
  const Simulation simulation(drop_scenario(request, urdf, way), request.particles);
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

void compare(const DropRequest& request, const fs::path& urdf) {
  const std::string name = fs::relative(urdf, request.folder).string();
  std::vector<Rests> all;
  bool floats = true;
  try {
    floats = drop_scenario(request, urdf, {}).model.floating_base;
    for (const auto& [physics, step] : {std::pair{"lanes", "1 ms"}, {"lanes", "0.1 ms"}, {"bullet", "0.1 ms"}}) {
      all.push_back(run(request, urdf, way_of(request, physics, step)));
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

int compare_all(const DropRequest& request) {
  if (request.folder.empty()) {
    fmt::print(
        "usage: bench_robots FOLDER [PART OF A NAME …] [--particles N] [--end TIME] [--model CONTACT_MODEL] "
        "[--set PATH=VALUE]\n");
    return 2;
  }
  fmt::print(
      "lanes 1 ms / lanes 0.1 ms / bullet 0.1 ms, {} particles each; differences from bullet: the largest, of the "
      "base's height in mm, of a fixed robot's joints in mrad\n",
      request.particles);
  fmt::print("{:44} {:8} {:8} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "robot", "invalid", "rested", "lanes, m", "fine",
             "bullet", "off", "fine off");
  for (const fs::path& file : robots_of(request)) compare(request, file);
  return 0;
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) { return graze::compare_all(graze::bench::drop_request_of(argc, argv)); }
