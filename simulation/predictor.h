#pragma once
// What will become of the robot under each of several candidate policies, told before a wall-clock deadline (§4.3.3):
// particles begin at an estimate of its state and are simulated for a while, the same ones under each candidate.
//
//   Predictor predictor(simulation, {"switch/0.9s", "switch/1.125s"});
//   const Prediction told = predictor.predict(estimate, {.horizon = 2, .deadline = 0.1});
//   if (told.best >= 0) … told.candidates[told.best].policy

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "simulation/estimate.h"
#include "simulation/simulation.h"

namespace graze {

struct PredictionLimits {
  double horizon = 0;                                         // s from the estimate on; 0: until the scenario's end
  double deadline = std::numeric_limits<double>::infinity();  // s of wall clock from the call on
  std::uint64_t particles = 0;                                // of each candidate; 0: as many as the deadline allows
};

/// Mean, standard deviation and least of numbers that come one by one, or some at a time.
class NumberSummary {
 public:
  void add(double x);
  void add(const NumberSummary& other);
  std::uint64_t count() const { return count_; }
  double mean() const;   // NaN: there are none
  double std() const;    // of the sample; NaN: fewer than 2
  double least() const;  // NaN: there are none

 private:
  std::uint64_t count_ = 0;
  double mean_ = 0, squares_ = 0, least_ = std::numeric_limits<double>::infinity();
};

struct CandidatePrediction {
  std::string policy;
  std::array<std::uint64_t, 4> outcomes{};  // by Outcome; an objective is judged at the horizon
  double rate = 0;                          // of success among valid traces; NaN: there are none
  double low = 0, high = 1;                 // Wilson's interval of it, 95 %
  std::vector<std::uint64_t> violated;      // known failures by the requirement that was violated first
  std::vector<NumberSummary> margins;       // of valid traces, per requirement; without those never looked at
  NumberSummary objective;                  // of valid traces, its margin
  NumberSummary lasted;                     // of valid traces, s from the estimate on
  // Of valid traces that lasted until the horizon, root mean square distance from the mean: of the base, m, and of
  // joints, rad (m where they slide). NaN: it is fixed, or fewer than 2.
  double place = 0, joints = 0;
  std::vector<Outcome> by_particle;
  std::string invalid_reason;  // of the first invalid one; "": all are valid

  std::uint64_t valid() const { return outcomes[0] + outcomes[1] + outcomes[2]; }
};

struct Prediction {
  std::vector<CandidatePrediction> candidates;  // as they were given
  /// Of the greatest rate of success; of several the one whose traces last longer in the mean, then the one with the
  /// greater mean margin of the objective, then the first. -1: no candidate has a valid trace.
  int best = -1;
  /// Of each candidate, the first of the simulation: `particles` of the call that makes the same prediction without a
  /// deadline.
  std::uint64_t particles = 0;
  double horizon = 0;       // s
  double seconds = 0;       // of wall clock, the whole call
  bool in_time = true;      // it returned before the deadline
  std::uint64_t steps = 0;  // physics steps of one particle each, of blocks that came to their end
};

/// Index of the best, as Prediction::best.
int best_of(const std::vector<CandidatePrediction>& candidates);

/// Simulates candidates on threads of its own. Owned by one thread. It keeps what does not depend on the estimate
/// (controllers, engines, the first particles), so that its calls do not take that time; make it beforehand.
class Predictor {
 public:
  /// `simulation` outlives this. `candidates`: policies of its scenario. `threads`: 0: all of this machine's. Throws
  /// InputError: no such policy, or one twice.
  Predictor(const Simulation& simulation, const std::vector<std::string>& candidates, int threads = 0);
  ~Predictor();

  /// Particle i has the values that it has in the simulation and begins where EstimateDraws says. Blocks of eight
  /// particles are simulated under each candidate; those count that came to an end under all of them, as far as there
  /// is no gap, so that no candidate is judged by other particles than another, and none by the ones that fell early.
  /// What is told depends on the estimate, the horizon and Prediction::particles, not on threads and clocks. Throws
  /// InputError for an estimate or limits that cannot be, SavedTraceError for a memory that is not of the candidates'
  /// kind, MachineError.
  Prediction predict(const StateEstimate& estimate, const PredictionLimits& limits);

  /// Fabricates the first particles now, not when they are first needed. (Up to kKeptParticles are kept.)
  void prepare(std::uint64_t particles);
  static constexpr std::uint64_t kKeptParticles = 1024;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace graze
