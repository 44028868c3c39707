// graze sample: writes the particles as CSV without simulating.
#include <fmt/format.h>
#include <fmt/os.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "archive/archive.h"
#include "archive/files.h"
#include "archive/parent_folders.h"
#include "jobs/commands.h"

namespace graze {
namespace {

struct Arguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  std::string output = "-";
  bool force = false;
};

/// stdout or a file; every write is checked, so that a full disk is told.
class Output {
 public:
  explicit Output(const std::string& name) : name_(name), file_(name == "-" ? stdout : std::fopen(name.c_str(), "w")) {
    if (!file_) fail();
  }
  ~Output() {
    if (file_ && file_ != stdout) std::fclose(file_);
  }
  void write(const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail();
  }
  void close() {
    if (std::fflush(file_) != 0) fail();
  }

 private:
  [[noreturn]] void fail() const { fail_writing(name_ == "-" ? "standard output" : name_, errno); }
  std::string name_;
  std::FILE* file_;
};

int sample(const Arguments& arguments) {
  Scenario scenario = arguments.scenario.load();
  arguments.draw.apply_to(scenario);
  namespace fs = std::filesystem;
  const bool regular = fs::is_regular_file(arguments.output) || !fs::exists(arguments.output);  // no pipe
  if (arguments.output != "-" && regular) check_new_file(arguments.output, arguments.force, {scenario.file});
  const Sampler sampler(scenario.space, scenario.design, scenario.seed, scenario.particles);
  const ParentFolders folders(arguments.output);
  Output out(arguments.output);
  std::string line = "particle";
  for (const UncertainParameter& parameter : scenario.space.parameters) line += "," + parameter.name;
  out.write(line + "\n");
  for (std::uint64_t i = 0; i < scenario.particles; ++i) {
    const std::vector<double> values = sampler.draw(static_cast<std::uint32_t>(i));
    line = std::to_string(i);
    for (int k = 0; k < scenario.space.size(); ++k) {
      const auto& labels = scenario.space.parameters[k].labels;
      line += labels.empty() ? fmt::format(",{}", values[k]) : "," + labels.at(static_cast<std::size_t>(values[k]));
    }
    out.write(line + "\n");
  }
  out.close();
  return kDone;
}

}  // namespace

void add_sample(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = add_verb(app, "sample", "Write the particles as CSV without simulating",
                            "  graze sample data/scenarios/quadruped_curb.yaml -n 1000 -o particles.csv\n"
                            "  graze sample my.yaml -n 5 --seed 7 --set sampling.design=sobol\n");
  arguments->scenario.add_to(*verb);
  arguments->draw.add_to(*verb);
  verb->add_option("-o,--output", arguments->output, "CSV file; - for standard output")->capture_default_str();
  verb->add_flag("--force", arguments->force, "Replace the file if it exists");
  verb->callback([arguments, &action] { action = [arguments] { return sample(*arguments); }; });
}

}  // namespace graze
