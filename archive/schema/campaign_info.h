#pragma once
// The facts of a campaign that do not depend on its traces.

#include <cstdint>
#include <string>
#include <vector>

#include "scenarios/judgement.h"
#include "scenarios/source.h"
#include "simulation/build_facts.h"
#include "simulation/names.h"

namespace graze {

inline constexpr int kArchiveFormatVersion = 1;

/// A campaign that stops by itself: what it was asked (graze run --until). No questions: it has a fixed size.
struct UntilInfo {
  std::vector<std::string> questions;
  double confidence = 0.95;
  std::uint64_t most = 0;         // particles at most (-n)
  std::uint64_t least = 0;        // no answer is taken from fewer particles
  std::uint64_t answered_at = 0;  // particles that answered all questions; 0: not answered
};

/// Consecutive particles: begin … end - 1. end 0: all.
struct ParticleRange {
  std::uint64_t begin = 0, end = 0;
  std::uint64_t count(std::uint64_t all) const { return end == 0 ? all : end - begin; }
};

/// Facts of a campaign that do not depend on its traces.
struct CampaignInfo : TraceNames {
  std::string scenario_name, scenario_text, scenario_sha256, command_line, start_time;  // ISO 8601, UTC
  std::string program_version, program_revision, physics, design;
  std::uint64_t seed = 0;
  std::uint64_t particles = 0;             // asked for, or what --until stopped at; traces beyond do not count
  double step = 0, control = 0, end = 0;   // s
  double unconverged = kUnconvergedShare;  // share of steps, above which a trace is flagged (SolverLog::flagged)
  bool tells_convergence = true;           // parts have schema::solver() and convergence(); not in older archives
  struct ParameterRow {
    std::string name, unit, distribution, jitter;
    double nominal;
    std::vector<std::string> labels;
  };
  std::vector<ParameterRow> parameters;
  struct RequirementRow {
    std::string name, description, unit;
    bool measure = false;    // decides nothing
    std::string parts = {};  // what its culprits are numbers of: part_kind_name(); empty in archives without
    Window window = {};      // when it counts, s; in archives without: always
  };
  std::vector<RequirementRow> requirements;  // measures last
  std::size_t deciding() const;              // requirements that are no measures
  std::string objective;
  std::vector<RequirementRow> leaves;  // witnesses of the objective, without names
  std::vector<std::string> policies;   // in scenario order
  bool store_values = true;            // /particles/values is kept
  std::string results_version;         // of the program; empty in archives that do not know it
  BuildFacts build;                    // of the program that began it
  UntilInfo until;
  ParticleRange part;     // that this directory is about (graze run --part)
  ScenarioSource source;  // every file that the scenario was read from; empty in archives without
};

}  // namespace graze
