#pragma once
// One design, simulated for people to look at: what each drive did along its trace (Figure 45), and poses for pictures
// in three dimensions (Figures 40, 46).

#include <string>
#include <vector>

#include "jobs/campaign/trace_frames.h"
#include "scenarios/scenario.h"
#include "simulation/trace.h"

namespace graze {

/// What the drive of one joint did, and what it may do.
struct DriveTrace {
  std::string joint;
  bool slides = false;                // m/s and N; else rad/s and N m
  double effort = 0, velocity = 0;    // the joint's limits; infinite: none
  std::vector<double> speed, torque;  // [sample]
  std::vector<double> asked;          // [sample], the torque before it was cut at the drive's limit
};

struct DesignTrace {
  TraceRecord record;
  std::vector<double> time;        // [sample], s, after the first step; at most kMostSamples
  std::vector<DriveTrace> drives;  // [actuator]
  TraceFrames frames;
};

inline constexpr std::uint32_t kMostSamples = 1500;

/// The nominal robot of a scenario, without jitter, to the end of its trace, whatever it violates.
DesignTrace trace_design(Scenario scenario, const std::string& policy);

/// The first robot of a session and the one that it came to, in the same task.
struct DesignPair {
  DesignTrace before, improved;
};

}  // namespace graze
