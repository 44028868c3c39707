#pragma once
// A sweep on disk: a folder with one campaign per value, each as `graze run` makes it, and sweep.json, which says what
// the values are, with a seal and what tells each campaign's scenario from the others'. The folder takes its name when
// it is whole.

#include <filesystem>
#include <string>
#include <vector>

#include "analysis/sweep.h"
#include "archive/schema/campaign_info.h"

namespace graze {

inline constexpr const char* kSweepFile = "sweep.json";

/// What is asked of a sweep.
struct SweepPlan {
  Sweep sweep;                  // without traces
  std::uint64_t particles = 0;  // at each value; of an adaptive one: at most
};

/// Fills the points of a sweep from its axes, without traces. Throws InputError if there are more than
/// kMostSweepPoints.
void number_points(Sweep& sweep);
inline constexpr std::size_t kMostSweepPoints = 10'000;

/// `campaigns`: of the points, in their order. Throws MachineError.
void write_plan(const std::filesystem::path& folder, const SweepPlan& plan, const std::vector<CampaignInfo>& campaigns,
                const std::string& command_line);
/// Throws InputError: no sweep, of a newer format, damaged or changed since it was written.
SweepPlan read_plan(const std::filesystem::path& folder);
/// Whether a folder holds a sweep.
bool is_sweep(const std::filesystem::path& folder);

/// Whether the campaign of a point has the outcomes of so many particles. Throws InputError.
bool has_particles(const std::filesystem::path& campaign, std::uint64_t particles);
/// Whether all traces of a campaign that are not there are noted as unfinished, and there are such. Throws InputError.
bool lacks_unfinished_only(const std::filesystem::path& campaign);
/// How many particles a campaign shall have, whether or not they are there; 0: it does not read.
std::uint64_t described_particles(const std::filesystem::path& campaign);
/// Reads the outcomes of a point from its campaign. Throws InputError, also if its scenario is not that of the value.
void read_traces(const std::filesystem::path& folder, const Sweep& sweep, SweepPoint& point);

}  // namespace graze
