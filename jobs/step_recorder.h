#pragma once
// Keeps everything of one trace, step by step, in columns that are ready to be exported.

#include <cstdint>
#include <limits>

#include "archive/replay_file.h"
#include "jobs/block_run.h"

namespace graze {

/// Watches a run of one particle. About 3 to 4 kB per frame of a quadruped.
class StepRecorder : public TraceObserver {
 public:
  /// `info`: describe_campaign() of the scenario. Both outlive this. Keeps one of `every` steps, and nothing more once
  /// that takes more than `most` bytes.
  StepRecorder(const Scenario& scenario, const CampaignInfo& info, std::uint32_t every = 1,
               double most = std::numeric_limits<double>::infinity())
      : scenario_(scenario), info_(info), every_(every), most_(most) {}
  void see(const StepView& step) override;
  /// What one frame takes without its contacts, in bytes.
  static double frame_bytes(const Scenario& scenario, const CampaignInfo& info, const Controller& controller);
  /// Takes memory for so many frames at once, of which a growing list would take twice as much.
  void expect(std::size_t frames) { expected_ = frames; }
  bool full() const { return full_; }
  StepLog take() { return std::move(log_); }

 private:
  void begin(const Controller& controller);
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
  const std::uint32_t every_;
  const double most_;         // bytes
  std::size_t expected_ = 0;  // frames
  double frame_bytes_ = 0;    // without contacts
  bool full_ = false;
  StepLog log_;
  std::size_t table_ = 0;  // that the next values go to
};

}  // namespace graze
