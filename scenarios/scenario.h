#pragma once
// One YAML file -> one typed, validated Scenario. Everything that can be refused is refused here, with
// file:line:column, before anything is simulated.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/contact_record.h"
#include "engine/control/policy.h"
#include "engine/model/fabrication.h"
#include "engine/settings/settings.h"
#include "sampling/design.h"
#include "scenarios/source.h"
#include "scenarios/task.h"

namespace graze {

struct DesignBlock;

/// The most particles of a campaign: their ids are 32 bits.
inline constexpr std::uint64_t kParticleLimit = 0xffffffff;

struct Timing {
  double end = 1.0;        // s
  double step = 0.001;     // s, physics
  double control = 0.001;  // s, a whole multiple of step
  int steps() const;       // physics steps of a whole trace
  int steps_per_control() const;
};

/// One policy after `over` has been expanded: "step/1cm" with the settings that make its Controller.
struct PolicySpec {
  std::string name;
  Settings settings;
  unsigned reads = 0;  // SensedGroup: what its controller looks at
};

/// Which frames are kept: of no traces, of failures, of failures the last seconds before it, or of all.
enum class Telemetry { none, failures, last, all };

struct Recording {
  Telemetry telemetry = Telemetry::none;
  int every = 10;      // physics steps between frames
  double last = 0.5;   // s, with Telemetry::last
  bool phases = true;  // contact phases
  PhaseRules rules = {};
  bool events = false;  // every touch, lift-off, change of mode and joint limit
};

struct Scenario {
  std::string name, description;
  std::string file;  // as given
  ScenarioSource source;
  std::string text;                    // resolved YAML: includes merged, overrides applied
  std::string sha256;                  // of text
  std::shared_ptr<const World> world;  // p0
  Model model;                         // compiled p0
  std::string physics = "lanes";
  std::string controller_urdf;  // that controllers from outside are given; empty: that of the files
  Timing timing;
  ParameterSpace space;  // all uncertain parameters
  Design design = Design::random;
  std::uint64_t seed = 1;
  std::uint64_t particles = 100;  // default of -n
  std::vector<PolicySpec> policies;
  Task task;
  Recording recording;
  double unconverged = kUnconvergedShare;       // share of steps, above which a trace is flagged
  bool torque_speed = false;                    // actuators follow the torque-speed line
  std::shared_ptr<const DesignBlock> redesign;  // `design`; null: there is none, or it has a problem
  std::string redesign_problem;                 // what is wrong with `design`, for the verbs that heed it
  std::vector<std::string>
      warnings;  // what was left out (visual meshes, …), what looks wrong (units, empty windows, …)
};

/// Reads and checks a scenario: robot, environment, timing, every path of `uncertain`, every policy (its controller is
/// built once) and the task. Throws InputError.
Scenario load_scenario(const std::string& file, const ScenarioOptions& options = {});
Scenario parse_scenario(const std::string& text, const std::string& name, const ScenarioOptions& options = {});

/// The scenario as it was when `source` was recorded. An InputReplay of the source's files must be alive as long as the
/// scenario is used, because policies read their tables anew.
Scenario reload_scenario(const ScenarioSource& source);

/// The jitter of the channels and of control.lag, taken from the space.
SensorNoise sensor_noise(const Scenario& scenario, std::uint64_t seed);

}  // namespace graze
