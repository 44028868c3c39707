#include "jobs/machine/process_trial.h"

#include <sys/resource.h>

#include <filesystem>
#include <stdexcept>

#include "archive/hdf5/reading_child.h"
#include "jobs/workers/worker_channel.h"
#include "jobs/workers/worker_process.h"
#include "scenarios/scenario.h"

namespace graze {
namespace {

constexpr const char* kScenario = R"(graze: 1
robot: {urdf: weight.urdf}
environment: {ground: {plane: z}}
time: {end: 1 ms, step: 1 ms, control: 1 ms}
policies: {still: {hold: {}, control: {torque: {}}}}
task: {objective: {there: {height: {link: weight, above: -1}}}}
)";
constexpr const char* kRobot = R"(<robot name="weight"><link name="weight">
  <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>)";

/// Whether limits can be set at all: a sandbox may forbid the call.
void check_limits() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || setrlimit(RLIMIT_AS, &limit) != 0) {
    throw std::runtime_error("its memory cannot be limited");
  }
}

Finding reading_finding() {
  Finding out{"processes", "reading child", Health::good, "works: verbs that read archives are safe from forged ones"};
  if (may_not_fork()) {
    return {"processes", "reading child", Health::note, "not used under a debugger: archives are read in one process"};
  }
  try {
    const auto failed = unreadable({"/dev/null"}, [](const std::filesystem::path&) { check_limits(); });
    if (failed.empty()) return out;
    out.text = failed.front().why;
  } catch (const std::runtime_error& error) {
    out.text = error.what();
  }
  out.health = Health::broken;
  out.advice = "score, report and all verbs that read archives need it: allow processes (ulimit -u, the container)";
  return out;
}

Finding worker_finding() {
  try {
    ScenarioSource source;
    source.file = "/graze/doctor.yaml";
    source.folder = "/graze";
    source.inputs = {{source.file, kScenario}, {"/graze/weight.urdf", kRobot}};
    const InputReplay files(source.inputs, source.folder);
    const Scenario scenario = reload_scenario(source);
    constexpr double kPatience = 10;  // s
    const WorkerProcess worker(WorkerBriefing{source, scenario_kind(scenario), {}, 1, 1, 0}.to_text(),
                               WorkerPatience{kPatience, kPatience});
    return {"processes", "worker", Health::good, "works: controllers of your own run apart"};
  } catch (const std::runtime_error& error) {
    return {"processes", "worker", Health::note, error.what(),
            "controllers of your own (policy library) need it, or isolation: none; nothing else does"};
  }
}

}  // namespace

std::vector<Finding> process_findings() { return {reading_finding(), worker_finding()}; }

}  // namespace graze
