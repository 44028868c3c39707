#pragma once
// One robot that is driven while it is simulated (§9.4): commands and gaits are given from control step to control
// step. Each change goes on from the very state of bodies, contacts and controller, so that a policy with the recorded
// commands (engine/control/command_file.h) makes the same trace, bit for bit. A new gait is tried by particles before
// the robot goes on by it (§9.4.2).

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/control/command_file.h"
#include "jobs/campaign/trace_frames.h"
#include "simulation/estimate.h"
#include "simulation/simulation.h"

namespace graze {

/// How a gait is tried before the switch.
struct GaitTrial {
  std::uint64_t particles = 16;  // 0: no trial, the robot goes on at once
  double horizon = 2;            // s
  double accept = 0.9;           // share of particles that must violate no requirement under the new gait
};

/// What a trial came to.
struct GaitVerdict {
  std::string from, to;
  std::uint64_t particles = 0;        // that are valid under the new gait
  double kept = 0, kept_by_stay = 0;  // shares that violate no requirement; NaN: none is valid
  double horizon = 0;                 // s
  bool accepted = false;
  std::string first_violated;  // by most of those that fail under the new gait; "": none fails
};

/// What can be seen of the robot now.
struct DriveSight {
  double time = 0;               // s
  Vec3 position = Vec3::Zero();  // of the base, m
  double yaw = 0, tilt = 0;      // rad; the base's z axis from upright
  Vec3 velocity = Vec3::Zero();  // in the base's level frame: forward, strafe (m/s), turn (rad/s)
  struct Foot {
    std::string name;
    Vec3 position;  // m
    bool touches;
  };
  std::vector<Foot> feet;
};

class DriveSession : private TraceObserver {
 public:
  /// `simulation` outlives this. `particle`: which robot; none: the nominal one, with the sensors' jitter. It stands
  /// still under the first policy that can be driven. `frames`: frame() is asked for. Throws InputError if none can, or
  /// the robot cannot be made.
  DriveSession(const Simulation& simulation, std::optional<std::uint32_t> particle, GaitTrial trial,
               bool frames = false);
  ~DriveSession() override;

  /// The policies that can be driven: a gait or network with a command, of one kind, in the scenario's order.
  const std::vector<std::string>& policies() const { return names_; }
  std::size_t policy() const { return now_; }
  /// The one that is being tried.
  std::optional<std::size_t> tried() const { return next_; }
  const CommandRow& command() const { return rows_.back(); }
  bool ended() const { return ended_; }
  const DriveSight& sight() const { return sight_; }
  /// Bodies as they are after the last control step, and contacts since the frame before.
  TraceFrames frame();
  const Particle& robot() const { return robot_; }

  /// From this control step on: m/s, m/s, rad/s.
  void command(double forward, double strafe, double turn);
  /// Tries a policy; if it is accepted the robot goes on by it one cycle of the present gait later, when its feet are
  /// where they were when the particles began. Nothing happens while another is tried.
  void choose(std::size_t policy);
  /// From this control step on, without a trial.
  void go_on_under(std::size_t policy, const CommandRow& row);
  /// One control step. Returns the verdict on a policy whose trial is over with it.
  std::optional<GaitVerdict> advance();
  /// Ends the trace here, where it is judged.
  void stop();

  /// Whole once it has ended.
  const TraceRecord& record() const { return run_->records().front(); }
  /// All commands so far, with the policies' names; a new row at each change.
  const std::vector<CommandRow>& rows() const { return rows_; }

 private:
  bool see(const StepView& view) override;
  void look(const StepView& view);
  void begin(std::shared_ptr<const SavedTrace> saved);
  void apply(std::size_t policy, CommandRow row);
  double cycle() const;
  void start_trial(const StepView& view);
  GaitVerdict try_out(Scenario scenario, const StateEstimate& estimate) const;

  const Simulation& simulation_;
  Particle robot_;
  GaitTrial trial_;
  std::vector<std::string> names_;
  std::vector<int> feet_;  // frames
  std::unique_ptr<PolicySpec> spec_;
  std::unique_ptr<BlockRun> run_;
  TraceSaver* saver_ = nullptr;  // of run_
  std::size_t now_ = 0;
  std::optional<std::size_t> next_;
  double switch_time_ = 0;  // s, of next_
  // What the next control step begins with: another policy or command, the memory for a trial; what it then waits for.
  bool changed_ = false, wants_memory_ = false, wants_estimate_ = false;
  State state_, truth_;  // now, and when a policy was chosen
  std::shared_ptr<const ControllerMemory> memory_;
  std::future<GaitVerdict> verdict_;
  std::vector<CommandRow> rows_;
  DriveSight sight_;
  std::vector<Pose> X_WB_;  // of the bodies, as sight_
  bool frames_ = false;
  FrameWatch::Pairs contacts_;  // since the last frame
  bool ended_ = false;
  double time_ = 0;  // s, of the last step that was seen
};

}  // namespace graze
