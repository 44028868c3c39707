// graze report: what a campaign found, as one page for a browser.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <iostream>
#include <memory>
#include <optional>

#include "analysis/report_causes.h"
#include "analysis/report_data.h"
#include "analysis/report_events.h"
#include "analysis/report_survival.h"
#include "archive/files/parent_folders.h"
#include "archive/files/utf8.h"
#include "archive/hdf5/reading_child.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/campaign/hanging_controllers.h"
#include "jobs/campaign/improvement_page.h"
#include "jobs/campaign/page_traces.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/improve_page.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/page.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

constexpr std::size_t kMostReplays = 100, kMostTrajectories = 1000;

struct ReportArguments {
  std::string archive, output;
  std::vector<std::string> policies;
  std::size_t replays = 12, trajectories = 60;
  bool force = false, json = false;
};

/// Traces simulated anew, or a note on why there are none: the rest of the report stands without them.
void add_replays(Json& page, const ReportArguments& arguments, const CampaignInfo& info,
                 const std::vector<PageTrace>& traces, NumberForm form) {
  if (traces.empty()) return;
  try {
    check_results_version(arguments.archive, info, "make the report with that program for trajectories and replays");
    const ArchivedScenario reloaded(arguments.archive, info, "nothing can be simulated again");
    for (const std::string& one : add_traces(page, reloaded.scenario(), info, arguments.archive, traces, form)) {
      spdlog::warn("{}: {} went ANOTHER WAY than the archive says; graze replay tells how", arguments.archive, one);
    }
  } catch (const InputError& error) {
    spdlog::warn("no trajectories and no replays: {}", error.what());
    page["notes"].push_back(fmt::format("No trajectories and no replays: {}", error.what()));
    add_archived_traces(page, info, arguments.archive, traces);
  }
}

/// How long traces last, and why they end as they do.
void add_explanation(Json& page, const Archive& archive, const std::string& name,
                     const std::vector<std::string>& policies, NumberForm form) {
  if (Json section = survival_section(explain_survival(archive, policies), form); !section.is_null()) {
    page["sections"].push_back(std::move(section));
  }
  ExplainOptions options;
  options.most_particles = particles_of_traces(kExplainedTraces, policies.size());
  page["sections"].push_back(causes_section(explain(archive, policies, options), name));
}

/// What happened in traces, if the archive tells it.
void add_sections(Json& page, const Archive& archive, const std::string& name,
                  const std::vector<std::string>& policies) {
  EventsRequest request;
  request.name = name;
  request.policies = policies;
  request.rules.detail = Detail::features;  // as the tree is told
  try {
    page["sections"].push_back(events_section(campaign_events(archive, request)));
  } catch (const NoStories&) {
    // Nothing touched, or an older archive: there is no such section.
  } catch (const InputError& error) {
    page["notes"].push_back(fmt::format("No events: {}", error.what()));
  }
  std::vector<UnknownFailures> unknown;
  for (const std::string& policy : policies) unknown.push_back(unknown_failures(archive, policy));
  if (Json section = unknown_section(unknown, name); !section.is_null()) page["sections"].push_back(std::move(section));
}

/// The page of a session of graze improve.
int report_redesign(const ReportArguments& arguments) {
  if (!arguments.policies.empty()) {
    throw InputError(
        fmt::format("--policy: {} is a session of graze improve, which is about one policy", arguments.archive));
  }
  std::filesystem::path output = arguments.output;
  if (!arguments.json) {
    check_page_built("report");
    if (output.empty()) output = default_page(arguments.archive, "");
    check_page_output(output, arguments.force, arguments.archive);
  }
  const EndHangingControllers watch;
  const Redesign redesign = read_redesign(arguments.archive);
  if (arguments.json) {
    std::cout << redesign_page(redesign, NumberForm::plain).dump(-1, ' ', false, Json::error_handler_t::replace)
              << "\n";
    return kDone;
  }
  const ParentFolders folders(output);
  write_page(output, arguments.force, script_json(redesign_page(redesign, NumberForm::packed)));
  std::cout << fmt::format("{}: {:.1f} kB\n", printable(output.string()),
                           static_cast<double>(std::filesystem::file_size(output)) / 1e3);
  return kDone;
}

int report(const ReportArguments& arguments) {
  if (!arguments.json) check_page_built("report");
  std::filesystem::path output = arguments.output;
  std::optional<ParentFolders> folders;
  if (!arguments.json) {
    if (output.empty()) output = default_page(arguments.archive, "");
    check_page_output(output, arguments.force, arguments.archive);
    folders.emplace(output);
  }
  const NumberForm form = arguments.json ? NumberForm::plain : NumberForm::packed;
  std::optional<Archive> archive(arguments.archive);
  warn(archive->warnings());
  const CampaignInfo info = archive->info();
  const std::vector<std::string> policies = chosen_names(info.policies, arguments.policies, arguments.archive);
  const ReportInput input = read_report(*archive, arguments.archive, policies);
  Json page = report_data(*archive, input, form);
  add_explanation(page, *archive, arguments.archive, policies, form);
  add_sections(page, *archive, arguments.archive, policies);
  for (const std::string& warning : archive->warnings()) page["notes"].push_back(warning);
  if (!archive->complete())
    page["notes"].push_back("The campaign is not complete: not all traces have been simulated.");
  const std::size_t most = std::max(arguments.replays, arguments.trajectories);
  const std::vector<PageTrace> traces =
      find_traces(*archive, choose_traces(input.ways, input.sample, info, most), arguments.replays);
  const bool complete = archive->complete();
  archive.reset();
  end_of_reading();
  add_replays(page, arguments, info, traces, form);
  if (arguments.json) {
    std::cout << page.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    write_page(output, arguments.force, script_json(page));
    std::cout << fmt::format("{}: {:.1f} kB\n", printable(output.string()),
                             static_cast<double>(std::filesystem::file_size(output)) / 1e3);
  }
  if (complete) return kDone;
  spdlog::warn("{}: is not complete; 'graze status' tells what is missing, and the page is about what is there",
               arguments.archive);
  return kMachineFailed;
}

}  // namespace

void add_report(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* verb =
      add_verb(app, "report", "One page for a browser: rates, failures, margins, trajectories, replays in 3-D",
               "  graze report quadruped_curb.graze                      # writes quadruped_curb.html\n"
               "  graze report curb.h5 -o report.html --force\n"
               "  graze report curb.h5 --policy 'step/*' --replays 24\n"
               "  graze report curb.h5 --json                            # all that the page shows, as data\n"
               "  graze report my.improve                                # a session of graze improve\n\n"
               "The page is one file, which needs no network. Trajectories and replays are simulated again from what\n"
               "the archive keeps; where that cannot be, the page and the terminal say why.\n");
  add_archive(*verb, arguments->archive);
  CLI::Option* output = verb->add_option("-o,--output", arguments->output,
                                         "The page, a file ending in .html (default: ARCHIVE with .html)");
  add_policies(*verb, arguments->policies);
  add_whole(*verb, "--replays", arguments->replays, 0, kMostReplays, "Traces shown in three dimensions (default: 12)");
  add_whole(*verb, "--trajectories", arguments->trajectories, 0, kMostTrajectories,
            "Traces whose channels are plotted against time (default: 60)");
  add_trust(*verb);
  verb->add_flag("--force", arguments->force, "Replace the page if it exists");
  verb->add_flag("--json", arguments->json, "Print the page's data as JSON, and write no page")->excludes(output);
  verb->callback([arguments, &action] {
    // Beside reading, some tests of many policies take seconds for few megabytes, as those of explain.
    action = [arguments] {
      if (is_session(arguments->archive)) return report_redesign(*arguments);
      return in_page_child(
          {arguments->archive}, [&] { return report(*arguments); }, 2);
    };
  });
}

}  // namespace graze
