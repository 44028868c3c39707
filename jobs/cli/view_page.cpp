#include "jobs/cli/view_page.h"

#include "analysis/report_data.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/cli/page.h"

namespace graze {

std::filesystem::path view_page_of(const std::string& verb, const std::filesystem::path& archive,
                                   std::uint32_t particle, const std::filesystem::path& output, bool force) {
  check_page_built(verb);
  std::filesystem::path page = output.empty() ? default_page(archive, ".p" + std::to_string(particle)) : output;
  check_page_output(page, force, archive);
  return page;
}

std::vector<std::string> write_view_page(const std::filesystem::path& page, bool force, const std::string& archive,
                                         const CampaignInfo& info, const std::vector<PageTrace>& traces) {
  check_results_version(archive, info, "view it with that program");
  const ArchivedScenario reloaded(archive, info, "it cannot be viewed");
  Json data = {{"kind", "view"},
               {"campaign", campaign_json(info, archive)},
               {"notes", Json::array()},
               {"sections", Json::array()}};
  std::vector<std::string> different = add_traces(data, reloaded.scenario(), info, archive, traces, NumberForm::packed);
  write_page(page, force, script_json(data));
  return different;
}

}  // namespace graze
