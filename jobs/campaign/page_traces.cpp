#include "jobs/campaign/page_traces.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/failures.h"
#include "archive/files/utf8.h"
#include "archive/schema/culprit.h"
#include "engine/library/library_use.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/campaign/hanging_controllers.h"
#include "jobs/campaign/page_scene.h"
#include "jobs/campaign/trace_frames.h"
#include "jobs/workers/controllers.h"
#include "simulation/simulation.h"
#include "simulation/step_recorder.h"

namespace graze {
namespace {

constexpr double kFrame = 0.02;         // s: 50 frames per second
constexpr double kMostFrames = 600;     // of one trace
constexpr double kMostNumbers = 2.5e6;  // of all channels and poses of a page: 7 MB

struct Channel {
  std::string group, name, unit;
};

/// In the order of TraceFrames::rows.
std::vector<Channel> channels_of(const Scenario& scenario) {
  std::vector<Channel> out;
  const auto add = [&](const char* group, const std::vector<NamedColumn>& columns) {
    for (const NamedColumn& one : columns) out.push_back({group, one.name, one.unit});
  };
  const StateColumns state = state_columns(scenario, trace_names(scenario.model));
  add("position", state.q);
  add("velocity", state.v);
  add("torque", state.tau);
  add("requirement", state.requirements);
  for (std::size_t r = 0; r < state.requirements.size(); ++r) {
    if (scenario.task.requirements[r].measure) out[out.size() - state.requirements.size() + r].group = "measure";
  }
  add("objective", state.objective);
  return out;
}

std::uint32_t steps_between(const Scenario& scenario, std::size_t channels, const std::vector<PageTrace>& traces) {
  double columns = 0;  // of all traces
  for (const PageTrace& one : traces) {
    columns += static_cast<double>(channels + (one.bodies ? 7 * scenario.model.bodies.size() : 0));
  }
  const double frames = std::min(kMostFrames, std::max(10.0, kMostNumbers / std::max(columns, 1.0)));
  const double between = std::max(kFrame, scenario.timing.end / frames);
  return static_cast<std::uint32_t>(std::max(1.0, std::round(between / scenario.timing.step)));
}

Json phases_json(const std::vector<ContactPhase>& phases) {
  Json out = Json::array();
  for (const ContactPhase& p : phases) {
    out.push_back(
        {short_number(p.begin), short_number(p.end), p.a, p.b, short_number(p.peak), short_number(p.impulse)});
  }
  return out;
}

/// What is known of a trace without its frames.
Json trace_json(const PageTrace& one, const CampaignInfo& info, const std::string& name, const TraceRecord& trace) {
  const auto violated = static_cast<std::size_t>(std::max(trace.violated, 0));
  const bool known = trace.outcome == Outcome::known_failure;
  Culprit culprit = trace.objective_culprit;
  if (known && !trace.violation_parts.empty()) culprit = {-1, trace.violation_parts.at(violated)};
  const bool failed = known || trace.outcome == Outcome::unknown_failure;
  return {{"policy", one.chosen.policy},
          {"particle", one.chosen.particle},
          {"why", one.chosen.why},
          {"outcome", outcome_name(trace.outcome)},
          {"what", known    ? info.requirements.at(violated).name
                   : failed ? "objective"
                            : ""},
          {"culprit", failed ? culprit_text(known ? trace.violated : -1, culprit, info) : ""},
          {"violated_at", known ? short_number(trace.first_violations.at(violated)) : Json(nullptr)},
          {"end", short_number(trace.end_time)},
          {"reason", trace.invalid_reason},
          {"objective_margin", short_number(trace.objective_margin)},
          {"margins", numbers(trace.margins, NumberForm::plain)},
          {"phases", phases_json(trace.phases)},
          {"replay", replay_command(name, one.chosen.policy, one.chosen.particle, needs_trust(info))}};
}

Json frames_json(const TraceFrames& frames, NumberForm form) {
  Json rows = Json::array();
  for (const std::vector<double>& row : frames.rows) rows.push_back(numbers(row, form));
  return rows;
}

std::string title(const ChosenTrace& one) {
  return fmt::format("particle {} under policy '{}'", one.particle, one.policy);
}

/// s; of a trace whose simulation threw nobody knows it.
double end_of(const PageTrace& one, const CampaignInfo& info) {
  return std::isfinite(one.archived.end_time) ? one.archived.end_time : info.end;
}

/// Simulates the traces of one policy, and puts them where they stand among all.
class PolicyPlayer {
 public:
  PolicyPlayer(const Simulation& simulation, const CampaignInfo& info, const std::string& name, std::uint32_t every,
               NumberForm form)
      : simulation_(simulation), info_(info), name_(name), every_(every), form_(form) {}

  void play(const std::string& policy, const std::vector<PageTrace>& traces, std::vector<Json>& out) {
    const bool of_library = is_of_library(policy);
    std::vector<Particle> particles;
    std::vector<std::size_t> places;
    std::set<std::uint32_t> bodies;
    std::map<std::uint32_t, double> ends;
    for (std::size_t i = 0; i < traces.size(); ++i) {
      if (traces[i].chosen.policy != policy) continue;
      if (of_library && !may_play(traces[i])) {
        out[i] = trace_json(traces[i], info_, name_, traces[i].archived);
        continue;
      }
      // A trace that goes on beyond its archived end goes another way: it is not followed for ever.
      ends[traces[i].chosen.particle] = end_of(traces[i], info_) + 1.5 * info_.step;
      try {
        particles.push_back(simulation_.particle(traces[i].chosen.particle));
      } catch (const InputError&) {  // it could not be fabricated, as the archive knows
        out[i] = trace_json(traces[i], info_, name_, traces[i].archived);
        continue;
      }
      places.push_back(i);
      if (traces[i].bodies) bodies.insert(traces[i].chosen.particle);
    }
    FrameWatch watch(every_, bodies, ends);
    Simulator simulator(simulation_, policy);
    const std::vector<TraceRecord> records = simulator.run(particles, {.observer = &watch});
    for (std::size_t k = 0; k < records.size(); ++k) {
      out[places[k]] = played(traces[places[k]], records[k], watch.take(records[k].particle));
    }
  }
  const std::vector<std::string>& different() const { return different_; }
  const std::vector<std::string>& kept() const { return kept_; }

 private:
  /// Whether the controller is a stranger's, which is run only if the user trusts it.
  bool is_of_library(const std::string& policy) {
    const Scenario& scenario = simulation_.scenario();
    const std::size_t index = static_cast<std::size_t>(simulation_.policy(policy));
    const bool of_library = is_from_outside(scenario.policies[index].settings);
    if (of_library && !controllers_trusted()) kept_.push_back(policy);
    return of_library;
  }
  /// What failed there may crash here.
  static bool may_play(const PageTrace& one) {
    return controllers_trusted() && one.archived.outcome != Outcome::invalid;
  }

  Json played(const PageTrace& one, const TraceRecord& record, const TraceFrames& frames) {
    const bool same = record.digest == one.archived.digest && record.outcome == one.archived.outcome;
    if (!same) different_.push_back(title(one.chosen));
    Json out = trace_json(one, info_, name_, record);
    out["identical"] = same;
    out["time"] = numbers(frames.time, NumberForm::plain);
    out["rows"] = frames_json(frames, form_);
    if (one.bodies) out["bodies"] = bodies_json(frames, form_);
    return out;
  }

  const Simulation& simulation_;
  const CampaignInfo& info_;
  const std::string& name_;
  const std::uint32_t every_;
  const NumberForm form_;
  std::vector<std::string> different_, kept_;
};

}  // namespace

std::vector<PageTrace> find_traces(const Archive& archive, const std::vector<ChosenTrace>& chosen, std::size_t bodies) {
  std::vector<PageTrace> out;
  for (const ChosenTrace& one : chosen) {
    std::optional<TraceRecord> trace = archive.trace(one.policy, one.particle);
    const std::uint64_t particles = archive.info().particles;
    if (!trace && one.particle >= particles) {
      throw InputError(
          fmt::format("--particle {}: {} has particles 0 to {}", one.particle, archive.path().string(), particles - 1));
    }
    if (!trace) {
      throw InputError(
          fmt::format("--particle {}: {} holds no trace of it under policy '{}' (it was not finished yet, "
                      "or not at all)",
                      one.particle, archive.path().string(), one.policy));
    }
    out.push_back({one, out.size() < bodies, std::move(*trace)});
  }
  return out;
}

std::vector<std::string> add_traces(Json& page, const Scenario& scenario, const CampaignInfo& info,
                                    const std::string& name, std::vector<PageTrace> traces, NumberForm form) {
  Scenario own = scenario;
  own.recording.telemetry = Telemetry::none;
  own.recording.events = false;
  own.recording.phases = true;
  double steps = 0;
  for (const PageTrace& one : traces) steps += end_of(one, info) / info.step;
  check_effort(steps, fmt::format("{} traces have", traces.size()));
  std::set<std::string> policies;
  for (const PageTrace& one : traces) policies.insert(one.chosen.policy);
  std::erase_if(own.policies, [&](const PolicySpec& one) { return !policies.contains(one.name); });
  std::optional<EndHangingControllers> watch;
  if (controllers_trusted()) {
    load_controllers_here(own);
    watch.emplace();
  }
  const Simulation simulation(std::move(own), info.particles);
  const std::vector<Channel> channels = channels_of(simulation.scenario());
  PolicyPlayer player(simulation, info, name, steps_between(simulation.scenario(), channels.size(), traces), form);
  std::vector<Json> played(traces.size());
  for (const std::string& policy : policies) player.play(policy, traces, played);
  page["channels"] = Json::array();
  for (const Channel& one : channels) {
    page["channels"].push_back({{"group", one.group}, {"name", one.name}, {"unit", one.unit}});
  }
  page["trajectories"] = played;
  page["scene"] = scene_json(simulation.nominal(), form);
  if (const std::vector<std::string>& kept = player.kept(); !kept.empty()) {
    const bool one = kept.size() == 1;
    const std::string note = fmt::format(
        "{} {} {} from outside, which {}; {} traces are shown as far as the archive knows them.",
        one ? "Policy" : "Policies", fmt::join(kept, ", "), one ? "is a controller" : "are controllers",
        controllers_distrusted() ? "did not run for this page, because a controller had ended the process that makes it"
        : one                    ? "runs for this page with --trust alone"
                                 : "run for this page with --trust alone",
        one ? "its" : "their");
    page["notes"].push_back(note);
    spdlog::warn("{}", printable(note));
  }
  for (const std::string& one : player.different()) {
    page["notes"].push_back(one + " went another way than the archive says; it is shown as it came out now.");
  }
  return player.different();
}

void add_archived_traces(Json& page, const CampaignInfo& info, const std::string& name,
                         const std::vector<PageTrace>& traces) {
  page["trajectories"] = Json::array();
  for (const PageTrace& one : traces) page["trajectories"].push_back(trace_json(one, info, name, one.archived));
}

}  // namespace graze
