#pragma once
// Traces of an archive simulated anew for a page (graze report, graze view): channels against time, and poses, shapes
// and contacts in three dimensions. Format of the data: docs/report.md.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/report_failures.h"
#include "analysis/report_numbers.h"
#include "archive/archive.h"
#include "scenarios/scenario.h"

namespace graze {

/// A trace that a page shows.
struct PageTrace {
  ChosenTrace chosen;
  bool bodies = false;  // in three dimensions, too
  TraceRecord archived;
};

/// What Archive::trace() holds of the chosen traces, `bodies` of them in three dimensions. Throws InputError if it
/// lacks one.
std::vector<PageTrace> find_traces(const Archive& archive, const std::vector<ChosenTrace>& chosen, std::size_t bodies);

/// Simulates them, on one thread, and puts "trajectories", "channels" and "scene" into `page`. A trace that comes out
/// as another one than the archive's is shown as it came out; a note in `page` says so, and it is returned: "particle 3
/// under policy 'walk'". `name`: the archive in replay commands. The files that the scenario was read from are in force
/// (ArchivedScenario).
std::vector<std::string> add_traces(Json& page, const Scenario& scenario, const CampaignInfo& info,
                                    const std::string& name, std::vector<PageTrace> traces, NumberForm form);

/// The same traces as the archive alone knows them: outcomes, margins and contact phases.
void add_archived_traces(Json& page, const CampaignInfo& info, const std::string& name,
                         const std::vector<PageTrace>& traces);

}  // namespace graze
