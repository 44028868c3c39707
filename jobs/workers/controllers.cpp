#include "jobs/workers/controllers.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>

#include "archive/files/utf8.h"
#include "engine/library/chances.h"
#include "engine/library/kept_place.h"
#include "engine/library/library_use.h"
#include "engine/library/meant_files.h"
#include "engine/library/python_use.h"
#include "jobs/workers/record_bytes.h"
#include "jobs/workers/worker_process.h"
#include "scenarios/robot_file.h"

namespace graze {
namespace {

std::atomic<bool> trusted{false}, distrusted{false}, prints_shown{false};
std::atomic<int> faults_told{0};
constexpr int kMostFaultsTold = 20;

/// What was printed, without a last line that says what `reason` says, such as that of a traceback.
std::string without_reason(const std::string& output, const std::string& reason) {
  const std::size_t last = output.find_last_not_of("\n\r ");
  if (last == std::string::npos) return "";
  const std::size_t before = output.rfind('\n', last);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  const std::string line = output.substr(begin, last + 1 - begin);
  return reason.find(line) == std::string::npos ? output : output.substr(0, begin);
}

/// "; it printed: …", or nothing, beside the `reason` that is told.
std::string printed_text(const std::string& printed, const std::string& reason) {
  constexpr std::size_t kShown = 2000;  // bytes, the last
  const std::string output = without_reason(printed, reason);
  if (output.empty()) return "";
  const std::size_t from = output.size() > kShown ? output.size() - kShown : 0;
  const std::size_t last = output.find_last_not_of("\n\r ");
  const std::string shown = output.substr(from, last == std::string::npos || last < from ? 0 : last + 1 - from);
  const bool several = shown.find('\n') != std::string::npos;  // such as a traceback of Python
  return fmt::format("; it printed:{}",
                     printable_message((several ? "\n" : " ") + std::string(from > 0 ? "…" : "") + shown));
}

/// Of faults at many times the first is told: " at 0.31 s" is no part of what a fault is.
std::string without_time(const std::string& reason) {
  constexpr std::string_view kAt = " at ", kUnit = " s";
  const std::size_t at = reason.find(kAt);
  if (at == std::string::npos) return reason;
  const std::size_t end = reason.find_first_not_of("-+.0123456789e", at + kAt.size());
  if (end == std::string::npos || end == at + kAt.size() || reason.compare(end, kUnit.size(), kUnit) != 0)
    return reason;
  return reason.substr(0, at) + reason.substr(end + kUnit.size());
}

/// Counts equal faults of a policy, which are told once. When the campaign is over it says how many there were.
class EqualFaults {
 public:
  EqualFaults() = default;
  ~EqualFaults() {
    for (auto& [fault, again] : again_) {
      if (again.empty()) continue;
      std::sort(again.begin(), again.end());  // not in the order in which threads met them
      constexpr std::size_t kNamed = 10;
      std::string ids;
      for (std::size_t i = 0; i < std::min(again.size(), kNamed); ++i) {
        ids += fmt::format("{}{}", i > 0 ? ", " : "", again[i]);
      }
      spdlog::warn("policy {}: the same in {} more trace{} (particle{} {}{}): {}", fault.first, again.size(),
                   again.size() == 1 ? "" : "s", again.size() == 1 ? "" : "s", ids, again.size() > kNamed ? ", …" : "",
                   printable(fault.second));
    }
  }
  EqualFaults(const EqualFaults&) = delete;
  EqualFaults& operator=(const EqualFaults&) = delete;

  /// Whether a fault is the first of its kind; of many kinds (as many as are told, and more) the later ones pass for
  /// new: a campaign may have a million particles with a fault at a time of its own each.
  bool is_new(const std::string& policy, const std::string& told, std::uint32_t particle) {
    constexpr std::size_t kMostKinds = 100;
    const std::string reason = without_time(told);
    const std::lock_guard lock(mutex_);
    if (again_.size() >= kMostKinds && again_.count({policy, reason}) == 0) return true;
    const auto [place, fresh] = again_.try_emplace({policy, reason});
    if (!fresh) place->second.push_back(particle);
    return fresh;
  }

 private:
  std::mutex mutex_;
  std::map<std::pair<std::string, std::string>, std::vector<std::uint32_t>> again_;  // particles after the first
};

/// What all processes of a campaign are briefed with.
struct Processes {
  std::string briefing;
  std::vector<std::string> names;   // of the policies
  std::vector<double> timeout;      // s, of each; NaN: it runs in this process
  std::vector<std::string> places;  // of each, where its library stands in the scenario
  double watchdog = 0;              // s
  mutable EqualFaults equal;
};

class ControllerRun : public RemoteRun {
 public:
  ControllerRun(std::shared_ptr<const Processes> processes, int policy)
      : processes_(std::move(processes)), policy_(static_cast<std::size_t>(policy)) {}

  /// Ends its process in order; what goes wrong there costs no particle.
  ~ControllerRun() override {
    try {
      const std::string problem = process_ ? process_->finish() : "";
      if (!problem.empty()) {
        tell("at its end", problem);
      } else if (prints_shown && process_) {
        const std::string printed = printed_text(process_->output(), "");
        if (!printed.empty()) spdlog::info("policy {}{}", processes_->names[policy_], printed);
      }
    } catch (const std::exception&) {  // no memory to tell it
    }
  }
  ControllerRun(const ControllerRun&) = delete;
  ControllerRun& operator=(const ControllerRun&) = delete;

  std::vector<TraceRecord> run(std::span<const Particle> particles, RunCost& cost) override {
    start();
    try {
      WorkerRequest request{processes_->names[policy_], {}};
      for (const Particle& particle : particles) request.particles.push_back(particle.id);
      return answer(process_->ask(request), request, cost);
    } catch (const MachineError&) {
      throw;
    } catch (const WorkerLost& lost) {
      if (particles.size() == 1) tell(particles.front().id, lost.what());
      throw LeftUnfinished(lost.what());
    } catch (const std::exception& error) {
      if (particles.size() == 1) tell(particles.front().id, error.what());
      throw;
    }
  }

 private:
  void start() {
    if (process_) return;
    try {
      process_ = with_chances<MachineError>([&] {
        return std::make_unique<WorkerProcess>(processes_->briefing,
                                               WorkerPatience{processes_->timeout[policy_], processes_->watchdog});
      });
    } catch (const InputError& refused) {
      throw LibraryRefused(
          fmt::format("{}: policy {}: {}", processes_->places[policy_], processes_->names[policy_], refused.what()));
    }
  }

  static std::vector<TraceRecord> answer(const WorkerMessage& word, const WorkerRequest& request, RunCost& cost) {
    switch (static_cast<WorkerWord>(word.kind)) {
      case WorkerWord::traces:
        return traces_of(word.bytes, request, cost);
      case WorkerWord::overtime:
        if (!word.bytes.empty()) throw WorkerLost(word.bytes);  // a call into Python
        throw Overtime{};
      case WorkerWord::machine:
      case WorkerWord::refusal:  // it was taken once: the library has been replaced, or create() fails now and then
        throw MachineError(word.bytes);
      case WorkerWord::fault:
        throw std::runtime_error(word.bytes);
      case WorkerWord::ready:
        break;
    }
    throw std::runtime_error("the controller's process sent what is no answer");
  }

  static std::vector<TraceRecord> traces_of(const std::string& bytes, const WorkerRequest& request, RunCost& cost) {
    std::uint64_t steps = 0;
    if (bytes.size() < sizeof steps) throw std::runtime_error("the controller's process sent no traces");
    std::memcpy(&steps, bytes.data(), sizeof steps);
    std::vector<TraceRecord> out = records_of(std::string_view(bytes).substr(sizeof steps), request.particles);
    cost.steps += steps;
    return out;
  }

  void tell(std::uint32_t particle, const std::string& reason) const {
    if (!processes_->equal.is_new(processes_->names[policy_], reason, particle)) return;
    tell(fmt::format("particle {}", particle), reason);
  }

  void tell(const std::string& when, const std::string& reason) const {
    const int told = faults_told++;
    if (told > kMostFaultsTold) return;
    if (told == kMostFaultsTold) {
      spdlog::warn(
          "controllers have failed more often; 'graze score ARCHIVE' counts the invalid traces, and 'graze status' "
          "tells "
          "what is unfinished");
      return;
    }
    spdlog::warn("policy {}, {}: {}{}", processes_->names[policy_], when, printable(reason),
                 process_ ? printed_text(process_->output(), reason) : "");
  }

  const std::shared_ptr<const Processes> processes_;
  const std::size_t policy_;
  std::unique_ptr<WorkerProcess> process_;
};

/// The library of each policy; nothing for policies of our own.
std::vector<std::optional<LibraryUse>> libraries_of(const Scenario& scenario) {
  std::vector<std::optional<LibraryUse>> out;
  for (const PolicySpec& policy : scenario.policies) out.push_back(library_use(policy.settings));
  return out;
}

/// Warns, once, if an archive was made by another Python than the one that would go on.
void check_environment(const LibraryUse& use) {
  static std::atomic<bool> told{false};
  if (!use.is_python() || use.environment.empty()) return;
  const std::string now = python_environment(use.interpreter);
  if (now.empty() || now == use.environment || told.exchange(true)) return;
  spdlog::warn("{}: {} runs it now, and {} when the scenario was read: results may differ in their last bits", use.file,
               printable(now), printable(use.environment));
}

/// Throws InputError unless every library is trusted and the one that was meant. Returns whether there are any.
bool check_libraries(const std::vector<std::optional<LibraryUse>>& libraries) {
  bool any = false;
  for (const auto& use : libraries) {
    if (!use) continue;
    any = true;
    if (!trusted) {
      use->place.at("file").fail(
          fmt::format("{}: is code that would run with your rights, and no code that a scenario names runs unless you "
                      "say so: --trust",
                      use->file));
    }
    check_library_file(*use);
    check_environment(*use);
  }
  return any;
}

std::shared_ptr<const Processes> processes_of(const Scenario& scenario,
                                              const std::vector<std::optional<LibraryUse>>& libraries,
                                              std::uint64_t seed, std::uint64_t particles, double watchdog) {
  auto out = std::make_shared<Processes>();
  out->watchdog = watchdog;
  out->briefing =
      WorkerBriefing{scenario.source, scenario_kind(scenario), scenario.recording, seed, particles, watchdog}.to_text();
  for (std::size_t i = 0; i < libraries.size(); ++i) {
    out->names.push_back(scenario.policies[i].name);
    out->places.push_back(libraries[i] ? libraries[i]->place.key_place() : "");
    out->timeout.push_back(libraries[i] && libraries[i]->isolated ? libraries[i]->timeout : std::nan(""));
  }
  return out;
}

/// SHA-256 of the controllers' files as they were when the scenario was read, or as its archive keeps them.
std::map<std::string, std::string> sums_of(const ScenarioSource& source) {
  constexpr std::string_view kEnding = ".sha256";
  std::map<std::string, std::string> out;
  for (const auto& [name, content] : source.inputs) {
    if (name.ends_with(kEnding)) out[name.substr(0, name.size() - kEnding.size())] = content;
  }
  return out;
}

/// What libraries in this process are told of the robot. Standard input is there once.
void brief_here(const Scenario& scenario) {
  keep_place();
  const ScenarioSource& source = scenario.source;
  mean_library_files(sums_of(source));
  brief_libraries(source.file == kStandardInput ? ""
                                                : robot_document(Settings::load(source.file, source.options.overrides),
                                                                 source.options.ignore_missing_meshes, source.folder));
}

}  // namespace

void trust_controllers() {
  trusted = true;
  allow_interpreters();
}
bool controllers_trusted() { return trusted; }
void show_prints() { prints_shown = true; }
void distrust_controllers() {
  trusted = false;
  distrusted = true;
}
bool controllers_distrusted() { return distrusted; }

void try_controllers(const Scenario& scenario) {
  const auto libraries = libraries_of(scenario);
  if (!check_libraries(libraries)) return;
  constexpr double kFrozen = 60;  // s: nobody has named a limit here
  const auto processes = processes_of(scenario, libraries, scenario.seed, scenario.particles, 0);
  for (std::size_t i = 0; i < libraries.size(); ++i) {
    if (!libraries[i]) continue;
    std::optional<WorkerProcess> process;
    WorkerMessage word{};
    try {
      process.emplace(processes->briefing, WorkerPatience{libraries[i]->timeout, kFrozen});
      word = process->ask({processes->names[i], {}});
    } catch (const WorkerDied& end) {
      libraries[i]->place.at("file").fail(fmt::format("{}: {}{}", libraries[i]->file, end.what(),
                                                      process ? printed_text(process->output(), end.what()) : ""));
    }
    const std::string problem = process->finish();
    if (!problem.empty()) spdlog::warn("policy {}: {}", processes->names[i], printable(problem));
    if (word.kind == static_cast<char>(WorkerWord::traces)) continue;
    if (word.kind == static_cast<char>(WorkerWord::machine)) throw MachineError(word.bytes);
    throw InputError(printable(word.bytes) + printed_text(process->output(), word.bytes));
  }
}

RunElsewhere controllers_elsewhere(const Scenario& scenario, std::uint64_t seed, std::uint64_t particles,
                                   double watchdog) {
  const auto libraries = libraries_of(scenario);
  if (!check_libraries(libraries)) return {};
  prepare_controllers_here(scenario);
  return [processes = processes_of(scenario, libraries, seed, particles, watchdog)](int policy) {
    const bool here = std::isnan(processes->timeout[static_cast<std::size_t>(policy)]);
    return here ? nullptr : std::make_unique<ControllerRun>(processes, policy);
  };
}

bool runs_elsewhere(const PolicySpec& policy) { return is_isolated(policy.settings); }

void prepare_controllers_here(const Scenario& scenario) {
  const auto libraries = libraries_of(scenario);
  const bool any = std::any_of(libraries.begin(), libraries.end(), [](const auto& use) { return use.has_value(); });
  if (!any || !trusted) return;
  brief_here(scenario);
  if (libraries_allowed() == LibraryLoading::refused) allow_libraries(LibraryLoading::in_process);
}

void load_controllers_here(const Scenario& scenario) {
  if (!check_libraries(libraries_of(scenario))) return;
  brief_here(scenario);
  allow_libraries(LibraryLoading::all);
}

}  // namespace graze
