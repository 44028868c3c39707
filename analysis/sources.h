#pragma once
// Sources of uncertainty, each alone (dissertation §3.1, Figures 1 and 2): which parameters each has, and how far apart
// it drives what becomes of the robot. docs/sources.md.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/score.h"
#include "sampling/design.h"

namespace graze {

/// "fabrication", "environment", "contact", "initial state", "actuation", "sensing", "state estimate", "lag",
/// "disturbances", in this order in tables.
const std::vector<std::string>& source_names();
/// Which of them a parameter belongs to, by its path. Every path has one.
const std::string& source_of(const std::string& path);

/// Whether a parameter differs from particle to particle or from step to step: no constant.
bool is_uncertain(const UncertainParameter& parameter);
/// The uncertain parameters of a source alone, with the correlations among them; the source "all": all of them, "none":
/// none. Constants, which every particle has, stay with each.
ParameterSpace space_of_source(const ParameterSpace& all, const std::string& source);

/// What a study keeps of a trace.
struct SourceTrace {
  Outcome outcome = Outcome::invalid;
  double end_time = 0;    // s
  bool lasted = false;    // until the scenario's end
  std::vector<double> q;  // final state
};

/// What became of one policy under one source.
struct SourceSpread {
  std::string source, policy;
  std::size_t parameters = 0;               // uncertain ones
  std::array<std::uint64_t, 4> outcomes{};  // by Outcome
  Interval interval;                        // of the success rate, 95 %, Clopper-Pearson
  std::uint64_t lasted = 0;                 // valid traces that did, about which the next three are
  double place = 0;    // m, root mean square distance of the base from its mean place; NaN: fixed base, or fewer than 2
  double heading = 0;  // rad, of its yaw from the mean one; likewise
  double joints = 0;   // rad (m where joints slide), of a joint from its mean, over all joints; NaN: fewer than 2
  std::uint64_t failed = 0;              // before the end
  std::array<double, 3> failure_time{};  // s, quartiles of when; NaN: none failed
  std::uint64_t valid() const { return outcomes[0] + outcomes[1] + outcomes[2]; }
};

/// Where to look in q. `base`: of a floating base's quaternion; -1: it is fixed.
struct SourceLayout {
  int base = -1;
  std::vector<int> joints;
};

/// Fills outcomes, interval, spreads and times from the traces, which stand by particle.
void summarise_source(const std::vector<SourceTrace>& traces, const SourceLayout& layout, SourceSpread& out);

/// For a terminal, and as JSON in SI units.
std::string format_sources(const std::string& scenario, std::uint64_t particles, const std::vector<SourceSpread>& rows);
std::string sources_json(const std::string& scenario, std::uint64_t particles, const std::vector<SourceSpread>& rows);

}  // namespace graze
