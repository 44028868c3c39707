#pragma once
// A scenario with another design of its robot. Each design is read as the scenario that `graze improve` would write of
// it: its controller plans with the new robot, as Algorithm 2 has it, and what is uncertain is uncertain about the new
// numbers.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scenarios/design_block.h"
#include "scenarios/scenario.h"

namespace graze {

/// A value per variable of DesignBlock, SI.
using DesignValues = std::vector<double>;

/// Scenarios of some designs, usable while this is alive. One at a time, and no InputReplay beside it.
struct MadeDesigns {
  std::unique_ptr<InputReplay> inputs;
  std::vector<std::optional<Scenario>> scenarios;  // per design; none: it cannot be made
  std::vector<std::string> problems;               // per design: why not
};

/// Whether an input is neither a scenario, whose text tells it apart, nor a variable of the environment: a robot, a
/// mesh, a controller, a table.
bool is_part_of_robot(const std::string& name);

class DesignRobots {
 public:
  /// `scenario` has a DesignBlock and outlives this; its seed and its number of particles are those of all designs.
  /// Throws InputError if a task value is none that the scenario can have.
  explicit DesignRobots(const Scenario& scenario);

  const Scenario& scenario() const { return scenario_; }
  const DesignBlock& block() const { return *scenario_.redesign; }
  std::size_t levels() const { return worlds_.size(); }
  /// The scenario's own robot.
  DesignValues initial() const;

  /// Of the scenario at a level's task, besides those that the scenario itself has.
  const std::vector<std::string>& warnings(std::size_t level) const { return warnings_[level]; }

  /// SHA-256 over what is_part_of_robot(), at any level.
  std::string files_sha256() const;

  MadeDesigns make(std::size_t level, const std::vector<DesignValues>& designs) const;
  /// Variables of the robot whose number every particle draws for itself, whatever the design's is: "damping:
  /// robot.joint.hinge.damping is uniform(0.002, 0.02)".
  std::vector<std::string> overdrawn() const;
  /// The nominal robots of designs beside one (`centre`), whose scenario make() has made: what fabrication makes of the
  /// centre's robot. No file is written or read, which is nine tenths of what a design costs otherwise; the numbers are
  /// those of make() up to rounding. None: the design differs in what is no matter of fabrication, or cannot be made.
  std::vector<std::optional<Particle>> beside(const Scenario& made, const DesignValues& centre,
                                              const std::vector<DesignValues>& designs) const;
  /// The robot as URDF; empty: no variable is about the robot. Throws InputError if it cannot be made.
  std::string urdf(std::size_t level, const DesignValues& design) const;
  /// A scenario file of this design: what it includes, and what is other. `urdf`: the name of the robot's file; empty:
  /// the scenario's own.
  std::string yaml(std::size_t level, const DesignValues& design, const std::string& urdf) const;
  /// The same of the scenario's own robot.
  std::string before(std::size_t level) const;

 private:
  void read_level(std::size_t level);
  World world_of(std::size_t level, const DesignValues& design) const;
  std::vector<Override> overrides(std::size_t level, const DesignValues& design) const;
  std::string yaml_of(std::vector<Override> overrides) const;
  ScenarioSource source_at(std::size_t level) const;
  bool has_robot_variables() const { return !paths_.empty(); }

  const Scenario& scenario_;
  std::vector<std::string> paths_;                    // of the robot that variables move
  std::vector<std::shared_ptr<const World>> worlds_;  // per level
  std::vector<std::vector<std::string>> warnings_;    // per level
  InputFiles files_;                                  // that the scenario was read from, at any level
};

}  // namespace graze
