// What a Jacobian of the redesign (Chapter 5) costs beside a plain evaluation of the trajectory: the 3-D-printed
// quadruped of Chapter 6 with 19 design variables, one thread, processor time, least of some rounds.
//
//   build/release/bench_redesign [ROUNDS]

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <functional>

#include "jobs/campaign/design_trials.h"

namespace {

using namespace graze;

double processor_time() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// ms
double least_time(int rounds, const std::function<void()>& what) {
  double least = 1e9;
  for (int i = 0; i < rounds; ++i) {
    const double begin = processor_time();
    what();
    least = std::min(least, processor_time() - begin);
  }
  return 1e3 * least;
}

/// Every variable a step to either side.
std::vector<DesignValues> both_sides(const DesignRobots& robots) {
  std::vector<DesignValues> out;
  for (std::size_t i = 0; i < robots.block().variables.size(); ++i) {
    for (const double sign : {1.0, -1.0}) {
      out.push_back(robots.initial());
      out.back()[i] += sign * robots.block().variables[i].step;
    }
  }
  return out;
}

double largest_difference(const std::vector<DesignMargins>& a, const std::vector<DesignMargins>& b) {
  double most = 0;
  for (std::size_t d = 0; d < a.size(); ++d) {
    for (std::size_t k = 0; k < a[d].margins.size(); ++k) {
      most = std::max(most, std::abs(a[d].margins[k] - b[d].margins[k]));
    }
  }
  return most;
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::atoi(argv[1]) : 5;
  if (rounds < 1 || argc > 2) {
    fmt::print(stderr, "usage: bench_redesign [ROUNDS], one or more\n");
    return 2;
  }
  const Scenario scenario =
      load_scenario(std::string(GRAZE_SOURCE_DIR) + "/data/scenarios/quadruped_design.yaml",
                    {.overrides = {{"design.variables.base_height", "{of: robot.link.BASE.size.z, factor: [0.5, 2]}"},
                                   {"design.variables.base_mass", "{of: robot.link.BASE.mass, factor: [0.5, 2]}"},
                                   {"design.variables.knees", "{of: 'robot.joint.?F_Y_3.effort', factor: [0.5, 2]}"}}});
  if (!scenario.redesign) {
    fmt::print("{}\n", scenario.redesign_problem);
    return 1;
  }
  const DesignRobots robots(scenario);
  TrialQuestion question;
  question.policy = scenario.policies.front().name;
  const DesignValues centre = robots.initial();
  const std::vector<DesignValues> beside = both_sides(robots);
  const double plain = least_time(3 * rounds, [&] { try_designs(robots, {centre}, question); });
  const double read = least_time(3 * rounds, [&] { robots.make(question.level, {centre}); });
  std::vector<DesignMargins> alone, shared;
  const double each_alone = least_time(1, [&] { alone = try_designs(robots, beside, question); });
  const double together = least_time(rounds, [&] { shared = try_beside(robots, centre, beside, question); });
  fmt::print("{} variables, {} designs beside, {} s of trace\n", robots.block().variables.size(), beside.size(),
             scenario.timing.end);
  fmt::print("a plain evaluation           {:8.2f} ms, of which reading the design {:.2f} ms\n", plain, read);
  fmt::print("a Jacobian, designs alone    {:8.2f} ms, {:.2f} plain evaluations\n", each_alone, each_alone / plain);
  fmt::print("a Jacobian, in shared blocks {:8.2f} ms, {:.2f} plain evaluations\n", together, together / plain);
  fmt::print("largest difference between their margins: {:.2g}\n", largest_difference(alone, shared));
}
