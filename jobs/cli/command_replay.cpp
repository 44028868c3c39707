// graze replay: one trace of an archive once more, with everything that was known at each step.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <iostream>
#include <memory>
#include <optional>

#include "archive/archive.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "jobs/campaign/replay.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/page.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"
#include "jobs/cli/view_page.h"
#include "jobs/workers/controllers.h"
#include "simulation/results_epoch.h"

namespace graze {
namespace {

struct ReplayArguments {
  ReplayRequest request;
  std::string output;
  bool force = false, all = false, json = false, view = false;
};

/// The name of the page, which --output does not choose.
std::filesystem::path page_of(const ReplayArguments& arguments) {
  const ReplayRequest& request = arguments.request;
  const auto page = default_page(request.archive, ".p" + std::to_string(request.particle));
  if (!arguments.force && std::filesystem::exists(page)) {
    throw InputError(
        fmt::format("--view: {} exists already; give --force, or write another page: graze view {} "
                    "--particle {} -o OTHER.html",
                    page.string(), shell_word(request.archive), request.particle));
  }
  return view_page_of("replay --view", request.archive, request.particle, "", arguments.force);
}

/// The page of the trace, as graze view makes it.
void write_view(const std::filesystem::path& page, const ReplayArguments& arguments, const Replay& result) {
  const ReplayFile& file = result.file;
  if (!result.archived) {
    throw InputError(
        fmt::format("--view: {} holds no trace of particle {} under policy '{}', and a page is of what an "
                    "archive holds; leave out --view",
                    arguments.request.archive, file.trace.particle, file.policy));
  }
  write_view_page(page, arguments.force, arguments.request.archive, result.archived_info,
                  {{{file.policy, file.trace.particle, ""}, true, *result.archived}});
}

/// What the campaign was made of may still be used: a height map is a .csv, too.
std::vector<std::filesystem::path> inputs_of(const std::string& archive) {
  const Archive read(archive);
  std::vector<std::filesystem::path> out;
  for (const auto& [name, content] : read.info().source.inputs) out.emplace_back(name);
  return out;
}

int replay(const ReplayArguments& arguments) {
  if (!arguments.output.empty()) {
    const std::string& archive = arguments.request.archive;
    check_replay_output(arguments.output, arguments.force, archive, inputs_of(archive));
  }
  std::optional<ParentFolders> folders;
  if (!arguments.output.empty()) folders.emplace(arguments.output);
  const std::filesystem::path page = arguments.view ? page_of(arguments) : std::filesystem::path();
  const Replay result = replay(arguments.request);
  warn(result.warnings);
  std::vector<std::string> exported;
  if (arguments.view) {  // first: where there can be no page nothing is written
    write_view(page, arguments, result);
    exported.push_back(page.string());
  }
  if (!arguments.output.empty()) {
    write_replay(result.file, arguments.output, arguments.force);
    for (const auto& file : replay_files(arguments.output)) exported.push_back(file.string());
  }
  if (arguments.json) {
    std::cout << replay_json(result, exported) << "\n";
  } else {
    std::cout << format_replay(result, arguments.all);
    for (const std::string& file : exported) std::cout << (&file == &exported[0] ? "\nwritten: " : ", ") << file;
    if (!exported.empty()) std::cout << "\n";
  }
  std::cout.flush();
  if (result.differences.empty()) return kDone;
  spdlog::error("{}: particle {} under policy '{}' went ANOTHER WAY than the archive says: {}",
                arguments.request.archive, result.file.trace.particle, result.file.policy, result.differences.front());
  if (result.archived_info.results_version == results_version()) {
    const std::vector<std::string> built = build_differences(result.archived_info.build, build_facts());
    spdlog::error("the same results version must give the same bits: {}{}a faulty machine, or a changed archive",
                  controllers_trusted() ? "a controller that does not keep its promise ('graze check --determinism' "
                                          "tells), "
                                        : "",
                  built.empty()
                      ? ""
                      : fmt::format("another program ({}), ", printable(fmt::format("{}", fmt::join(built, "; ")))));
  }
  return kGateMissed;
}

}  // namespace

void add_replay(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ReplayArguments>();
  ReplayRequest& request = arguments->request;
  CLI::App* verb = add_verb(
      app, "replay", "Simulate one trace of an archive again, bit for bit, with everything at each step",
      "  graze replay quadruped_curb.graze --particle 17 --policy step/4cm\n"
      "  graze replay curb.h5 --particle 17 --policy step/4cm -o p17.h5      # state, commands, contacts, witnesses\n"
      "  graze replay curb.h5 --particle 17 --policy step/4cm -o p17.csv     # p17.csv, p17.contacts.csv, …\n"
      "  graze replay curb.h5 --particle 17 --policy step/4cm --view         # curb.p17.html, for a browser\n\n"
      "The scenario's files are taken from the archive. Exit code 1: the trace is not the archive's.\n"
      "'graze score ARCHIVE --failures' lists failed particles with their replay commands.\n");
  add_archive(*verb, request.archive);
  add_whole(*verb, "--particle", request.particle, 0, kParticleLimit - 1, "Which particle (0 is the first)")
      ->required();
  verb->add_option("--policy", request.policy, "Which policy; may be left out if there is one only");
  verb->add_option("-o,--output", arguments->output,
                   "Export every step: a file ending in .h5, or in .csv (with .contacts.csv, .events.csv, .phases.csv, "
                   ".parameters.csv, .derived.csv and .trace.csv beside it)");
  add_whole(*verb, "--every", request.every, 1, 1'000'000'000, "Export one of so many physics steps (default: 1)");
  verb->add_flag("--view", arguments->view,
                 "Also write the trace in three dimensions, the page of graze view: ARCHIVE with .pN.html");
  verb->add_flag("--force", arguments->force, "Replace existing files");
  verb->add_flag("--all", arguments->all,
                 "Print every parameter and event, and the particle's masses, inertias and lengths");
  verb->add_flag("--any-version", request.any_version, "Also if the archive is of another results version");
  verb->add_flag("--unverified", request.unverified, "Also a trace that the archive does not hold");
  add_trust(*verb);
  verb->add_flag("--json", arguments->json, "Print JSON");
  verb->callback([arguments, &action] {
    arguments->request.record = !arguments->output.empty();
    action = [arguments] { return in_reading_child({arguments->request.archive}, [&] { return replay(*arguments); }); };
  });
}

}  // namespace graze
