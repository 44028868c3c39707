#pragma once
// Keeps everything of one trace, step by step, in columns that are ready to be exported.

#include <cstdint>
#include <limits>

#include "simulation/block_run.h"
#include "simulation/names.h"
#include "simulation/step_log.h"

namespace graze {

/// What the numbers of a StepView are, each with its name and unit.
struct StateColumns {
  std::vector<NamedColumn> q, v, tau, requirements, objective;
};
/// `names`: trace_names() of the scenario's model.
StateColumns state_columns(const Scenario& scenario, const TraceNames& names);

/// Watches a run of one particle. About 3 to 4 kB per frame of a quadruped.
class StepRecorder : public TraceObserver {
 public:
  /// `names`: trace_names() of the scenario's model. Both outlive this. Keeps one of `every` steps, and ends the trace
  /// once that takes more than `most` bytes.
  StepRecorder(const Scenario& scenario, const TraceNames& names, std::uint32_t every = 1,
               double most = std::numeric_limits<double>::infinity())
      : scenario_(scenario), names_(names), every_(every), most_(most) {}
  bool see(const StepView& step) override;
  /// What one frame takes without its contacts, in bytes.
  static double frame_bytes(const Scenario& scenario, const TraceNames& names, const Controller& controller);
  /// Takes memory for so many frames at once, of which a growing list would take twice as much.
  void expect(std::size_t frames) { expected_ = frames; }
  bool full() const { return full_; }
  StepLog take() { return std::move(log_); }

 private:
  void begin(const Controller& controller);
  void append(const BlockArray& array, int lane);
  void append(const double* values, std::size_t count);
  void append_same(int rows, double value);
  void append_centre_of_mass(const StepView& step);
  void append_control(const StepView& step);
  void append_observation(const StepView& step, const Observation& observation);
  void append_targets(const StepView& step, const Targets& targets);
  void append_effectors(const StepView& step);
  void append_contacts(const StepView& step);

  const Scenario& scenario_;
  const TraceNames& names_;
  const std::uint32_t every_;
  const double most_;         // bytes
  std::size_t expected_ = 0;  // frames
  double frame_bytes_ = 0;    // without contacts
  bool full_ = false;
  StepLog log_;
  std::size_t table_ = 0;  // that the next values go to
};

}  // namespace graze
