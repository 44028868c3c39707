#include "jobs/campaign/design_trials.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <thread>

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

  LimitWatch(const Task& task, const DesignBlock& block, const TrialQuestion& question)
      : task_(task), limits_(block.limits), from_(question.from), to_(question.to) {}

  bool see(const StepView& view) override {
    Seen& seen = seen_[view.particle];
    seen.within.resize(limits_.size(), kNever);
    seen.so_far.resize(limits_.size(), kNever);
    for (std::size_t k = 0; k < limits_.size(); ++k) {
      if (!task_.requirements[limits_[k]].window.contains(view.time)) continue;
      const double value = view.requirements(limits_[k], view.lane);
      if (!(seen.so_far[k] <= value)) seen.so_far[k] = value;
      if (value < 0 && std::isnan(seen.first_violation)) seen.first_violation = view.time;
      if (view.time >= from_ && !(seen.within[k] <= value)) seen.within[k] = value;
    }
    return view.time < to_;
  }

  Seen seen(std::uint32_t particle) {
    Seen out = seen_[particle];
    out.within.resize(limits_.size(), kNever);
    out.so_far.resize(limits_.size(), kNever);
    return out;
  }

 private:
  const Task& task_;
  const std::vector<int>& limits_;
  double from_, to_;
  std::map<std::uint32_t, Seen> seen_;
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
    if (trace.outcome == Outcome::invalid && out_.problem.empty()) out_.problem = trace.invalid_reason;
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

DesignMargins try_design(Scenario scenario, const DesignBlock& block, const TrialQuestion& question) {
  scenario.recording.telemetry = Telemetry::none;
  scenario.recording.events = false;
  scenario.recording.phases = true;
  scenario.task.stop_at_violation = false;
  const bool nominal = question.particles.empty();
  if (nominal) {
    for (UncertainParameter& parameter : scenario.space.parameters) parameter.jitter.reset();
  }
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
  for (const TraceRecord& trace : simulator.run(particles, {.observer = &watch})) {
    gathered.add(trace, watch.seen(trace.particle));
  }
  return gathered.finish();
}

}  // namespace

std::vector<DesignMargins> try_designs(const DesignRobots& robots, const std::vector<DesignValues>& designs,
                                       const TrialQuestion& question) {
  MadeDesigns made = robots.make(question.level, designs);
  std::vector<DesignMargins> out(designs.size());
  std::vector<std::exception_ptr> errors(designs.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < designs.size(); i = next++) {
      if (!made.scenarios[i]) {
        out[i].problem = made.problems[i];
        continue;
      }
      try {
        out[i] = try_design(std::move(*made.scenarios[i]), robots.block(), question);
      } catch (const InputError& error) {
        out[i].problem = error.what();  // a particle of this design cannot be made
      } catch (...) {
        errors[i] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    const std::size_t count = std::min<std::size_t>(designs.size(), static_cast<std::size_t>(question.threads));
    for (std::size_t i = 1; i < count; ++i) threads.emplace_back(work);
    work();
  }
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
  return out;
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
