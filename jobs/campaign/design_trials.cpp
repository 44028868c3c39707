#include "jobs/campaign/design_trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <optional>
#include <thread>

#include "engine/library/library_use.h"
#include "engine/settings/signal_stack.h"
#include "jobs/campaign/nominal_traces.h"
#include "sampling/stream.h"
#include "simulation/simulation.h"

namespace graze {
namespace {

constexpr double kNever = std::numeric_limits<double>::quiet_NaN();

/// Keeps the least values of the limits, and ends traces with the window.
class LimitWatch : public TraceObserver {
 public:
  struct Seen {
    std::vector<double> within, so_far;
    double first_violation = kNever;
  };

  /// What tells traces apart: their particles, or their places in the run, where all are of one particle.
  enum class Key { particle, index };

  LimitWatch(const Task& task, const DesignBlock& block, const TrialQuestion& question, Key key = Key::particle)
      : task_(task), limits_(block.limits), from_(question.from), to_(question.to), key_(key) {}

  bool see(const StepView& view) override {
    if (view.step == view.first) lanes_[static_cast<std::size_t>(view.lane)] = &begin(view);
    Seen& seen = *lanes_[static_cast<std::size_t>(view.lane)];
    for (std::size_t k = 0; k < limits_.size(); ++k) {
      if (!task_.requirements[limits_[k]].window.contains(view.time)) continue;
      const double value = view.requirements(limits_[k], view.lane);
      if (!(seen.so_far[k] <= value)) seen.so_far[k] = value;
      if (value < 0 && std::isnan(seen.first_violation)) seen.first_violation = view.time;
      if (view.time >= from_ && !(seen.within[k] <= value)) seen.within[k] = value;
    }
    return view.time < to_;
  }
  bool senses() const override { return false; }

  Seen seen(std::size_t key) {
    Seen out = seen_[key];
    out.within.resize(limits_.size(), kNever);
    out.so_far.resize(limits_.size(), kNever);
    return out;
  }

 private:
  Seen& begin(const StepView& view) {
    Seen& seen = seen_[key_ == Key::index ? view.index : view.particle];
    seen.within.resize(limits_.size(), kNever);
    seen.so_far.resize(limits_.size(), kNever);
    return seen;
  }

  const Task& task_;
  const std::vector<int>& limits_;
  double from_, to_;
  Key key_;
  std::map<std::size_t, Seen> seen_;
  std::array<Seen*, kLanes> lanes_{};  // of the traces that go on
};

/// Linear between order statistics (type 7 of Hyndman and Fan); NaNs are left out.
double quantile_of(std::vector<double> values, double q) {
  std::erase_if(values, [](double x) { return std::isnan(x); });
  if (values.empty()) return kNever;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

/// Gathers the traces of one design.
class Gathered {
 public:
  Gathered(const DesignBlock& block, double end) : block_(block), end_(end) {}

  void add(const TraceRecord& trace, LimitWatch::Seen seen) {
    note_lost(trace);
    double violation = seen.first_violation;
    if (block_.objective) {
      const bool judged = !trace.stopped && trace.outcome != Outcome::invalid;
      seen.within.push_back(judged ? trace.objective_margin : kNever);
      seen.so_far.push_back(seen.within.back());
      if (judged && trace.objective_margin < 0 && std::isnan(violation)) violation = trace.end_time;
    }
    if (within_.empty()) out_.first_violation = violation;
    within_.push_back(std::move(seen.within));
    so_far_.push_back(std::move(seen.so_far));
    progress_ += std::isnan(violation) && trace.outcome != Outcome::invalid
                     ? 1
                     : std::min(1.0, (std::isnan(violation) ? trace.end_time : violation) / end_);
    success_ += trace.outcome == Outcome::success && !trace.stopped;
    out_.contacts = 1099511628211u * (out_.contacts ^ name_hash(trace.sequence));
  }

  DesignMargins finish() {
    const auto count = static_cast<double>(within_.size());
    const std::size_t limits = within_.empty() ? 0 : within_.front().size();
    for (std::size_t k = 0; k < limits; ++k) {
      out_.margins.push_back(quantile_of(column(within_, k), block_.quantile));
      out_.so_far.push_back(quantile_of(column(so_far_, k), block_.quantile));
    }
    out_.made = !within_.empty();
    out_.progress = progress_ / count, out_.success = success_ / count;
    return std::move(out_);
  }

 private:
  void note_lost(const TraceRecord& trace) {
    LostTraces& lost = out_.lost;
    ++lost.of;
    if (trace.outcome != Outcome::invalid) return;
    if (lost.count++ > 0) return;
    out_.problem = trace.invalid_reason;
    const std::string who = trace.particle == kNominalParticle ? "" : fmt::format("particle {}: ", trace.particle);
    lost.why = who + trace.invalid_reason;
  }
  static std::vector<double> column(const std::vector<std::vector<double>>& rows, std::size_t k) {
    std::vector<double> out;
    for (const auto& row : rows) out.push_back(row[k]);
    return out;
  }

  const DesignBlock& block_;
  double end_;
  DesignMargins out_;
  std::vector<std::vector<double>> within_, so_far_;  // [trace][limit]
  double progress_ = 0, success_ = 0;
};

/// Nothing is recorded but what margins and contact sequences need; the nominal robot has no jitter.
void prepare(Scenario& scenario, bool nominal) {
  scenario.recording.telemetry = Telemetry::none;
  scenario.recording.events = false;
  scenario.recording.phases = true;
  scenario.task.stop_at_violation = false;
  if (!nominal) return;
  for (UncertainParameter& parameter : scenario.space.parameters) parameter.jitter.reset();
}

DesignMargins try_design(Scenario scenario, const DesignBlock& block, const TrialQuestion& question) {
  const bool nominal = question.particles.empty();
  prepare(scenario, nominal);
  const Simulation simulation(std::move(scenario));
  std::vector<Particle> particles;
  for (const std::uint32_t id : question.particles) particles.push_back(simulation.particle(id));
  if (nominal) {
    particles.push_back(Fabricator(simulation.scenario().world, {}).nominal());
    particles.front().id = kNominalParticle;
  }
  LimitWatch watch(simulation.scenario().task, block, question);
  Simulator simulator(simulation, question.policy);
  Gathered gathered(block, simulation.scenario().timing.end);
  RunOptions options{.observer = &watch};
  if (nominal && question.begin) options.beginnings = {question.begin.get(), 1};
  for (const TraceRecord& trace : simulator.run(particles, options)) {
    gathered.add(trace, watch.seen(trace.particle));
  }
  return gathered.finish();
}

/// Calls `work` from some threads at once, this one among them, and rethrows what one of them has thrown.
template <class Work>
void in_threads(std::size_t count, const Work& work) {
  std::vector<std::exception_ptr> errors(count);
  const auto guarded = [&](std::size_t i) {
    const SignalStack stack;
    try {
      work();
    } catch (...) {
      errors[i] = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < count; ++i) threads.emplace_back(guarded, i);
    guarded(0);
  }
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

/// Takes state and memory of a trace at a step, and ends it there.
class BeginningTaker : public TraceObserver {
 public:
  explicit BeginningTaker(std::uint32_t step) : step_(step) {}

  bool see(const StepView& view) override {
    if (view.step < step_) return true;
    const BlockState& all = view.physics.state();
    taken = std::make_shared<const Beginning>(
        Beginning{view.time, {all.q.column(view.lane), all.v.column(view.lane)}, view.remember()});
    return false;
  }
  bool senses() const override { return false; }

  std::shared_ptr<const Beginning> taken;

 private:
  std::uint32_t step_;
};

/// The policy of a scenario that is known to have it.
const PolicySpec& policy_of(const Scenario& scenario, const std::string& name) {
  return *std::find_if(scenario.policies.begin(), scenario.policies.end(),
                       [&](const PolicySpec& one) { return one.name == name; });
}

/// Nominal robots of designs, a block of lanes at a time. Those of a block in which something goes wrong have no
/// result.
class SharedBlocks {
 public:
  SharedBlocks(const Scenario& scenario, const DesignBlock& block, const TrialQuestion& question)
      : scenario_(scenario), block_(block), question_(question) {}

  /// `which`: indices of `particles` and `out`.
  void run(const std::vector<std::optional<Particle>>& particles, const std::vector<std::size_t>& which,
           std::vector<std::optional<DesignMargins>>& out) const {
    const std::size_t blocks = (which.size() + kLanes - 1) / kLanes;
    std::atomic<std::size_t> next = 0;
    in_threads(std::min(blocks, static_cast<std::size_t>(question_.threads)), [&] {
      std::optional<BlockRun> run;
      for (std::size_t b = next++; b < blocks; b = next++) {
        const std::size_t end = std::min(which.size(), (b + 1) * kLanes);
        const std::vector<std::size_t> here(which.begin() + static_cast<std::ptrdiff_t>(b * kLanes),
                                            which.begin() + static_cast<std::ptrdiff_t>(end));
        try {
          if (!run) run.emplace(scenario_, policy_of(scenario_, question_.policy), scenario_.seed);
          run_block(*run, particles, here, out);
        } catch (const MachineError&) {
          throw;
        } catch (const std::exception&) {  // alone it is told whose fault it is
          run.reset();
        }
      }
    });
  }

 private:
  void run_block(BlockRun& run, const std::vector<std::optional<Particle>>& particles,
                 const std::vector<std::size_t>& which, std::vector<std::optional<DesignMargins>>& out) const {
    std::vector<Particle> robots;
    for (const std::size_t i : which) robots.push_back(*particles[i]);
    LimitWatch watch(scenario_.task, block_, question_, LimitWatch::Key::index);
    std::vector<Beginning> beginnings;
    if (question_.begin) beginnings.assign(robots.size(), *question_.begin);
    const std::vector<TraceRecord> traces =
        run.run(robots, nullptr, {.observer = &watch, .beginnings = beginnings, .informed = true});
    for (std::size_t k = 0; k < traces.size(); ++k) {
      Gathered gathered(block_, scenario_.timing.end);
      gathered.add(traces[k], watch.seen(k));
      out[which[k]] = gathered.finish();
    }
  }

  const Scenario& scenario_;
  const DesignBlock& block_;
  const TrialQuestion& question_;
};

/// Of designs beside one that share blocks; none: it must be tried alone.
std::vector<std::optional<DesignMargins>> try_in_blocks(const DesignRobots& robots, const DesignValues& centre,
                                                        const std::vector<DesignValues>& designs,
                                                        const TrialQuestion& question) {
  std::vector<std::optional<DesignMargins>> out(designs.size());
  if (!question.particles.empty()) return out;  // whose lanes are full as it is
  // The robot that a controller from outside is told of is a file's.
  if (is_from_outside(policy_of(robots.scenario(), question.policy).settings)) return out;
  MadeDesigns made = robots.make(question.level, {centre});
  if (!made.scenarios.front()) return out;
  Scenario& scenario = *made.scenarios.front();
  prepare(scenario, true);
  std::vector<std::optional<Particle>> particles = robots.beside(scenario, centre, designs);
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    if (!particles[i]) continue;
    particles[i]->id = kNominalParticle;
    which.push_back(i);
  }
  SharedBlocks(scenario, robots.block(), question).run(particles, which, out);
  return out;
}

}  // namespace

std::vector<DesignMargins> try_designs(const DesignRobots& robots, const std::vector<DesignValues>& designs,
                                       const TrialQuestion& question) {
  MadeDesigns made = robots.make(question.level, designs);
  std::vector<DesignMargins> out(designs.size());
  std::atomic<std::size_t> next = 0;
  in_threads(std::min<std::size_t>(designs.size(), static_cast<std::size_t>(question.threads)), [&] {
    for (std::size_t i = next++; i < designs.size(); i = next++) {
      if (!made.scenarios[i]) {
        out[i].problem = made.problems[i];
        continue;
      }
      try {
        out[i] = try_design(std::move(*made.scenarios[i]), robots.block(), question);
      } catch (const InputError& error) {
        out[i].problem = error.what();  // a particle of this design cannot be made
      }
    }
  });
  return out;
}

std::vector<DesignMargins> try_beside(const DesignRobots& robots, const DesignValues& centre,
                                      const std::vector<DesignValues>& designs, const TrialQuestion& question) {
  std::vector<std::optional<DesignMargins>> shared = try_in_blocks(robots, centre, designs, question);
  std::vector<DesignValues> alone;
  for (std::size_t i = 0; i < designs.size(); ++i) {
    if (!shared[i]) alone.push_back(designs[i]);
  }
  std::vector<DesignMargins> rest;
  if (!alone.empty()) rest = try_designs(robots, alone, question);
  std::vector<DesignMargins> out;
  std::size_t k = 0;  // of `rest`
  for (std::optional<DesignMargins>& one : shared) out.push_back(std::move(one ? *one : rest[k++]));
  return out;
}

std::shared_ptr<const Beginning> recorded_beginning(const DesignRobots& robots, const DesignValues& design,
                                                    const TrialQuestion& question) {
  const Timing timing = robots.scenario().timing;
  const auto periods = static_cast<std::uint32_t>(question.from / timing.control * (1 + 1e-12));
  if (periods == 0) return nullptr;
  MadeDesigns made = robots.make(question.level, {design});
  if (!made.scenarios.front()) throw InputError(made.problems.front());
  prepare(*made.scenarios.front(), true);
  const Simulation simulation(std::move(*made.scenarios.front()));
  Particle robot = Fabricator(simulation.scenario().world, {}).nominal();
  robot.id = kNominalParticle;
  BeginningTaker taker(periods * static_cast<std::uint32_t>(timing.steps_per_control()));
  Simulator(simulation, question.policy).run({&robot, 1}, {.observer = &taker});
  return taker.taken;
}

std::vector<std::string> limit_names(const Scenario& scenario) {
  std::vector<std::string> out;
  for (const int k : scenario.redesign->limits) out.push_back(scenario.task.requirements[k].name);
  if (scenario.redesign->objective) out.emplace_back("objective");
  return out;
}

std::vector<std::string> limit_units(const Scenario& scenario) {
  std::vector<std::string> out;
  for (const int k : scenario.redesign->limits) out.push_back(scenario.task.requirements[k].unit);
  if (scenario.redesign->objective) out.push_back(scenario.task.objective.unit);
  return out;
}

}  // namespace graze
