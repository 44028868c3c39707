#pragma once
// The page of traces in three dimensions: what `graze view` writes, and `graze replay --view`.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "jobs/campaign/page_traces.h"

namespace graze {

/// Where the page of a particle goes: `output`, or if that is empty beside the archive: "out/curb.graze" and 3 give
/// "out/curb.p3.html". Throws InputError unless a page of the archive may be written there. `verb`: that is to write
/// it.
std::filesystem::path view_page_of(const std::string& verb, const std::filesystem::path& archive,
                                   std::uint32_t particle, const std::filesystem::path& output, bool force);

/// Simulates the traces again and writes their page. Returns those that are not the archive's: "particle 3 under policy
/// 'walk'". Throws InputError if this program is not of the archive's results version, or the archive kept no files.
std::vector<std::string> write_view_page(const std::filesystem::path& page, bool force, const std::string& archive,
                                         const CampaignInfo& info, const std::vector<PageTrace>& traces);

}  // namespace graze
