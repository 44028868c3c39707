// graze examples: what comes with the program, and a copy of it to change.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <span>

#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/description_text.h"
#include "jobs/cli/shipped.h"
#include "jobs/cli/wrapped_text.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct ExamplesArguments {
  std::string name, folder;
};

/// The folder of scenarios and robots; throws MachineError if it was not found.
fs::path shipped_folder() {
  const fs::path folder = data_folder();
  if (shipped_scenarios().empty()) {
    throw MachineError(
        fmt::format("{}no examples were found; the environment variable GRAZE_DATA names the folder that "
                    "holds scenarios/ and robots/",
                    folder.empty() ? "" : folder.string() + ": "));
  }
  return folder;
}

std::string whole_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Of a scenario: its description, else its name. One that cannot be read is listed all the same.
std::string scenario_line(const std::string& name) {
  try {
    const Settings scenario = Settings::load((data_folder() / "scenarios" / (name + ".yaml")).string());
    return scenario.text_or("description", scenario.text_or("name", ""));
  } catch (const InputError&) {
    return "";
  }
}

/// The beginning of a robot's first comment: what it is, up to the first sign of punctuation that ends a thought.
std::string robot_line(const fs::path& urdf) {
  const std::string text = whole_text(urdf);
  const std::size_t begin = text.find("<!--"), end = text.find("-->", begin);
  if (end == std::string::npos) return "";
  constexpr std::size_t kMark = 4;  // "<!--"
  const std::vector<std::string> lines = lines_of(text.substr(begin + kMark, end - begin - kMark), kUnlimited);
  std::string out = fmt::format("{}", fmt::join(lines, " "));
  std::replace(out.begin(), out.end(), '\n', ' ');
  for (const char* sign : {". ", ": ", " (", "; "}) out = out.substr(0, out.find(sign));
  return out.substr(std::min(out.find_first_not_of(' '), out.size()));
}

/// Files of robots, sorted.
std::vector<std::string> shipped_robots() {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(data_folder() / "robots", error)) {
    if (is_robot_file(entry.path().string())) out.push_back(entry.path().filename().string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

int list_examples() {
  const fs::path folder = shipped_folder();
  const std::size_t width = output_width();
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& name : shipped_scenarios()) rows.emplace_back(name, scenario_line(name));
  std::string scenarios =
      list_text("Scenarios, which graze run and all other verbs take by their names:", rows, "", width);
  scenarios.erase(scenarios.find_last_not_of('\n') + 1);
  std::cout << scenarios << "\n\n";
  rows.clear();
  for (const std::string& name : shipped_robots()) rows.emplace_back(name, robot_line(folder / "robots" / name));
  std::cout << list_text(
      "Robots:", rows,
      fmt::format("graze examples NAME copies one, with all that it needs, into a folder of your own. "
                  "The files: {}",
                  folder.string()),
      width);
  return kDone;
}

/// What is to be copied: contents by names relative to the new folder, and the command to try it by.
struct Copy {
  InputFiles files;
  std::string next;
};

/// A scenario with the files that are read with it, in the folders that they have among the shipped ones, so that their
/// names within the files stay right.
Copy copy_of_scenario(const std::string& name) {
  const fs::path shipped = fs::absolute(shipped_folder()).lexically_normal();
  const fs::path file = shipped / "scenarios" / (name + ".yaml");
  Copy out;
  for (const auto& [path, content] : load_scenario(file.string()).source.inputs) {
    if (!fs::path(path).is_absolute()) continue;  // no file: a variable, or what was derived from files
    const fs::path within = fs::path(path).lexically_relative(shipped);
    if (within.empty() || *within.begin() == "..") {
      throw MachineError(fmt::format("{}: {} is outside of {}, so that a copy would not be whole", file.string(), path,
                                     shipped.string()));
    }
    out.files[within.string()] = content;
  }
  out.next = fmt::format("graze run scenarios/{}.yaml", name);
  return out;
}

Copy copy_of_robot(const std::string& name) {
  Copy out;
  out.files[name] = whole_text(shipped_folder() / "robots" / name);
  out.next = fmt::format("graze new first.yaml {} && graze run first.yaml", name);
  return out;
}

Copy copy_of(const std::string& name) {
  shipped_folder();
  const std::vector<std::string> scenarios = shipped_scenarios(), robots = shipped_robots();
  const auto among = [](const std::vector<std::string>& all, const std::string& one) {
    return std::find(all.begin(), all.end(), one) != all.end();
  };
  const std::string scenario = name.ends_with(".yaml") ? fs::path(name).stem().string() : name;
  if (among(scenarios, scenario)) return copy_of_scenario(scenario);
  for (const std::string& robot : {name, name + ".urdf"}) {
    if (among(robots, robot)) return copy_of_robot(robot);
  }
  std::vector<std::string> all = scenarios;
  all.insert(all.end(), robots.begin(), robots.end());
  const std::string near = nearest(name, all);
  throw InputError(fmt::format("examples: there is no '{}'{}; 'graze examples' lists them", clipped(name, 80),
                               near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near)));
}

void check_new_folder(const fs::path& folder) {
  std::error_code error;
  const bool there = fs::exists(fs::symlink_status(folder, error));
  if (there && !(fs::is_directory(folder, error) && fs::is_empty(folder, error))) {
    throw InputError(fmt::format("{}: exists already; name a folder that is new, or empty", folder.string()));
  }
  if (const std::string problem = cannot_make(folder / "x"); !problem.empty()) {
    throw MachineError(
        fmt::format("{}: cannot be written: {}; name a place where you may write", folder.string(), problem));
  }
}

void write_new_file(const fs::path& path, const std::string& content) {
  const ParentFolders folders(path);
  NewFile file(path, false);
  if (const int error = write_all(file.descriptor(), std::as_bytes(std::span(content)))) fail_writing(path, error);
  file.publish();
}

int copy_example(const ExamplesArguments& arguments) {
  const Copy copy = copy_of(arguments.name);
  const fs::path folder = arguments.folder.empty() ? fs::path(arguments.name).stem() : fs::path(arguments.folder);
  check_new_folder(folder);
  for (const auto& [name, content] : copy.files) write_new_file(folder / name, content);
  const std::string shown = shell_path(folder.string());
  std::cout << shown << ":\n";
  for (const auto& [name, content] : copy.files) std::cout << "  " << name << "\n";
  std::cout << fmt::format("Try it by\n  cd {} && {}\n", shown, copy.next);
  return kDone;
}

}  // namespace

void add_examples(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ExamplesArguments>();
  CLI::App* verb =
      add_verb(app, "examples", "List the scenarios and robots that come with the program, or copy one",
               "  graze examples\n"
               "  graze examples quadruped_curb              # into the new folder quadruped_curb\n"
               "  graze examples quadruped_curb my_curb && cd my_curb && graze run scenarios/quadruped_curb.yaml\n"
               "  graze examples links.urdf robot            # a robot alone\n");
  verb->add_option("name", arguments->name, "What to copy; left out: list what there is")->type_name("NAME");
  verb->add_option("folder", arguments->folder, "Into which folder, new or empty (default: NAME)")->type_name("FOLDER");
  verb->callback([arguments, &action] {
    action = [arguments] { return arguments->name.empty() ? list_examples() : copy_example(*arguments); };
  });
}

}  // namespace graze
