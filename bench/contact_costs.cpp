// Figure 61: what a control step of inverse dynamics costs, by how contact forces are predicted and by the number of
// contacts. LINKS stands and sways a little, so that all feet keep touching; as published, each foot's contact is there
// several times: the ground is so many planes in one place, and a foot counts on as many of them as the number asks
// for.
//
//   bench_contact_costs [SECONDS] [ROBOTS]    prints a table: processor time for each cell (2 s), robots in a block (8)
//
// Times are of the thread and of all of the tracker's work (kinematics, masses, contacts, torques).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/lanes/clock.h"
#include "engine/control/policy.h"
#include "engine/lanes/isa.h"
#include "scenarios/scenario.h"

namespace graze {
namespace {

constexpr const char* kScenario = GRAZE_SOURCE_DIR "/data/scenarios/quadruped_waypoints.yaml";
constexpr const char* kFeet[] = {"LF", "RF", "LH", "RH"};
constexpr int kContacts[] = {1, 2, 4, 10, 20, 30, 40};
constexpr int kSettling = 20, kMostSteps = 2000;  // control steps

struct Solver {
  const char* name;
  const char* keys;  // of the tracker
};
constexpr Solver kSolvers[] = {
    {"qp_coulomb, two stages", "model: qp_coulomb"},
    {"qp_coulomb, one stage", "model: qp_coulomb, regularization: 1e-3"},
    {"qp_no_slip", "model: qp_no_slip, regularization: 1e-3"},
    {"lcp_no_slip", "model: lcp_no_slip, regularization: 1e-3"},
    {"lcp_coulomb", "model: lcp_coulomb"},
    {"none", "model: none"},
};

/// LINKS on so many planes that its feet have `contacts` in all, one after the other.
Scenario standing(const Solver& solver, int contacts) {
  const int planes = (contacts + 3) / 4;
  std::string ground, ignored = R"(["BODY0", "plane*"])";
  for (int k = 0; k < planes; ++k) {
    ground += fmt::format("{}plane{}: {{plane: z}}", k > 0 ? ", " : "", k);
    for (int foot = contacts - 4 * k; foot < 4; ++foot) {
      ignored += fmt::format(R"(, ["{}_*", "plane{}"])", kFeet[foot], k);
    }
  }
  ScenarioOptions options;
  options.overrides = {
      {"task.requirements.body-free", "~"},
      {"environment", fmt::format("{{{}}}", ground)},
      {"contact", fmt::format("{{friction: 0.8, self_collision: false, ignore: [{}]}}", ignored)},
      {"policies",
       fmt::format("{{stand: {{hold: {{}}, control: {{inverse_dynamics: {{kp: 5e3, kd: 100, {}, servo: {{kp: "
                   "10, kd: 0.1}}}}}}}}}}",
                   solver.keys)}};
  return load_scenario(kScenario, options);
}

/// What is sensed at a step: robots that sway by a millimetre, each at a time of its own.
void sense(const State& initial, const Model& model, int step, double period, Observation& out) {
  constexpr double kTurn = 2 * M_PI * 2;  // 2 Hz, rad/s
  for (int lane = 0; lane < kLanes; ++lane) {
    const double time = step * period, angle = kTurn * time + lane;
    out.time[lane] = time;
    for (int k = 0; k < model.na(); ++k) {
      const Body& body = model.bodies[model.actuated[k]];
      out.joint_position(k, lane) = initial.q[body.q] + 3e-3 * std::sin(angle + k);
      out.joint_velocity(k, lane) = 3e-3 * kTurn * std::cos(angle + k);
    }
    for (int k = 0; k < 3; ++k) {
      out.base_position(k, lane) = initial.q[4 + k] + 5e-4 * std::sin(angle + 2 * k);
      out.base_velocity(k, lane) = 5e-4 * kTurn * std::cos(angle + 2 * k);
      out.base_rpy(k, lane) = 2e-3 * std::sin(angle + 1 + 2 * k);
      out.base_rate(k, lane) = 2e-3 * kTurn * std::cos(angle + 1 + 2 * k);
    }
  }
}

/// Median and 99th percentile, us per robot and control step.
struct Cost {
  double median, high;
};

Cost cost_of(const Solver& solver, int contacts, double seconds, int robots) {
  const Scenario scenario = standing(solver, contacts);
  const State initial = initial_state(*scenario.world, scenario.model);
  const double period = scenario.timing.control;
  Controller controller(ControlContext{scenario.model, initial, period}, scenario.policies.front().settings);
  Observation observation;
  const int na = scenario.model.na();
  observation.joint_position = observation.joint_velocity = BlockArray(na);
  observation.base_position = observation.base_velocity = observation.base_rpy = observation.base_rate = BlockArray(3);
  observation.link_force = BlockArray(static_cast<int>(scenario.model.frames.size()));
  ActuatorCommand command(na);
  for (int lane = 0; lane < kLanes; ++lane) controller.start(lane, 0, 0);
  const double jitter[kLanes] = {};
  std::vector<double> took;
  double total = 0;
  for (int step = 0; step < kMostSteps && (step == 0 || total < seconds); ++step) {
    sense(initial, scenario.model, step, period, observation);
    const double begin = bench::now();
    controller.act(observation, jitter, LaneMask::first(robots), command);
    took.push_back(1e6 / robots * (bench::now() - begin));
    total += robots * 1e-6 * took.back();
  }
  if (took.size() > 2 * kSettling) took.erase(took.begin(), took.begin() + kSettling);
  std::sort(took.begin(), took.end());
  return {took[took.size() / 2], took[took.size() * 99 / 100]};
}

void print_table(double seconds, int robots) {
  fmt::print("us per robot and control step, median (99th percentile), {} in a block, {}\n\n| contacts |", robots,
             isa_name(chosen_isa()));
  for (const int contacts : kContacts) fmt::print(" {} |", contacts);
  fmt::print("\n|---|");
  for (std::size_t i = 0; i < std::size(kContacts); ++i) fmt::print("---|");
  fmt::print("\n");
  for (const Solver& solver : kSolvers) {
    fmt::print("| {} |", solver.name);
    for (const int contacts : kContacts) {
      const Cost cost = cost_of(solver, contacts, seconds, robots);
      fmt::print(" {:.3g} ({:.3g}) |", cost.median, cost.high);
      std::fflush(stdout);
    }
    fmt::print("\n");
  }
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  const int robots = argc > 2 ? std::clamp(std::atoi(argv[2]), 1, graze::kLanes) : graze::kLanes;
  graze::print_table(argc > 1 ? std::atof(argv[1]) : 2, robots);
}
