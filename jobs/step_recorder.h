#pragma once
// Keeps everything of one trace, step by step, in columns that are ready to be exported.

#include "archive/replay_file.h"
#include "jobs/block_run.h"

namespace graze {

/// Watches a run of one particle. About 3 to 4 kB per step of a quadruped.
class StepRecorder : public TraceObserver {
 public:
  /// `info`: describe_campaign() of the scenario. Both outlive this.
  StepRecorder(const Scenario& scenario, const CampaignInfo& info) : scenario_(scenario), info_(info) {}
  void see(const StepView& step) override;
  StepLog take() { return std::move(log_); }

 private:
  void append(const BlockArray& array, int lane);
  void append(const double* values, std::size_t count);
  void append_same(int rows, double value);
  void append_control(const StepView& step);
  void append_observation(const StepView& step, const Observation& observation);
  void append_targets(const StepView& step, const Targets& targets);
  void append_effectors(const StepView& step);
  void append_contacts(const StepView& step);

  const Scenario& scenario_;
  const CampaignInfo& info_;
  StepLog log_;
  std::size_t table_ = 0;  // that the next values go to
};

}  // namespace graze
