// Agreement with the limit: other people's robots, dropped and held (bench/dropped_robots.h), on lanes at 1 ms, on
// lanes and on Bullet at a tenth of it, and on Bullet at 1 ms, the same particles. Tells height of the base in the end,
// its scatter, the share that came to rest, what it cost, and whether the ways agree. The table of docs/physics.md.
//   bench_agreement FOLDER [PART OF A NAME …] [--particles N] [--end TIME] [--keep FOLDER] [--set PATH=VALUE]
// --keep: what was simulated is written there and not simulated again; each robot takes minutes.
//
// All differences are of the same particles, b from a: paired differences of height (Student), ratio of the scatters
// (tests/paired_numbers.h), paired difference of the shares of success (Newcombe 1998). The intervals of all robots and
// comparisons hold together with 95 % (Bonferroni).

#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <optional>

#include "analysis/proportions.h"
#include "bench/dropped_robots.h"
#include "simulation/simulation.h"
#include "tests/paired_numbers.h"

namespace graze {
namespace {

using namespace bench;

struct Way {
  const char *name, *physics, *step;
};
constexpr Way kWays[] = {{"lanes 1 ms", "lanes", "1 ms"},
                         {"lanes 0.1 ms", "lanes", "0.1 ms"},
                         {"bullet 0.1 ms", "bullet", "0.1 ms"},
                         {"bullet 1 ms", "bullet", "1 ms"}};
constexpr int kCompared[][2] = {{0, 1}, {0, 2}, {1, 2}, {3, 2}};  // of kWays
constexpr int kQuantities = 3;                                    // mean, scatter, share

/// One particle's end.
struct End {
  double height = 0;  // m, of the base
  Outcome outcome = Outcome::invalid;
  double steps = 0, unconverged = 0, change = 0;  // of the contact solver: change, m/s, is the largest last one
};

/// What one way made of a robot's particles.
struct Ends {
  double processor = 0;  // seconds per simulated second of one particle
  std::vector<End> ends;

  template <class Value>
  double sum(const Value& value) const {
    double out = 0;
    for (const End& end : ends) out += value(end);
    return out;
  }
};

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Ends simulate(const DropRequest& request, const fs::path& urdf, const Way& way) {
  const Simulation simulation(drop_scenario(request, urdf, way_of(request, way.physics, way.step)), request.particles);
  Simulator simulator(simulation, "hold");
  Ends out;
  const double before = processor_seconds();
  double simulated = 0;
  for (const TraceRecord& trace : simulator.run(0, request.particles)) {
    simulated += trace.end_time;
    out.ends.push_back({trace.q.at(6), trace.outcome, trace.solver.steps, trace.solver.unconverged_steps,
                        trace.solver.largest_residual});
  }
  out.processor = (processor_seconds() - before) / simulated;
  return out;
}

/// The file that keeps them; its first line says of what.
struct Keeper {
  fs::path file;
  std::string head;

  Keeper(const DropRequest& request, const fs::path& urdf, const Way& way) {
    if (request.keep.empty()) return;
    std::string name = fs::relative(urdf, request.folder).string() + "." + way.name + ".txt";
    std::replace_if(
        name.begin(), name.end(), [](char c) { return c == '/' || c == ' '; }, '_');
    file = fs::path(request.keep) / name;
    head = fmt::format("{} particles", request.particles);
    for (const Override& one : request.more) head += fmt::format(" {}={}", one.path, one.value);
  }
  std::optional<Ends> read() const {
    std::ifstream in(file);
    std::string line;
    Ends out;
    if (file.empty() || !std::getline(in, line) || line != head || !(in >> out.processor)) return {};
    End end;
    int outcome = 0;
    while (in >> end.height >> outcome >> end.steps >> end.unconverged >> end.change) {
      end.outcome = static_cast<Outcome>(outcome);
      out.ends.push_back(end);
    }
    return out;
  }
  void write(const Ends& ends) const {
    if (file.empty()) return;
    fs::create_directories(file.parent_path());
    std::ofstream out(file);
    out << head << "\n" << fmt::format("{}\n", ends.processor);
    for (const End& end : ends.ends) {
      out << fmt::format("{} {} {} {} {}\n", end.height, static_cast<int>(end.outcome), end.steps, end.unconverged,
                         end.change);
    }
  }
};

/// Heights and outcomes of the particles that are valid in both.
struct Pairs {
  std::vector<double> a, b;
  PairedTable shares;

  Pairs(const Ends& one, const Ends& other) {
    for (std::size_t i = 0; i < one.ends.size(); ++i) {
      const End &x = one.ends[i], &y = other.ends[i];
      if (x.outcome == Outcome::invalid || y.outcome == Outcome::invalid) continue;
      a.push_back(x.height), b.push_back(y.height);
      const bool s = x.outcome == Outcome::success, t = y.outcome == Outcome::success;
      ++(s ? (t ? shares.both : shares.only_a) : (t ? shares.only_b : shares.neither));
    }
  }
};

/// "equal": 0 lies in the interval; "within": all of it within `bound`; else "apart".
const char* verdict(bool equal, bool within) { return equal ? "equal" : within ? "within" : "apart"; }

constexpr double kHeightBound = 2e-3;  // m: what a resting height may be off
constexpr double kNoScatter = 1e-4;    // m: scatters below that are compared no further than this

void print_way(const Way& way, const Ends& ends) {
  std::vector<double> heights;
  std::uint64_t rested = 0;
  for (const End& end : ends.ends) {
    if (end.outcome == Outcome::invalid) continue;
    heights.push_back(end.height);
    rested += end.outcome == Outcome::success;
  }
  const Estimate mean = mean_of(heights, 0.95), scatter = scatter_of(heights, 0.95);
  const Interval share = clopper_pearson(rested, heights.size());
  const double steps = ends.sum([](const End& end) { return end.steps; });
  const double unconverged = ends.sum([](const End& end) { return end.unconverged; });
  double change = 0;
  for (const End& end : ends.ends) change = std::max(change, end.change);
  fmt::print("  {:14} mean {:9.2f} mm ({:.2f} .. {:.2f})  scatter {:7.2f} mm ({:.2f} .. {:.2f})  rested {:3}/{} ",
             way.name, 1e3 * mean.value, 1e3 * mean.low, 1e3 * mean.high, 1e3 * scatter.value, 1e3 * scatter.low,
             1e3 * scatter.high, rested, heights.size());
  fmt::print("({:.3f} .. {:.3f})  invalid {}  ", share.low, share.high, ends.ends.size() - heights.size());
  if (steps > 0) fmt::print("unconverged {:.4f} % (by {:.2g} m/s)  ", 100 * unconverged / steps, change);
  fmt::print("{:.4g} s/s\n", ends.processor);
}

void print_comparison(const Way& a, const Way& b, const Pairs& pairs, double confidence) {
  const Estimate mean = difference_of_means(pairs.a, pairs.b, confidence);
  const Estimate ratio = ratio_of_scatters(pairs.a, pairs.b, confidence);
  const bool still = std::max(scatter_of(pairs.a), scatter_of(pairs.b)) < kNoScatter;
  const double share = -paired_difference(pairs.shares);  // theirs is b from a
  const Interval shares = newcombe_paired(pairs.shares, confidence);
  fmt::print("    {:13} - {:13} mean {:+8.3f} mm ({:+.3f} .. {:+.3f}) {:6}", a.name, b.name, 1e3 * mean.value,
             1e3 * mean.low, 1e3 * mean.high, verdict(mean.holds(0), mean.within(-kHeightBound, kHeightBound)));
  fmt::print("  scatter x {:6.3f} ({:.3f} .. {:.3f}) {:6}", ratio.value, ratio.low, ratio.high,
             verdict(ratio.holds(1), still));
  fmt::print("  rested {:+.3f} ({:+.3f} .. {:+.3f}) {}\n", share, -shares.high, -shares.low,
             verdict(shares.low <= 0 && shares.high >= 0, false));
}

void compare(const DropRequest& request, const fs::path& urdf, double confidence) {
  fmt::print("{}\n", fs::relative(urdf, request.folder).string());
  std::vector<Ends> all;
  try {
    if (!drop_scenario(request, urdf, {}).model.floating_base) {
      fmt::print("  fixed to the world\n");
      return;
    }
    for (const Way& way : kWays) {
      const Keeper keeper(request, urdf, way);
      std::optional<Ends> ends = keeper.read();
      if (!ends) keeper.write(*(ends = simulate(request, urdf, way)));
      print_way(way, *ends);
      std::fflush(stdout);
      all.push_back(*ends);
    }
  } catch (const InputError& error) {
    const std::string text = error.what();
    fmt::print("  refused: {}\n", text.substr(0, text.find('\n')));
    return;
  }
  for (const auto& [a, b] : kCompared) print_comparison(kWays[a], kWays[b], {all[a], all[b]}, confidence);
}

int compare_all(const DropRequest& request) {
  if (request.folder.empty()) {
    fmt::print(
        "usage: bench_agreement FOLDER [PART OF A NAME …] [--particles N] [--end TIME] [--keep FOLDER] "
        "[--set PATH=VALUE]\n");
    return 2;
  }
  const std::vector<fs::path> files = robots_of(request);
  const double intervals = static_cast<double>(files.size() * std::size(kCompared) * kQuantities);
  const double confidence = 1 - 0.05 / intervals;
  fmt::print("{} particles; 95 % intervals of each way; differences with {:.4f} % each: all hold with 95 %\n",
             request.particles, 100 * confidence);
  for (const fs::path& file : files) compare(request, file, confidence);
  return 0;
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) { return graze::compare_all(graze::bench::drop_request_of(argc, argv)); }
