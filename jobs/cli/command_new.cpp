// graze new: a first scenario for a robot that has none, or a first folder: a scenario with a shipped robot, or a
// controller of one's own.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <span>
#include <vector>

#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "engine/model/urdf.h"
#include "engine/settings/similar.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/shipped.h"
#include "jobs/workers/first_folder.h"
#include "scenarios/proposal.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct NewArguments {
  std::string file, urdf;
  bool repair = false, ignore_missing_meshes = false, force = false;
};

/// The robot's file as a scenario at `file` names it: relative to it, unless the way there leads over the root.
std::string named_from(const fs::path& file, const fs::path& urdf) {
  const fs::path folder = fs::weakly_canonical(fs::absolute(file).parent_path()), robot = fs::weakly_canonical(urdf);
  const fs::path relative = robot.lexically_relative(folder);
  const auto up = std::count(relative.begin(), relative.end(), fs::path(".."));
  const bool over_root = relative.empty() || up + 1 >= std::distance(folder.begin(), folder.end());
  return (over_root ? robot : relative).string();
}

/// Refuses what cannot be meant, before the robot's meshes are read.
void check_arguments(const NewArguments& arguments) {
  const std::string robot_ending = ending_of(arguments.urdf);
  const bool robot_first = is_robot_file(arguments.file),
             scenario_last = robot_ending == ".yaml" || robot_ending == ".yml";
  const std::string file = shell_path(arguments.file), urdf = shell_path(arguments.urdf);
  if (robot_first && scenario_last) {
    throw InputError(
        fmt::format("new: the scenario that is to be written goes first, then the robot: graze new {} {}", urdf, file));
  }
  if (scenario_last) {
    throw InputError(
        fmt::format("{}: is a scenario by its name, where the robot belongs; name its URDF: graze new {} ROBOT.urdf",
                    arguments.urdf, file));
  }
  if (robot_first && !is_robot_file(arguments.urdf)) {
    throw InputError(fmt::format(
        "new: the scenario that is to be written goes first, then the robot: graze new {} {}",
        shell_path(robot_ending.empty() ? arguments.urdf + ".yaml" : scenario_of_robot(arguments.file)), file));
  }
  if (robot_first || arguments.file == "-") {
    throw InputError(fmt::format("{}: {}; nearest right answer: graze new {} {}", arguments.file,
                                 robot_first
                                     ? "is a robot by its name, where the scenario belongs that is to be written"
                                     : "a scenario is written to a file, not to standard output",
                                 shell_path(scenario_of_robot(arguments.urdf)), urdf));
  }
  check_ending(arguments.file, "a scenario is written as YAML", {".yaml", ".yml"}, Endings::needed, NamedBy::word);
  check_new_file(arguments.file, arguments.force, {fs::path(arguments.urdf)}, NamedBy::word);
  if (const std::string problem = cannot_make(arguments.file); !problem.empty()) {
    throw MachineError(
        fmt::format("{}: cannot be written: {}; name a place where you may write", arguments.file, problem));
  }
}

bool is_folder(const std::string& name) {
  const std::vector<std::string>& names = first_folders();
  return std::find(names.begin(), names.end(), name) != names.end();
}

int make_folder(const NewArguments& arguments) {
  if (arguments.repair || arguments.ignore_missing_meshes || arguments.force) {
    throw InputError(fmt::format("new {}: --repair, --ignore-missing-meshes and --force are for scenarios of robots",
                                 arguments.file));
  }
  write_first_folder(arguments.file, arguments.urdf, data_folder());
  const std::string folder = shell_path(arguments.urdf);
  if (!is_first_controller(arguments.file)) {
    std::cout << fmt::format("{0}: a robot, and a scenario to change:\n  cd {0} && graze run scenario.yaml\n", folder);
    return kDone;
  }
  const bool compiled = fs::exists(fs::path(arguments.urdf) / "Makefile");
  std::cout << fmt::format(
      "{0}: a controller, and a scenario that judges it:\n  cd {0} && {1}graze run scenario.yaml --trust\n", folder,
      compiled ? "make && " : "");
  return kDone;
}

int make_scenario(const NewArguments& arguments) {
  const bool folder = is_folder(arguments.file);
  if (arguments.urdf.empty()) {
    throw InputError(folder ? fmt::format("new {0}: the folder to write is missing; nearest right answer: graze new "
                                          "{0} my_{1}",
                                          arguments.file,
                                          is_first_controller(arguments.file) ? "controller" : arguments.file)
                            : "new: robot is required; 'graze new --help' tells more");
  }
  if (folder) return make_folder(arguments);
  if (ending_of(arguments.file).empty() && ending_of(arguments.urdf).empty()) {
    throw InputError(
        fmt::format("new {}: there is no such template{}; a scenario that is to be written ends in .yaml, "
                    "its robot in .urdf",
                    arguments.file, similar_names(arguments.file, first_folders(), false)));
  }
  check_arguments(arguments);
  // Read on its own, so that what is wrong with it is not told of a scenario that is not there yet. It stays, since
  // the hulls of its meshes are kept as long as somebody has them.
  UrdfOptions options;
  options.repair = arguments.repair;
  options.ignore_missing_meshes = arguments.ignore_missing_meshes;
  std::vector<std::string> warnings;
  const auto keep = [&](const std::string& warning) { warnings.push_back(warning); };
  options.warn = keep;
  const Robot robot = load_urdf(arguments.urdf, options);
  const std::string text = propose_scenario({named_from(arguments.file, arguments.urdf), arguments.file,
                                             arguments.repair, arguments.ignore_missing_meshes, keep});
  warn(warnings);
  const ParentFolders folders(arguments.file);
  NewFile file(arguments.file, arguments.force);
  if (const int error = write_all(file.descriptor(), std::as_bytes(std::span(text)))) {
    fail_writing(arguments.file, error);
  }
  file.publish();
  std::cout << fmt::format("{0}: simulate it by\n  graze run {0}{1}\n", shell_path(arguments.file),
                           arguments.ignore_missing_meshes ? " --ignore-missing-meshes" : "");
  return kDone;
}

}  // namespace

void add_new(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<NewArguments>();
  CLI::App* verb = add_verb(
      app, "new",
      "Write a first scenario for a robot: dropped, held and, on four legs, trotting; or a folder with a shipped "
      "robot or a first controller",
      "  graze new my.yaml my_robot.urdf && graze run my.yaml\n"
      "  graze new my.yaml broken.urdf --repair\n"
      "  graze new quadruped my_walk    # a quadruped that stands and trots, in the new folder my_walk\n"
      "  graze new arm my_arm           # an arm of six joints that carries a load to and fro\n"
      "  graze new policy-c my_walk     # a controller in C, in the new folder my_walk\n"
      "  graze new policy-cpp my_walk   # the same in C++\n"
      "  graze new policy-python my_walk\n");
  verb->add_option("scenario", arguments->file,
                   "Scenario file to write (.yaml); or a template: quadruped, arm, or a controller of your own, "
                   "policy-c, policy-cpp, policy-python")
      ->required()
      ->type_name("SCENARIO");
  verb->add_option("robot", arguments->urdf, "The robot (.urdf); of a template: the folder to write")
      ->type_name("URDF");
  verb->add_flag("--repair", arguments->repair, "Mend what can be mended in the URDF: robot.repair");
  verb->add_flag("--ignore-missing-meshes", arguments->ignore_missing_meshes,
                 "Go on without collision meshes whose file is not there");
  verb->add_flag("--force", arguments->force, "Replace the scenario file if it exists");
  verb->callback([arguments, &action] { action = [arguments] { return make_scenario(*arguments); }; });
}

}  // namespace graze
