// graze pack: makes one file of a campaign directory.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <iostream>
#include <memory>

#include "archive/archive.h"
#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/outcomes.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/reading_verb.h"

namespace graze {
namespace {

struct PackArguments {
  std::vector<std::string> directories;
  std::string output;
  bool force = false;
};

/// A file cannot be resumed: users must know before they remove the directory.
void warn_if_incomplete(const std::filesystem::path& file) {
  const Archive archive(file);
  if (archive.complete()) return;
  const CampaignInfo& info = archive.info();
  std::uint64_t traces = 0;
  for (const std::string& policy : info.policies) traces += count_traces(archive, policy);
  spdlog::warn("{}: holds {} of {} traces: the campaign is not complete", file.string(), traces,
               info.particles * info.policies.size());
}

int pack_campaign(const PackArguments& arguments) {
  namespace fs = std::filesystem;
  std::vector<fs::path> directories;
  for (const fs::path directory : arguments.directories) {
    if (fs::is_regular_file(directory) && ending_of(directory) != ".h5" && ending_of(directory) != ".hdf5") {
      throw InputError(
          fmt::format("{}: is a file; pack takes campaign directories, which graze run writes", directory.string()));
    }
    directories.push_back(directory.has_filename() ? directory : directory.parent_path());  // "curb.graze/"
  }
  if (directories.size() > 1 && arguments.output.empty()) {
    throw InputError("pack: several parts make one file: name it with -o FILE.h5");
  }
  const fs::path file =
      arguments.output.empty() ? fs::path(directories[0]).replace_extension(".h5") : fs::path(arguments.output);
  check_ending(file, "a packed campaign is one HDF5 file", {".h5", ".hdf5"}, Endings::needed);
  const ParentFolders folders(file);
  warn(directories.size() > 1 ? pack(directories, file, arguments.force) : pack(directories[0], file, arguments.force));
  warn_if_incomplete(file);
  std::cout << fmt::format("{}: {:.1f} kB\n", file.string(), static_cast<double>(fs::file_size(file)) / 1e3);
  return kDone;
}

}  // namespace

void add_pack(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<PackArguments>();
  CLI::App* verb = add_verb(app, "pack", "Make one HDF5 file of a campaign directory",
                            "  graze pack quadruped_curb.graze\n"
                            "  graze pack quadruped_curb.graze -o curb.h5 --force\n"
                            "  graze pack curb.parts/* -o curb.h5      # what the jobs of an array have written\n");
  verb->add_option("directory", arguments->directories,
                   "Campaign directory, as written by graze run; or all those of graze run --part")
      ->required();
  verb->add_option("-o,--output", arguments->output, "The file (default: DIRECTORY with .h5)");
  verb->add_flag("--force", arguments->force, "Replace the file if it exists");
  verb->callback([arguments, &action] {
    action = [arguments] {
      constexpr double kSecondsPerMegabyte = 1;  // it compresses, too
      return in_reading_child(
          arguments->directories, [&] { return pack_campaign(*arguments); }, kSecondsPerMegabyte);
    };
  });
}

}  // namespace graze
