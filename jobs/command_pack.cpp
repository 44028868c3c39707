// graze pack: makes one file of a campaign directory.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>

#include "archive/archive.h"
#include "jobs/commands.h"

namespace graze {
namespace {

struct Arguments {
  std::vector<std::string> directories;
  std::string output;
  bool force = false;
};

int pack_campaign(const Arguments& arguments) {
  namespace fs = std::filesystem;
  std::vector<fs::path> directories;
  for (const fs::path directory : arguments.directories) {
    directories.push_back(directory.has_filename() ? directory : directory.parent_path());  // "curb.graze/"
  }
  if (directories.size() > 1 && arguments.output.empty()) {
    throw InputError("pack: several parts make one file: name it with -o FILE.h5");
  }
  const fs::path file =
      arguments.output.empty() ? fs::path(directories[0]).replace_extension(".h5") : fs::path(arguments.output);
  if (directories.size() > 1) {
    pack(directories, file, arguments.force);
  } else {
    pack(directories[0], file, arguments.force);
  }
  std::cout << fmt::format("{}: {:.1f} kB\n", file.string(), static_cast<double>(fs::file_size(file)) / 1e3);
  return kDone;
}

}  // namespace

void add_pack(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = add_verb(app, "pack", "Make one HDF5 file of a campaign directory",
                            "  graze pack quadruped_curb.graze\n"
                            "  graze pack quadruped_curb.graze -o curb.h5 --force\n"
                            "  graze pack curb.parts/* -o curb.h5      # what the jobs of an array have written\n");
  verb->add_option("directory", arguments->directories,
                   "Campaign directory, as written by graze run; or all those of graze run --part")
      ->required();
  verb->add_option("-o,--output", arguments->output, "The file (default: DIRECTORY with .h5)");
  verb->add_flag("--force", arguments->force, "Replace the file if it exists");
  verb->callback([arguments, &action] { action = [arguments] { return pack_campaign(*arguments); }; });
}

}  // namespace graze
