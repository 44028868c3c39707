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

#include "archive/directory/roles.h"
#include "archive/files/seal.h"
#include "archive/schema/campaign_info.h"
#include "archive/schema/trace_rows.h"
#include "simulation/trace.h"

namespace graze {

struct UnfinishedTrace;

/// Writes one campaign. Methods may be called from any thread (HDF5 is entered by one at a time).
class CampaignWriter {
 public:
  /// Creates the directory. Throws InputError if it exists and is not empty (unless `force`, which moves the old one
  /// aside until the first shard is complete, then removes it) and MachineError if it cannot be written.
  CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, bool force);
  /// Takes up the campaign in an existing directory, which `info` describes from now on.
  CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, ExistingCampaign existing);
  /// Adds shards to a campaign that another process holds.
  CampaignWriter(std::filesystem::path directory, const CampaignInfo& info, CampaignMember member);
  ~CampaignWriter();

  /// Adds the finished traces of one block under one policy. `values`: [trace][parameter], row-major, same order as
  /// traces. Buffered; a shard is written, by its own thread, when enough has gathered. Throws MachineError (disk
  /// full, …), once, for this shard or one before it: what is on disk stays.
  void append(int policy, std::vector<TraceRecord> traces, std::vector<double> values);
  /// Notes a particle that the machine has failed. Throws as append().
  void add_unfinished(const UnfinishedTrace& trace);
  /// Writes what is buffered.
  void flush();
  /// The campaign stays on disk to be resumed, though nothing of it may be written: without this one that ends without
  /// a trace goes again. Throws MachineError.
  void keep();
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

/// Reads a campaign directory or a packed file. Traces of particles beyond info().particles (work that ran ahead of
/// --until) are left out.
class Archive {
 public:
  /// Throws InputError: not there, not HDF5, cut short, not a Graze archive, made by a newer format (both versions
  /// named).
  explicit Archive(const std::filesystem::path& path, Seals seals = Seals::checked);
  ~Archive();

  const std::filesystem::path& path() const;  // as given
  const CampaignInfo& info() const;
  bool complete() const;
  /// What its readers should know: its description was damaged and a copy was read, …; a sentence each.
  const std::vector<std::string>& warnings() const;
  /// One trace with its events, without telemetry and contact sequence; none if it is not there. Reads that trace
  /// alone.
  std::optional<TraceRecord> trace(const std::string& policy, std::uint32_t particle) const;
  /// Passes the traces of a policy to `take`, some at a time, each particle once, in no particular order: of each its
  /// outcome and the chosen `columns` (TraceColumn); only those `wanted`, if that is given. For campaigns of any size:
  /// takes some MiB, and a bit per particle. An unknown policy has no traces. Throws InputError: the archive is
  /// damaged; what `take` throws goes through. `take` may read the archive.
  void scan(const std::string& policy, unsigned columns, const std::function<void(const TraceRows&)>& take,
            const TraceFilter& wanted = {}) const;
  /// Passes the persistent values of each particle, in the order of info().parameters, each particle once, in no
  /// particular order; nothing when they are not stored. As scan().
  void scan_values(const std::function<void(std::uint32_t, std::span<const double>)>& take) const;
  /// Persistent values of one particle, in the order of info().parameters; empty when they are not stored.
  std::vector<double> particle_values(std::uint32_t particle) const;
  /// Telemetry of one trace; empty if none was recorded.
  std::vector<TelemetryFrame> telemetry(const std::string& policy, std::uint32_t particle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether what is packed is looked at as verify() would; trusted: this program has just written it.
enum class PackedContent { checked, trusted };

/// One file of a campaign directory. Written under a temporary name, synced, renamed. Throws InputError if `file`
/// exists (unless force) or the directory is no campaign, MachineError on a failing disk. Deterministic: equal traces
/// give byte-identical datasets, whatever the order in which shards were written. Returns what Archive::warnings()
/// would. Refuses content that verify() would call damaged, unless it is trusted.
std::vector<std::string> pack(const std::filesystem::path& directory, const std::filesystem::path& file, bool force,
                              PackedContent content = PackedContent::checked);
/// The same of several directories that hold parts of one campaign (equal scenario, seed, number of particles, policies
/// and results version; else InputError, which names what differs). Complete if every trace is there.
std::vector<std::string> pack(const std::vector<std::filesystem::path>& directories, const std::filesystem::path& file,
                              bool force);

}  // namespace graze
