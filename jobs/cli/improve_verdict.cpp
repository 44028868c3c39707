#include "jobs/cli/improve_verdict.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/archive.h"
#include "archive/files/shell_word.h"
#include "jobs/campaign/describe_campaign.h"
#include "jobs/campaign/improvement_words.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/improve_page.h"
#include "jobs/cli/resume_campaign.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kVerdictOf = "graze improve (verdict of ";  // how its campaigns were made

/// What is not an earlier verdict of a session stays.
void refuse_foreign(const fs::path& campaign) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(campaign, error))) return;
  if (!fs::is_symlink(campaign, error) && Archive(campaign).info().command_line.starts_with(kVerdictOf)) return;
  throw InputError(fmt::format("{}: is there already, and no verdict of graze improve; move it, or --force replaces it",
                               campaign.string()));
}

/// A campaign of a scenario file in the folder, simulated unless it is there.
void simulate_one(const fs::path& folder, const std::string& name, const VerdictRequest& request) {
  const fs::path campaign = folder / (fs::path(name).stem().string() + ".graze");
  Scenario scenario = load_scenario((folder / name).string());
  scenario.seed = request.question.seed + 1;  // others than those that were improved on
  scenario.particles = request.particles;
  std::erase_if(scenario.policies, [&](const PolicySpec& one) { return one.name != request.question.options.policy; });
  const CampaignInfo info = describe_campaign(scenario, request.particles, fmt::format("{}{})", kVerdictOf, name));
  if (!request.force) refuse_foreign(campaign);
  CampaignWriter(campaign, info, true).keep();
  ResumeArguments resume;
  resume.directory = campaign.string();
  resume.threads = request.threads;
  resume.quiet = true;
  resume.table = false;
  resume.all = true;
  const auto comm = make_local_communicator();
  Start start(*comm);
  resume_campaign(resume, start);
}

}  // namespace

std::string verdict_text(const PolicyComparison& pair, std::uint64_t asked, const fs::path& folder) {
  std::string missing;
  if (pair.pairs.n() < asked) {
    missing = fmt::format(
        "{} of {} particles are not among them: they have no valid trace before or after, as 'graze score {}' and "
        "'graze "
        "score {}' tell\n",
        asked - pair.pairs.n(), asked, shell_path((folder / "before.graze").string()),
        shell_path((folder / "improved.graze").string()));
  }
  if (pair.pairs.n() == 0) {
    return fmt::format("\nNo verdict on {} particles that it was not improved on: nothing can be compared\n{}", asked,
                       missing);
  }
  return fmt::format(
      "\nVerdict on {} particles that it was not improved on: {} succeed before, {} after; {} were fixed, {} broke\n"
      "Difference {:+.3f}, 95 % interval {:+.3f} .. {:+.3f}, p = {:.2g}: {}\n{}",
      pair.pairs.n(), pair.success_a, pair.success_b, pair.pairs.only_b, pair.pairs.only_a, pair.difference,
      pair.interval.low, pair.interval.high, pair.p_value, verdict_words(pair), missing);
}

void simulate_verdict(const fs::path& folder, const VerdictRequest& request) {
  for (const char* name : {kBeforeScenario, kImprovedScenario}) simulate_one(folder, name, request);
}

}  // namespace graze
