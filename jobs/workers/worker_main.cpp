#include "jobs/workers/worker_main.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <new>
#include <string_view>
#include <thread>

#include "engine/library/library_use.h"
#include "jobs/workers/record_bytes.h"
#include "jobs/workers/worker_channel.h"
#include "scenarios/robot_file.h"
#include "simulation/block_run.h"
#include "simulation/particles.h"
#include "simulation/watchdog.h"

namespace graze {
namespace {

/// What is to be said when something has been thrown.
WorkerMessage word_of(const std::exception_ptr& thrown) {
  const auto word = [](WorkerWord kind, const char* text) { return WorkerMessage{static_cast<char>(kind), text}; };
  try {
    std::rethrow_exception(thrown);
  } catch (const Overtime&) {
    return word(WorkerWord::overtime, "");
  } catch (const CallLost& lost) {
    return word(WorkerWord::overtime, lost.what());
  } catch (const MachineError& error) {
    return word(WorkerWord::machine, error.what());
  } catch (const InputError& error) {
    return word(WorkerWord::refusal, error.what());
  } catch (const std::bad_alloc&) {
    return word(WorkerWord::fault, "no memory is left in the controller's process, which may take 4 GiB");
  } catch (const std::exception& error) {
    return word(WorkerWord::fault, error.what());
  } catch (...) {
    return word(WorkerWord::fault, "an exception of unknown type");
  }
}

/// The scenario as the parent has read it. No library is loaded for that.
Scenario read_again(const WorkerBriefing& briefing) {
  Scenario scenario = reload_scenario(briefing.source);
  if (scenario_kind(scenario) != briefing.kind) {
    throw InputError(
        "this command changes the scenario after reading it, which the process of a controller cannot; say isolation: "
        "none");
  }
  scenario.recording = briefing.recording;
  scenario.seed = briefing.seed;
  const auto& source = briefing.source;
  brief_libraries(robot_document(Settings::load(source.file, source.options.overrides),
                                 source.options.ignore_missing_meshes, source.folder));
  return scenario;
}

class Worker {
 public:
  explicit Worker(const WorkerBriefing& briefing)
      : inputs_(briefing.source.inputs, briefing.source.folder),
        scenario_(read_again(briefing)),
        source_(scenario_, briefing.seed, briefing.particles),
        watchdog_(briefing.watchdog) {
    watchdog_.add(watch_, [] { _exit(kWorkerStuck); });
  }

  /// An empty list of particles: makes the policy, and no more.
  WorkerMessage serve(const WorkerRequest& request) {
    watch_->enter();
    WorkerMessage out = work(request);
    watch_->leave();
    return out;
  }

 private:
  /// What is refused here is refused for all particles, and none is to blame.
  WorkerMessage work(const WorkerRequest& request) {
    try {
      return simulate(run_of(request.policy), request);
    } catch (...) {
      runs_.erase(request.policy);
      return word_of(std::current_exception());
    }
  }

  WorkerMessage simulate(BlockRun& run, const WorkerRequest& request) {
    try {
      std::vector<TraceRecord> records(request.particles.size());
      std::vector<Particle> particles;
      std::vector<std::size_t> places;  // of `particles`, among the records
      for (std::size_t i = 0; i < records.size(); ++i) {
        const std::uint32_t id = request.particles[i];
        try {
          particles.push_back(source_.fabricate(id, source_.draw(id)));
          places.push_back(i);
        } catch (const InputError& error) {
          records[i] = unfabricated(id, scenario_, error.what());
        }
      }
      RunCost cost;
      std::vector<TraceRecord> made = run.run(particles, &cost);
      for (std::size_t k = 0; k < made.size(); ++k) records[places[k]] = std::move(made[k]);
      std::string bytes(reinterpret_cast<const char*>(&cost.steps), sizeof cost.steps);
      return {static_cast<char>(WorkerWord::traces), bytes + bytes_of(records)};
    } catch (const InputError& error) {
      throw std::runtime_error(error.what());  // of a particle, not of the scenario
    }
  }

  BlockRun& run_of(const std::string& name) {
    const auto there = runs_.find(name);
    if (there != runs_.end()) return there->second;
    for (const PolicySpec& policy : scenario_.policies) {
      if (policy.name != name) continue;
      BlockRun& run = runs_.emplace(name, BlockRun(scenario_, policy, scenario_.seed)).first->second;
      run.watch(watch_.get());
      return run;
    }
    throw MachineError("the process of a controller knows no policy " + name);
  }

  const InputReplay inputs_;
  const Scenario scenario_;
  const ParticleSource source_;
  const std::shared_ptr<TraceWatch> watch_ = std::make_shared<TraceWatch>();
  Watchdog watchdog_;
  std::map<std::string, BlockRun> runs_;
};

/// So that a controller that leaks takes its own process down and not the machine. Address space that is reserved alone
/// does not count.
void limit_memory() {
  constexpr rlim_t kMost = rlim_t{4} << 30;  // bytes, beyond what the scenario takes
  std::ifstream sizes("/proc/self/statm");
  rlim_t pages = 0;
  for (int field = 0; field < 6; ++field) sizes >> pages;  // the sixth: data and stack
  rlimit limit{};
  if (!sizes || getrlimit(RLIMIT_DATA, &limit) != 0) return;
  const rlim_t wanted = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kMost;
  limit.rlim_cur = std::min({limit.rlim_cur, limit.rlim_max, wanted});
  setrlimit(RLIMIT_DATA, &limit);
}

void share_page() {
  void* const page = mmap(nullptr, sizeof(LibraryCalls), PROT_READ | PROT_WRITE, MAP_SHARED, kWorkerPage, 0);
  ::close(kWorkerPage);  // in a bundle other functions may have this name
  if (page != MAP_FAILED) show_library_calls(static_cast<LibraryCalls*>(page));
}

/// Lets the parent see that the process runs at all, which one that was stopped does not.
void show_life() {
  LibraryCalls* const page = shown_library_calls();
  if (!page) return;
  constexpr std::chrono::milliseconds kBetween(100);
  std::thread([page, kBetween] {
    while (true) {
      page->beats.fetch_add(1, std::memory_order_relaxed);
      std::this_thread::sleep_for(kBetween);
    }
  }).detach();
}

}  // namespace

bool started_as_worker(int argc, char** argv) {
  if (argc != 2 || std::string_view(argv[1]) != kWorkerVerb) return false;
  int type = 0;
  socklen_t size = sizeof type;
  return getsockopt(kWorkerSocket, SOL_SOCKET, SO_TYPE, &type, &size) == 0;
}

namespace {

/// A signal that is meant for the campaign, whose parent ends this process when it is time. It is not ignored, as then
/// it would be in all programs that a controller starts.
void pass_over(int number) {
  struct sigaction action {};
  action.sa_handler = [](int) {};
  action.sa_flags = SA_RESTART;
  sigaction(number, &action, nullptr);
}

}  // namespace

int work_for_parent() {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what is printed before a crash shall be seen
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGXCPU}) pass_over(number);
  const pid_t self = getpid();
  const auto say = [self](WorkerMessage word, std::uint64_t mark) {
    if (getpid() != self) _exit(EXIT_SUCCESS);  // a copy by fork() that has come as far as this has nothing to say
    word.mark = mark;
    return send_word(kWorkerSocket, word);
  };
  share_page();
  std::unique_ptr<Worker> worker;
  const auto briefing = receive_word(kWorkerSocket);
  if (!briefing) return EXIT_FAILURE;
  try {
    show_life();
    worker = std::make_unique<Worker>(WorkerBriefing::from_text(briefing->bytes));
  } catch (...) {
    say(word_of(std::current_exception()), briefing->mark);
    return EXIT_FAILURE;
  }
  limit_memory();
  allow_libraries(LibraryLoading::all);
  say({static_cast<char>(WorkerWord::ready), ""}, briefing->mark);
  while (const auto request = receive_word(kWorkerSocket)) {
    if (!say(worker->serve(WorkerRequest::from_text(request->bytes)), request->mark)) _exit(kWorkerUnheard);
  }
  worker.reset();  // destroy() is called; exit handlers follow
  return EXIT_SUCCESS;
}

}  // namespace graze
