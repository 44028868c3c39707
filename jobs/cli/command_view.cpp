// graze view: traces of an archive in three dimensions, in a browser.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "archive/files/parent_folders.h"
#include "archive/files/utf8.h"
#include "archive/hdf5/reading_child.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"
#include "jobs/cli/view_page.h"

namespace graze {
namespace {

constexpr std::size_t kMostViewed = 100;  // traces: more are no picture any longer

struct ViewArguments {
  std::string archive, output;
  std::vector<std::string> particles, policies;
  bool force = false;
};

/// "1,2" is no number, but two; "1,000" one that is written in an odd way.
void refuse_list(const std::string& text) {
  std::string options;
  std::istringstream pieces(text);
  bool thousands = true;
  for (std::string piece; std::getline(pieces, piece, ',');) {
    if (piece.empty() || piece.find_first_not_of("0123456789") != std::string::npos) return;
    thousands = thousands && (options.empty() || piece.size() == 3);
    options += (options.empty() ? "--particle " : " --particle ") + piece;
  }
  if (text.find(',') == std::string::npos || thousands) return;
  throw InputError(fmt::format("--particle {}: takes one particle; nearest right answer: {}", text, options));
}

std::vector<ChosenTrace> chosen_traces(const ViewArguments& arguments, const CampaignInfo& info) {
  std::vector<ChosenTrace> out;
  const std::vector<std::string> policies = chosen_names(info.policies, arguments.policies, arguments.archive);
  for (const std::string& text : arguments.particles) {
    const auto particle = static_cast<std::uint32_t>(parse_whole(text, "--particle", 0, kParticleLimit - 1));
    for (const std::string& policy : policies) {
      const auto same = [&](const ChosenTrace& one) { return one.particle == particle && one.policy == policy; };
      if (std::none_of(out.begin(), out.end(), same)) out.push_back({policy, particle, ""});
    }
  }
  if (out.size() <= kMostViewed) return out;
  throw InputError(
      fmt::format("--particle: {} particles under {} policies are {} traces; at most {} can be viewed; "
                  "nearest right answer: choose fewer policies with --policy",
                  arguments.particles.size(), policies.size(), out.size(), kMostViewed));
}

int view(const ViewArguments& arguments) {
  for (const std::string& text : arguments.particles) refuse_list(text);
  const auto first =
      static_cast<std::uint32_t>(parse_whole(arguments.particles[0], "--particle", 0, kParticleLimit - 1));
  const std::filesystem::path output =
      view_page_of("view", arguments.archive, first, arguments.output, arguments.force);
  const ParentFolders folders(output);
  std::optional<Archive> archive(arguments.archive);
  warn(archive->warnings());
  const CampaignInfo info = archive->info();
  const std::vector<ChosenTrace> chosen = chosen_traces(arguments, info);
  const std::vector<PageTrace> traces = find_traces(*archive, chosen, chosen.size());
  archive.reset();
  end_of_reading();
  const std::vector<std::string> different = write_view_page(output, arguments.force, arguments.archive, info, traces);
  std::cout << fmt::format("{}: {:.1f} kB\n", printable(output.string()),
                           static_cast<double>(std::filesystem::file_size(output)) / 1e3);
  for (const std::string& one : different) {
    spdlog::error("{}: {} went ANOTHER WAY than the archive says; graze replay tells how", arguments.archive, one);
  }
  return different.empty() ? kDone : kGateMissed;
}

}  // namespace

void add_view(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ViewArguments>();
  CLI::App* verb = add_verb(
      app, "view", "Traces of an archive in three dimensions, as a page for a browser",
      "  graze view quadruped_curb.graze --particle 17 --policy step/4cm      # writes quadruped_curb.p17.html\n"
      "  graze view curb.h5 --particle 17 -o p17.html                         # under every policy, overlaid\n"
      "  graze view curb.h5 --particle 3 --particle 17 --policy 'step/{3,4}cm'\n\n"
      "They are simulated again, bit for bit. Exit code 1: a trace is not the archive's.\n");
  add_archive(*verb, arguments->archive);
  verb->add_option("--particle", arguments->particles, "Which particle (0 is the first; may be repeated)")
      ->required()
      ->type_name("N")
      ->allow_extra_args(false);
  add_policies(*verb, arguments->policies);
  verb->add_option("-o,--output", arguments->output,
                   "The page, a file ending in .html (default: ARCHIVE with .pN.html)");
  add_trust(*verb);
  verb->add_flag("--force", arguments->force, "Replace the page if it exists");
  verb->callback([arguments, &action] {
    action = [arguments] { return in_page_child({arguments->archive}, [&] { return view(*arguments); }); };
  });
}

}  // namespace graze
