// replay() and trace_differences().
#include "jobs/campaign/replay.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "archive/hdf5/reading_child.h"
#include "engine/control/policy.h"
#include "engine/physics.h"
#include "jobs/campaign/describe_campaign.h"
#include "jobs/campaign/hanging_controllers.h"
#include "jobs/workers/controllers.h"
#include "simulation/contained.h"
#include "simulation/particles.h"
#include "simulation/step_recorder.h"

namespace graze {
namespace {

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

/// The policy that is meant, of the campaign's or, for what was never simulated, of the scenario's.
const PolicySpec& find_policy(const ReplayRequest& request, const CampaignInfo& info, const Scenario& scenario) {
  std::vector<std::string> names = info.policies;
  if (request.unverified) {
    names.clear();
    for (const PolicySpec& policy : scenario.policies) names.push_back(policy.name);
  }
  std::vector<std::string> meant;
  for (const std::string& name : names) {
    if (name == request.policy) meant = {name};
    if (name == request.policy) break;
    if (request.policy.empty() || matches(request.policy, name)) meant.push_back(name);
  }
  for (const PolicySpec& policy : scenario.policies) {
    if (meant.size() == 1 && policy.name == meant[0]) return policy;
  }
  if (request.policy.empty()) {
    throw InputError(fmt::format("--policy is missing; {} has {}", request.archive, fmt::join(names, ", ")));
  }
  if (meant.size() > 1) {
    throw InputError(fmt::format("--policy {}: means {} policies ({}); name one", request.policy, meant.size(),
                                 fmt::join(meant, ", ")));
  }
  for (const PolicySpec& policy : scenario.policies) {
    if (policy.name != request.policy) continue;
    throw InputError(fmt::format(
        "--policy {}: was left out of this campaign; with --unverified it is replayed all the same", request.policy));
  }
  const std::string near = nearest(request.policy, names);
  throw InputError(fmt::format("--policy {}: no such policy in {}{}; it has {}", request.policy, request.archive,
                               near.empty() ? "" : "; nearest: " + near, fmt::join(names, ", ")));
}

/// Refuses a particle that the campaign cannot have, or has not yet.
void check_there(const ReplayRequest& request, const CampaignInfo& info, const std::string& policy) {
  const bool hypercube = info.design == "latin_hypercube";
  if (request.particle >= info.particles && (hypercube || !request.unverified)) {
    throw InputError(fmt::format("--particle {}: {} has particles 0 to {}{}", request.particle, request.archive,
                                 info.particles - 1,
                                 hypercube ? "" : "; with --unverified others are replayed all the same"));
  }
  if (request.unverified) return;
  throw InputError(
      fmt::format("--particle {}: {} holds no trace of it under policy '{}' (it was not finished yet, or not at all); "
                  "with --unverified it is replayed all the same",
                  request.particle, request.archive, policy));
}

/// With one policy alone: whatever becomes of the controllers of the others.
Scenario with_policy(const Scenario& scenario, const PolicySpec& policy) {
  Scenario out = scenario;
  out.policies = {policy};
  return out;
}

/// What one trace comes out as when nothing else is simulated, with the faults of a campaign contained as there.
/// `scenario`: of one policy.
TraceRecord simulate(const Scenario& scenario, std::uint64_t particles, Particle particle, TraceObserver* observer) {
  TraceWatch watch;
  RunElsewhere elsewhere;
  std::optional<EndHangingControllers> end_hanging;
  if (observer) {
    end_hanging.emplace();
    load_controllers_here(scenario);
  } else {
    elsewhere = controllers_elsewhere(scenario, scenario.seed, particles, 0);
  }
  ContainedRun run(scenario, scenario.seed, watch, std::move(elsewhere));
  WorkUnit unit;
  unit.particles.push_back(std::move(particle));
  run.run(unit, {.observer = observer});
  if (unit.records.empty()) throw MachineError(fmt::format("the trace has no end: {}", unit.unfinished.at(0).reason));
  return std::move(unit.records.front());
}

/// How many frames the trace will have: as in the archive, or, if that holds none, to the end.
double frames_of(const ReplayRequest& request, const Scenario& scenario, const std::optional<TraceRecord>& archived) {
  const double end = archived ? archived->end_time : scenario.timing.end;
  return std::floor(std::round(end / scenario.timing.step) / request.every) + 1;
}

[[noreturn]] void too_large(const ReplayRequest& request, const std::string& what, double every) {
  throw InputError(
      fmt::format("--output: {}; at most {:.3g} MB are held in memory; nearest right answer: --every {:.0f}", what,
                  request.most_bytes / 1e6, every));
}

/// Refuses an export that would not fit into memory, before anything is simulated. Returns the number of frames.
std::size_t check_size(const ReplayRequest& request, const Scenario& scenario, const PolicySpec& policy,
                       const CampaignInfo& info, const std::optional<TraceRecord>& archived) {
  const State initial = initial_state(*scenario.world, scenario.model);
  const ControlContext context{scenario.model, initial, scenario.timing.control,
                               make_physics(scenario.physics, scenario.model)->solves_drives()};
  const Controller controller(context, policy.settings);
  const double frames = frames_of(request, scenario, archived);
  const double each = StepRecorder::frame_bytes(scenario, info, controller);
  if (frames * each > request.most_bytes) {
    const double fit = std::max(2.0, std::floor(request.most_bytes / each));  // the start and some more
    too_large(request, fmt::format("{:.0f} frames take {:.3g} MB", frames, frames * each / 1e6),
              std::ceil(frames * request.every / (fit - 1)));
  }
  return frames > 0 ? static_cast<std::size_t>(frames) : 0;  // NaN: the trace has no end
}

/// The trace, with its steps in `log` if they are asked for.
TraceRecord simulate_recorded(const ReplayRequest& request, const Scenario& scenario, const PolicySpec& policy,
                              const std::optional<TraceRecord>& archived, const CampaignInfo& info, Particle particle,
                              StepLog& log) {
  StepRecorder recorder(scenario, info, request.every, request.most_bytes);
  if (request.record) recorder.expect(check_size(request, scenario, policy, info, archived));
  TraceRecord trace = simulate(with_policy(scenario, policy), info.particles, std::move(particle),
                               request.record ? &recorder : nullptr);
  if (recorder.full())
    too_large(request, "the frames and their contacts take more memory than may be", 2.0 * request.every);
  log = recorder.take();
  return trace;
}

/// The particle, or why there is none.
std::optional<Particle> fabricate(const ParticleSource& source, std::uint32_t id, const std::vector<double>& values,
                                  TraceRecord& trace, const Scenario& scenario) {
  try {
    return source.fabricate(id, values);
  } catch (const InputError& error) {
    trace = unfabricated(id, scenario, error.what());
    return std::nullopt;
  }
}

/// How far from its mean, in standard deviations of its own distribution. From the nominal value that would be no
/// measure of how rare a value is: the nominal may lie anywhere, or outside. The heading of an axis error is no
/// distance from anything: its tilt tells how large the error is.
double deviations(const UncertainParameter& parameter, double value) {
  if (parameter.name.ends_with(".axis.heading")) return std::numeric_limits<double>::quiet_NaN();
  const double std = parameter.persistent.is_choice() ? 0 : parameter.persistent.std();
  const bool known = std > 0 && std::isfinite(std) && std::isfinite(parameter.persistent.mean());
  return known ? (value - parameter.persistent.mean()) / std : std::numeric_limits<double>::quiet_NaN();
}

std::vector<ReplayedParameter> describe_parameters(const Scenario& scenario, const CampaignInfo& info,
                                                   const std::vector<double>& values) {
  std::vector<ReplayedParameter> out;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const UncertainParameter& parameter = scenario.space.parameters[i];
    const auto label = [&](double value) {
      return parameter.labels.empty() ? std::string() : parameter.labels.at(static_cast<std::size_t>(value));
    };
    out.push_back({parameter.name, parameter.unit, info.parameters[i].distribution, parameter.nominal, values[i],
                   deviations(parameter, values[i]), label(parameter.nominal), label(values[i])});
  }
  return out;
}

std::vector<ReplayedNumber> describe_derived(const ParticleSource& source, const std::vector<double>& values) {
  std::vector<ReplayedNumber> out;
  for (const auto& [name, unit, value] : source.nominal_derived()) out.push_back({name, unit, value, 0});
  const std::vector<Derived> derived = source.derived(values);
  for (std::size_t i = 0; i < out.size(); ++i) out[i].value = derived.at(i).value;
  return out;
}

std::vector<ReplayedRequirement> describe_requirements(const Task& task) {
  std::vector<ReplayedRequirement> out;
  for (const Requirement& one : task.requirements) {
    out.push_back({one.name, one.description, one.unit, one.window.from, one.window.to, one.measure});
  }
  return out;
}

std::string outcome_text(const TraceRecord& trace, const CampaignInfo& info) {
  std::string out(outcome_name(trace.outcome));
  const auto index = static_cast<std::size_t>(trace.violated);
  if (trace.violated >= 0 && index < info.requirements.size()) out += " (" + info.requirements[index].name + ")";
  return out;
}

/// Collects lines "what: X in the archive, Y now".
class Differences {
 public:
  void text(const std::string& what, const std::string& archived, const std::string& now) {
    if (archived != now) lines_.push_back(fmt::format("{}: {} in the archive, {} now", what, archived, now));
  }
  void number(const std::string& what, double archived, double now) {
    if (!same_bits(archived, now)) text(what, fmt::format("{}", archived), fmt::format("{}", now));
  }
  /// The first number that differs, and how many.
  void numbers(const std::string& what, const std::vector<double>& archived, const std::vector<double>& now,
               const std::vector<std::string>& names) {
    if (archived.size() != now.size()) {
      text("number of " + what, std::to_string(archived.size()), std::to_string(now.size()));
      return;
    }
    std::size_t first = 0, count = 0;
    for (std::size_t i = now.size(); i-- > 0;) {
      if (same_bits(archived[i], now[i])) continue;
      first = i;
      ++count;
    }
    if (count == 0) return;
    const std::string more = count > 1 ? fmt::format(" ({} of {} differ)", count, now.size()) : "";
    lines_.push_back(
        fmt::format("{} {}: {} in the archive, {} now{}", what, names.at(first), archived[first], now[first], more));
  }
  /// How many there are, and the first that differs.
  template <class Row, class Tell>
  void rows(const std::string& what, const std::vector<Row>& archived, const std::vector<Row>& now, const Tell& tell) {
    text("number of " + what + "s", std::to_string(archived.size()), std::to_string(now.size()));
    for (std::size_t i = 0; i < std::min(archived.size(), now.size()); ++i) {
      if (same(archived[i], now[i])) continue;
      return text("first " + what + " that differs", tell(archived[i]), tell(now[i]) + " (or its impulse or place)");
    }
  }
  std::vector<std::string> take() { return std::move(lines_); }

 private:
  static bool same(const Event& a, const Event& b) {
    return same_bits(a.time, b.time) && a.kind == b.kind && a.a == b.a && a.b == b.b && a.feature_a == b.feature_a &&
           a.feature_b == b.feature_b && same_bits(a.impulse, b.impulse) && a.p_W == b.p_W;
  }
  static bool same(const ContactPhase& a, const ContactPhase& b) {
    return same_bits(a.begin, b.begin) && same_bits(a.end, b.end) && a.a == b.a && a.b == b.b &&
           a.feature_a == b.feature_a && a.feature_b == b.feature_b && same_bits(a.peak, b.peak) &&
           same_bits(a.impulse, b.impulse) && same_bits(a.slip, b.slip) && same_bits(a.roll, b.roll);
  }

  std::vector<std::string> lines_;
};

std::vector<std::string> names_of(const std::vector<CampaignInfo::RequirementRow>& requirements) {
  std::vector<std::string> out;
  for (const auto& one : requirements) out.push_back(one.name);
  return out;
}

/// What was drawn then and now: differs if the sampler does.
void compare_values(const std::vector<double>& archived, const Replay& replay, std::vector<std::string>& lines) {
  std::vector<double> now;
  std::vector<std::string> names;
  for (const ReplayedParameter& parameter : replay.file.parameters) {
    now.push_back(parameter.value);
    names.push_back(parameter.name);
  }
  if (archived.empty()) return;
  Differences differences;
  differences.numbers("parameter", archived, now, names);
  for (std::string& line : differences.take()) lines.insert(lines.begin(), std::move(line));
}

}  // namespace

std::vector<std::string> trace_differences(const TraceRecord& archived, const TraceRecord& replayed,
                                           const CampaignInfo& info, const Recording& kept) {
  Differences out;
  const std::vector<std::string> requirements = names_of(info.requirements);
  out.text("digest", fmt::format("{:#018x}", archived.digest), fmt::format("{:#018x}", replayed.digest));
  out.text("outcome", outcome_text(archived, info), outcome_text(replayed, info));
  out.text("reason", archived.invalid_reason, replayed.invalid_reason);
  out.number("end time", archived.end_time, replayed.end_time);
  out.numbers("margin of", archived.margins, replayed.margins, requirements);
  out.numbers("first violation of", archived.first_violations, replayed.first_violations, requirements);
  out.number("margin of the objective", archived.objective_margin, replayed.objective_margin);
  out.numbers("final position", archived.q, replayed.q, info.q_names);
  out.numbers("final velocity", archived.v, replayed.v, info.v_names);
  if (kept.events) {
    out.rows("event", archived.events, replayed.events,
             [](const Event& e) { return fmt::format("{} at {} s", event_kind_name(e.kind), e.time); });
  }
  if (kept.phases) {
    out.rows("contact phase", archived.phases, replayed.phases, [&](const ContactPhase& p) {
      return fmt::format("{}-{} from {} to {} s", info.colliders.at(p.a), info.colliders.at(p.b), p.begin, p.end);
    });
  }
  return out.take();
}

Replay replay(const ReplayRequest& request) {
  const Archive archive(request.archive);
  Replay out;
  out.archived_info = archive.info();
  out.warnings = archive.warnings();
  const CampaignInfo& info = out.archived_info;
  if (!request.any_version) {
    check_results_version(request.archive, info,
                          "replay it with that program, or give --any-version to see what this one makes of it");
  }
  const ArchivedScenario reloaded(request.archive, info, "it cannot be replayed");
  Scenario scenario = reloaded.scenario();
  const PolicySpec& policy = find_policy(request, info, scenario);
  out.archived = archive.trace(policy.name, request.particle);
  if (!out.archived) check_there(request, info, policy.name);
  const std::vector<double> archived_values = archive.particle_values(request.particle);
  end_of_reading();
  try_controllers(with_policy(scenario, policy));
  const Recording kept = scenario.recording;
  scenario.recording.telemetry = Telemetry::none;
  scenario.recording.events = scenario.recording.phases = true;

  ReplayFile& file = out.file;
  file.archive = request.archive;
  file.policy = policy.name;
  file.info = describe_campaign(scenario, info.particles, info.command_line);
  file.requirements = describe_requirements(scenario.task);
  const ParticleSource source(scenario, info.seed, info.particles);
  const std::vector<double> values = source.draw(request.particle);
  file.parameters = describe_parameters(scenario, file.info, values);
  std::optional<Particle> particle = fabricate(source, request.particle, values, file.trace, scenario);
  if (particle) {
    file.derived = describe_derived(source, values);
    file.trace = simulate_recorded(request, scenario, policy, out.archived, file.info, std::move(*particle), file.log);
  }
  if (out.archived) {
    file.archived_digest = out.archived->digest;
    out.differences = trace_differences(*out.archived, file.trace, file.info, kept);
    compare_values(archived_values, out, out.differences);
  }
  file.verification = !out.archived ? "unverified" : out.differences.empty() ? "identical" : "different";
  return out;
}

}  // namespace graze
