#pragma once
// Keeps everything of one trace, step by step, in columns that are ready to be exported.

#include "archive/replay_file.h"
#include "jobs/block_run.h"

namespace graze {

/// Watches a run of one particle. About 1 to 2 kB per step of a quadruped.
class StepRecorder : public TraceObserver {
 public:
  /// `info`: describe_campaign() of the scenario.
  StepRecorder(const Scenario& scenario, const CampaignInfo& info);
  void see(const StepView& step) override;
  StepLog take() { return std::move(log_); }

 private:
  void append(const BlockArray& array, int lane);
  void append_zeros(int rows);
  void append_contacts(const StepView& step);

  StepLog log_;
  std::size_t table_ = 0;  // that the next values go to
};

}  // namespace graze
