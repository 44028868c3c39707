#include "jobs/campaign/step_study.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>
#include <utility>

#include "simulation/simulation.h"

namespace graze {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kInstants = 500;      // at which a run is compared with the reference
constexpr double kLeastTime = 0.2;  // s of processor time behind a cost
constexpr int kMostRuns = 50;

/// When a run of this timing is compared, s: after whole numbers of its steps.
std::vector<double> instants_of(const Timing& timing) {
  const int stride = std::max(1, timing.steps() / kInstants);
  std::vector<double> out;
  for (int step = stride; step <= timing.steps(); step += stride) out.push_back(step * timing.step);
  return out;
}

/// What is compared of a trace.
struct Track {
  std::vector<std::vector<double>> at;  // [instant], joints and the link's place; as many as the trace lived to see
  std::vector<double> last;             // of the step before
  double last_time = 0, tracked = 0;    // s; sum of |q - q wanted| over control steps and joints
  std::size_t wanted = 0;               // its terms
};

/// Notes joints and a link's place at some instants, between steps by a straight line, and how well joints are tracked.
class Recorder : public TraceObserver {
 public:
  Recorder(const Model& model, int frame, const Timing& timing, std::vector<double> instants)
      : frame_(frame), timing_(timing), instants_(std::move(instants)), na_(model.na()) {}

  bool see(const StepView& view) override {
    Track& track = tracks_[view.particle];
    std::vector<double> now = numbers(view);
    if (view.step > 0) {
      if ((static_cast<int>(view.step) - 1) % timing_.steps_per_control() == 0) note_tracking(view, track);
      note_instants(view.time, now, track);
    }
    track.last = std::move(now);
    track.last_time = view.time;
    return true;
  }

  const std::vector<double>& instants() const { return instants_; }
  int joints() const { return na_; }
  /// Empty if the trace never began.
  const Track& track(std::uint32_t particle) { return tracks_[particle]; }
  double tracking() const {
    double sum = 0, terms = 0;
    for (const auto& [particle, track] : tracks_) {
      sum += track.tracked;
      terms += static_cast<double>(track.wanted);
    }
    return terms > 0 ? sum / terms : kNone;
  }

 private:
  std::vector<double> numbers(const StepView& view) const {
    std::vector<double> out;
    const BlockState& state = view.physics.state();
    for (const int body : view.model.actuated) out.push_back(state.q(view.model.bodies[body].q, view.lane));
    const Frame& frame = view.model.frames[frame_];
    const Vec3 p =
        state.position(frame.body, view.lane) + state.rotation(frame.body, view.lane) * Vec3(frame.X_BF.translation());
    out.insert(out.end(), {p.x(), p.y(), p.z()});
    return out;
  }

  /// What the policy wanted at the beginning of the control step that has just begun, against where the joints were.
  void note_tracking(const StepView& view, Track& track) const {
    if (view.controller.kind() != TargetKind::joint) return;
    const BlockArray& wanted = view.controller.targets().q;
    for (int k = 0; k < na_; ++k) track.tracked += std::abs(wanted(k, view.lane) - track.last[k]);
    track.wanted += static_cast<std::size_t>(na_);
  }

  void note_instants(double time, const std::vector<double>& now, Track& track) const {
    const double slack = 1e-6 * timing_.step;
    while (track.at.size() < instants_.size() && instants_[track.at.size()] <= time + slack) {
      const double share = (instants_[track.at.size()] - track.last_time) / (time - track.last_time);
      std::vector<double> between = now;
      for (std::size_t i = 0; i < now.size(); ++i) between[i] = track.last[i] + share * (now[i] - track.last[i]);
      track.at.push_back(std::move(between));
    }
  }

  int frame_;
  Timing timing_;
  std::vector<double> instants_;
  int na_;
  std::map<std::uint32_t, Track> tracks_;
};

/// One timing of the scenario, simulated.
struct Run {
  Recorder recorder;
  std::vector<TraceRecord> traces;
  double cost;
};

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Per simulated second of one trace, without anybody who watches.
double cost_of(Simulator& simulator, const std::vector<Particle>& particles) {
  double spent = 0, simulated = 0;
  for (int i = 0; i < kMostRuns && spent < kLeastTime; ++i) {
    const double before = processor_seconds();
    const std::vector<TraceRecord> traces = simulator.run(particles);
    spent += processor_seconds() - before;
    for (const TraceRecord& trace : traces) simulated += trace.end_time;
  }
  return simulated > 0 ? spent / simulated : kNone;
}

int frame_of(const Scenario& scenario, const std::string& link) {
  const Model& model = scenario.model;
  const int frame = model.frame(link);
  if (frame >= 0 && model.frames[frame].body >= 0) return frame;
  std::vector<std::string> names;
  for (const Frame& one : model.frames) {
    if (one.body >= 0) names.push_back(one.name);
  }
  throw InputError("--link " + link + (frame < 0 ? ": no link or movable object of that name; " : ": does not move; ") +
                   nearest_or_all(link, names));
}

Run run_at(const LoadAt& load, const Timing& timing, const StepQuestion& question, std::vector<double> instants) {
  Scenario scenario = load(timing);
  scenario.recording.telemetry = Telemetry::none;
  for (UncertainParameter& parameter : scenario.space.parameters) parameter.jitter.reset();
  const Simulation simulation(std::move(scenario), question.particles);
  const int frame = frame_of(simulation.scenario(), question.link);
  std::vector<Particle> particles;
  for (std::uint32_t i = 0; i < question.particles; ++i) particles.push_back(simulation.particle(i));
  Simulator simulator(simulation, question.policy);
  Run out{Recorder(simulation.nominal(), frame, timing, std::move(instants)), {}, 0};
  out.traces = simulator.run(particles, {.observer = &out.recorder});
  out.cost = cost_of(simulator, particles);
  return out;
}

/// Index of each instant of a run among those of the reference, which has them all.
std::vector<std::size_t> places(const std::vector<double>& some, const std::vector<double>& all) {
  std::vector<std::size_t> out;
  for (const double one : some) {
    out.push_back(static_cast<std::size_t>(std::lower_bound(all.begin(), all.end(), one) - all.begin()));
  }
  return out;
}

/// Fills the errors of a row: means over joints, instants and particles that both runs have.
void compare(Recorder& run, Recorder& reference, const StepQuestion& question, StepRow& row) {
  const std::vector<std::size_t> place = places(run.instants(), reference.instants());
  const std::size_t na = static_cast<std::size_t>(run.joints());
  double joints = 0, link = 0, terms = 0;
  for (std::uint32_t particle = 0; particle < question.particles; ++particle) {
    const Track &a = run.track(particle), &b = reference.track(particle);
    for (std::size_t i = 0; i < a.at.size() && place[i] < b.at.size(); ++i) {
      const std::vector<double>&x = a.at[i], &y = b.at[place[i]];
      for (std::size_t k = 0; k < na; ++k) joints += std::abs(x[k] - y[k]);
      link += std::hypot(x[na] - y[na], x[na + 1] - y[na + 1], x[na + 2] - y[na + 2]);
      ++terms;
    }
  }
  row.joint_error = terms > 0 && na > 0 ? joints / (terms * static_cast<double>(na)) : kNone;
  row.link_error = terms > 0 ? link / terms : kNone;
}

StepRow row_of(const Timing& timing, Run& run, Run& reference, const StepQuestion& question) {
  StepRow out;
  out.timing = timing;
  out.traces = static_cast<int>(run.traces.size());
  for (std::size_t i = 0; i < run.traces.size(); ++i) {
    const TraceRecord &one = run.traces[i], &other = reference.traces[i];
    ++out.outcomes[static_cast<std::size_t>(one.outcome)];
    const bool valid = one.outcome != Outcome::invalid;
    out.valid += valid;
    out.same += valid && one.outcome == other.outcome && one.violated == other.violated;
    if (!valid && out.reason.empty()) out.reason = one.invalid_reason;
  }
  out.tracking = run.recorder.tracking();
  out.cost = run.cost;
  compare(run.recorder, reference.recorder, question, out);
  return out;
}

}  // namespace

double study_bytes(const Scenario& scenario, const std::vector<double>& steps) {
  double instants = 0;
  for (const double step : steps) instants += std::min(2.0 * kInstants, scenario.timing.end / step);
  return instants * (sizeof(std::vector<double>) + 2 * sizeof(double) + sizeof(double) * (scenario.model.na() + 3.0));
}

Timing timing_at(const Timing& timing, double step) {
  const auto whole = [&](double time) { return std::max(1.0, std::ceil(time / step - 1e-6)); };
  Timing out;
  out.step = step;
  out.control = step * whole(timing.control);
  out.end = std::max(out.control, step * std::round(timing.end / step));
  return out;
}

const StepRow* StepStudy::largest_stable() const {
  const StepRow* out = nullptr;
  for (const StepRow& row : rows) {
    if (!row.stable()) break;
    out = &row;
  }
  return out;
}

StepStudy study_steps(const LoadAt& load, const Timing& timing, const StepQuestion& question) {
  std::vector<Timing> timings;
  std::vector<double> all;
  for (const double step : question.steps) {
    timings.push_back(timing_at(timing, step));
    const std::vector<double> own = instants_of(timings.back());
    all.insert(all.end(), own.begin(), own.end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  const Timing tiny = timing_at(timing, question.reference);
  Run reference = run_at(load, tiny, question, std::move(all));
  StepStudy out;
  out.reference = row_of(tiny, reference, reference, question);
  for (const Timing& one : timings) {
    Run run = run_at(load, one, question, instants_of(one));
    out.rows.push_back(row_of(one, run, reference, question));
  }
  return out;
}

}  // namespace graze
