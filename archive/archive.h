#pragma once
// The campaign on disk. While it runs: a directory with campaign.h5 (everything about the campaign but its traces) and
// shards, each a file of whole blocks that appears by rename once it is complete. `pack` makes one file of it. Both
// read the same. Schema: docs/archive.md.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scenarios/judgement.h"
#include "scenarios/source.h"
#include "simulation/build_facts.h"
#include "simulation/names.h"
#include "simulation/trace.h"

namespace graze {

class DirectoryLock;
struct UnfinishedTrace;

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
  std::uint64_t particles = 0;            // asked for, or what --until stopped at; traces beyond do not count
  double step = 0, control = 0, end = 0;  // s
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

/// Writes one campaign. Methods may be called from any thread (HDF5 is entered by one at a time).
class CampaignWriter {
 public:
  /// Creates the directory. Throws InputError if it exists and is not empty (unless `force`, which moves the old one
  /// aside until the first shard is complete, then removes it) and MachineError if it cannot be written.
  CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, bool force);
  /// Takes up the campaign in an existing directory, which `info` describes from now on. `lock`: of that directory, if
  /// it is held already.
  struct Existing {
    std::shared_ptr<const DirectoryLock> lock = nullptr;
  };
  CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, Existing);
  /// Another process has made or taken up the campaign and holds its lock; this one adds shards under its own name,
  /// numbered from `shards` + 1 on. With many ranks each writes less often, so that all together write no more than 500
  /// shards per second.
  struct Member {
    int rank, shards, ranks;
  };
  CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, Member);
  ~CampaignWriter();

  /// Adds the finished traces of one block under one policy. `values`: [trace][parameter], row-major, same order as
  /// traces. Buffered; a shard is written, by a thread of its own, when enough has gathered. Throws MachineError (disk
  /// full, …), once, for this shard or one before it: what is on disk stays.
  void append(int policy, std::vector<TraceRecord> traces, std::vector<double> values);
  /// Notes a particle that the machine has failed. Throws as append().
  void add_unfinished(const UnfinishedTrace& trace);
  /// Writes what is buffered.
  void flush();
  /// Writes what is buffered; marks the campaign complete unless it was stopped early. `answered_at`: so many particles
  /// answered its questions (info.until), and it has no more than these from now on; 0: all that were asked for.
  void finish(bool complete = true, std::uint64_t answered_at = 0);
  /// Highest number of a shard that the directory has or had when this began, or that was written since.
  int shards() const;
  const std::filesystem::path& directory() const;
  /// Throws MachineError if the path leads elsewhere by now: somebody has moved, removed or replaced the directory, or
  /// the lock in it. Nothing is ever written into another one.
  void check_in_place() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Columns of the traces of one policy, in order of particle id.
struct TraceTable {
  std::string policy;
  std::vector<std::uint32_t> particle;
  std::vector<Outcome> outcome;
  std::vector<int> violated;
  std::vector<double> end_time, objective_margin;
  std::vector<SolverLog> solver;                               // empty: the archive is older than that
  std::vector<std::vector<double>> margins, first_violations;  // [requirement][trace]
  std::vector<std::uint64_t> digest;
  std::vector<std::string> sequence, invalid_reason;
  std::size_t size() const { return particle.size(); }
};

/// How the traces of one policy ended, in order of particle id.
struct OutcomeTable {
  std::vector<std::uint32_t> particle;
  std::vector<Outcome> outcome;
};

/// The failed traces of one policy (known, unknown and invalid), in order of particle id.
struct FailureTable {
  struct Row {
    std::uint32_t particle = 0;
    Outcome outcome = Outcome::invalid;
    int violated = -1;         // requirement index, known failures only
    std::uint32_t reason = 0;  // index into `reasons`, invalid traces only
    double time = 0;           // s: of the violation, else of the end
    double margin = 0;         // of the violated requirement, else of the objective
    Culprit culprit = {};      // at the first violation, else of the objective
  };
  std::vector<Row> rows;
  std::vector<std::string> reasons;
};

/// What counts of one trace.
struct TraceOutcome {
  std::uint32_t particle;
  Outcome outcome;
  int violated;  // requirement index; -1: none
  double objective_margin;
  bool cut = false;             // it ended before its time, by a violation
  std::uint64_t kept = 0;       // bit k: the k-th measure was kept (kept_by)
  std::uint64_t undecided = 0;  // bit k: whether it was, nobody knows
  Culprit culprit = {};         // of a failure: at the first violation, else of the objective
};

/// Whether the seals of shards are to be checked, which reads all of them; trusted: this program has just written them.
enum class Seals { checked, trusted };

/// Reads a campaign directory or a packed file. Traces of particles beyond info().particles (work that ran ahead of
/// --until) are not among what it gives.
class Archive {
 public:
  /// Throws InputError: not there, not HDF5, cut short, not a Graze archive, made by a newer format (both versions
  /// named).
  explicit Archive(const std::filesystem::path& path, Seals seals = Seals::checked);
  ~Archive();

  const std::filesystem::path& path() const;  // as given
  const CampaignInfo& info() const;
  bool complete() const;
  /// What whoever reads it should know: its description was damaged and a copy was read, …; a sentence each.
  const std::vector<std::string>& warnings() const;
  /// By policy name; empty table if it has no traces yet.
  TraceTable traces(const std::string& policy) const;
  /// One trace with its events, without telemetry and contact sequence; none if it is not there. Reads that trace
  /// alone.
  std::optional<TraceRecord> trace(const std::string& policy, std::uint32_t particle) const;
  OutcomeTable outcomes(const std::string& policy) const;
  /// The failed traces of a policy by particle, of all particles or of those `wanted`. Memory: a row for each of them.
  FailureTable failures(const std::string& policy, const std::function<bool(std::uint32_t)>& wanted = {}) const;
  /// What counts of all traces of a policy, some at a time, each particle once, in no particular order. For campaigns
  /// of any size: takes a bit of memory per particle.
  void visit_outcomes(const std::string& policy, const std::function<void(std::span<const TraceOutcome>)>& take) const;
  /// Persistent values of one particle, in the order of info().parameters; empty when they are not stored.
  std::vector<double> particle_values(std::uint32_t particle) const;
  /// Events of all traces of a policy: one vector per row of traces(policy).
  std::vector<std::vector<Event>> events(const std::string& policy) const;
  /// Telemetry of one trace; empty if none was recorded.
  std::vector<TelemetryFrame> telemetry(const std::string& policy, std::uint32_t particle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One file of a campaign directory. Written under a temporary name, synced, renamed. Throws InputError if `file`
/// exists (unless force) or the directory is no campaign, MachineError on a failing disk. Deterministic: equal traces
/// give byte-identical datasets, whatever the order in which shards were written. Gives what Archive::warnings() would.
/// Refuses content that verify() would call damaged, unless this program has just written it (`seals`).
std::vector<std::string> pack(const std::filesystem::path& directory, const std::filesystem::path& file, bool force,
                              Seals seals = Seals::checked);
/// The same of several directories that hold parts of one campaign (equal scenario, seed, number of particles, policies
/// and results version; else InputError, which names what differs). Complete if every trace is there.
std::vector<std::string> pack(const std::vector<std::filesystem::path>& directories, const std::filesystem::path& file,
                              bool force);

}  // namespace graze
