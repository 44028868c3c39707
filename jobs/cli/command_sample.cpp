// graze sample: writes the particles as CSV without simulating.
#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <unordered_set>

#include "archive/archive.h"
#include "archive/files/csv.h"
#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/utf8.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "simulation/particles.h"

namespace graze {
namespace {

struct SampleArguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  std::string output = "-";
  std::vector<std::string> particles;  // empty: all
  bool derived = false, force = false;
};

/// Standard output, a pipe that the user names, or a file that appears whole; every write is checked, so that a full
/// disk is told.
class Output {
 public:
  Output(const std::string& name, bool file, bool force) : name_(name) {
    if (file) file_.emplace(name, force);
    if (file || name == "-") return;
    stream_ = Descriptor(open(name.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK));  // else it waits for a reader, forever
    if (!stream_ && errno == ENXIO) {
      throw InputError(
          fmt::format("{}: is a pipe that nobody reads; start its reader first, or choose another --output", name));
    }
    if (!stream_) fail_writing(name, errno);
    fcntl(stream_.number(), F_SETFL, fcntl(stream_.number(), F_GETFL) & ~O_NONBLOCK);  // writing may wait
  }
  void write(const std::string& text) {
    buffer_ += text;
    if (buffer_.size() > kBuffer) flush();
  }
  void close() {
    flush();
    if (file_) file_->publish();
  }

 private:
  static constexpr std::size_t kBuffer = std::size_t{1} << 16;
  /// Names may be of any bytes: a terminal gets them escaped, files and other programs as they are.
  void flush() {
    const int to = file_ ? file_->descriptor() : stream_ ? stream_.number() : STDOUT_FILENO;
    if (isatty(to) != 0) buffer_ = printable_lines(buffer_);
    const int error = write_all(to, std::as_bytes(std::span(buffer_)));
    if (error == EBADF && name_ == "-") throw MachineError("standard output: cannot be written");  // it was closed
    if (error != 0) fail_writing(name_ == "-" ? "standard output" : name_, error);
    buffer_.clear();
  }
  const std::string name_;
  std::optional<NewFile> file_;
  Descriptor stream_;
  std::string buffer_;
};

/// In the order in which they were asked for, each once.
std::vector<std::uint32_t> chosen_particles(const std::vector<std::string>& texts, const Scenario& scenario) {
  std::vector<std::uint32_t> out;
  std::unordered_set<std::uint32_t> seen;
  for (const std::string& text : texts) {
    const auto particle = static_cast<std::uint32_t>(parse_whole(text, "--particle", 0, scenario.particles - 1));
    if (seen.insert(particle).second) out.push_back(particle);
  }
  return out;
}

std::string head(const Scenario& scenario, const ParticleSource& source, bool derived) {
  std::string line = "particle";
  if (!derived) {
    for (const UncertainParameter& parameter : scenario.space.parameters) line += "," + csv_cell(parameter.name);
    return line;
  }
  for (const Derived& one : source.nominal_derived()) {
    line += "," + csv_cell(one.name + (one.unit == "1" ? "" : " [" + one.unit + "]"));
  }
  return line;
}

std::string value_cells(const Scenario& scenario, const std::vector<double>& values) {
  std::string line;
  for (int k = 0; k < scenario.space.size(); ++k) {
    const auto& labels = scenario.space.parameters[k].labels;
    line +=
        labels.empty() ? fmt::format(",{}", values[k]) : "," + csv_cell(labels.at(static_cast<std::size_t>(values[k])));
  }
  return line;
}

/// What fabrication makes of a particle; empty cells for one that it refuses, with a warning.
std::string derived_cells(const ParticleSource& source, std::uint32_t particle, const std::vector<double>& values) {
  std::string line;
  try {
    for (const Derived& one : source.derived(values)) line += fmt::format(",{}", one.value);
  } catch (const InputError& error) {
    spdlog::warn("particle {} cannot be fabricated: {}", particle, error.what());
    line.assign(source.nominal_derived().size(), ',');
  }
  return line;
}

int sample(const SampleArguments& arguments) {
  Scenario scenario = arguments.scenario.load();
  arguments.draw.apply_to(scenario);
  namespace fs = std::filesystem;
  const bool file =
      arguments.output != "-" && (fs::is_regular_file(arguments.output) || !fs::exists(arguments.output));  // no pipe
  if (file) check_new_file(arguments.output, arguments.force, files_of(scenario));
  if (file) check_ending(arguments.output, "particles are written as CSV", {".csv", ".txt"});
  const std::vector<std::uint32_t> particles = chosen_particles(arguments.particles, scenario);
  const ParticleSource source(scenario, scenario.seed, scenario.particles);
  const ParentFolders folders(arguments.output);
  Output out(arguments.output, file, arguments.force);
  out.write(head(scenario, source, arguments.derived) + "\n");
  const std::uint64_t count = particles.empty() ? scenario.particles : particles.size();
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint32_t particle = particles.empty() ? static_cast<std::uint32_t>(i) : particles[i];
    const std::vector<double> values = source.draw(particle);
    out.write(std::to_string(particle) +
              (arguments.derived ? derived_cells(source, particle, values) : value_cells(scenario, values)) + "\n");
  }
  out.close();
  return kDone;
}

}  // namespace

void add_sample(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<SampleArguments>();
  CLI::App* verb = add_verb(app, "sample", "Write the particles as CSV without simulating",
                            "  graze sample data/scenarios/quadruped_curb.yaml -n 1000 -o particles.csv\n"
                            "  graze sample my.yaml -n 5 --seed 7 --set sampling.design=sobol\n"
                            "  graze sample my.yaml --derived --particle 17   # its masses, inertias, lengths, feet\n");
  arguments->scenario.add_to(*verb);
  arguments->draw.add_to(*verb);
  verb->add_option("-o,--output", arguments->output, "CSV file; - for standard output")->capture_default_str();
  verb->add_flag(
      "--derived", arguments->derived,
      "Instead of the parameters what fabrication makes of them: masses, centres of mass, inertias, lengths, "
      "where joints and links are");
  verb->add_option("--particle", arguments->particles,
                   "Only this particle (0 is the first); may be repeated, and each is written once")
      ->type_name("NUMBER")
      ->allow_extra_args(false);
  verb->add_flag("--force", arguments->force, "Replace the file if it exists");
  verb->callback([arguments, &action] { action = [arguments] { return sample(*arguments); }; });
}

}  // namespace graze
