#pragma once
// One block of particles under one policy, which stands still between two steps so that a caller may look at it. In: a
// scenario's file and some ids. Out: what is true of each trace after its last step, as arrays [quantity][column], a
// column per particle.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "simulation/block_run.h"
#include "simulation/names.h"
#include "simulation/simulation.h"
#include "simulation/step_recorder.h"

namespace graze {

/// What is to be simulated.
struct BlockRequest {
  std::string file;  // of the scenario
  std::vector<Override> overrides;
  std::string policy;                    // its name; may be empty if there is but one
  std::vector<std::uint32_t> particles;  // 1 to kLanes ids
  std::uint64_t count = 0;  // particles of the campaign, which a Latin hypercube depends on; 0: the scenario's
  std::optional<std::uint64_t> seed;  // instead of the scenario's
  bool trust = false;                 // controllers from outside may run
};

class SteppedBlock final : public TraceObserver {
 public:
  using Array = Eigen::Array<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;  // [quantity][column]

  /// Every particle stands at the start of its trace. Throws InputError for what is wrong with the request,
  /// MachineError, and std::runtime_error for what a controller from outside does. step() throws the last two, too.
  explicit SteppedBlock(const BlockRequest& request);
  SteppedBlock(const SteppedBlock&) = delete;
  SteppedBlock& operator=(const SteppedBlock&) = delete;

  /// One physics step of all traces that have not ended. False: all have.
  bool step();
  /// Ends traces where they are; they are judged as they stand. Throws InputError: no such column.
  void stop(const std::vector<int>& columns);

  const Scenario& scenario() const { return simulation_.scenario(); }
  const PolicySpec& policy() const { return policy_; }
  const TraceNames& names() const { return names_; }
  StateColumns columns() const { return state_columns(scenario(), names_); }
  const std::vector<Particle>& particles() const { return particles_; }
  int size() const { return static_cast<int>(particles_.size()); }

  // Of each trace after its last step, in SI units and world axes.
  std::vector<double> time;                    // [column], s
  std::vector<bool> active;                    // [column], whether it goes on
  Array q, v, a;                               // [nq], [nv], [nv], see Model and BlockState
  Array tau;                                   // [na], of the step; 0 at the start
  Array link_position;                         // [3 link], m
  Array link_rotation;                         // [9 link], R_WL row by row
  Array requirements, objective;               // [requirement], [leaf of the objective]: witness values
  std::vector<std::vector<Contact>> contacts;  // [column], with near points

  /// Of a trace so far, or of all of it once it has ended.
  const std::vector<Event>& events(int column) const;
  /// Throws InputError while the trace goes on, and for a column that is not there.
  const TraceRecord& record(int column) const;

  bool see(const StepView& view) override;

 private:
  void check_column(int column) const;

  Simulation simulation_;
  const PolicySpec& policy_;
  const TraceNames names_;
  std::vector<Particle> particles_;
  std::vector<int> lane_of_, column_of_;  // [column], [lane]
  BlockRun run_;
};

}  // namespace graze
