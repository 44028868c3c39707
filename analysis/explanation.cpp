#include "analysis/explanation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "analysis/explained_traces.h"
#include "analysis/significance.h"
#include "sampling/constants.h"

namespace graze {
namespace {

constexpr std::size_t kLeastOfAClass = 3;  // failures of a kind that are asked about
constexpr std::size_t kGrowthTraces = 100, kGrowthTimes = 8, kGrowthFreedoms = 6;

/// What is asked about the traces of a policy: targets by row of the table.
class Targets {
 public:
  Targets(const std::vector<ExplainedTrace>& traces, const ParticleValues& values) : traces_(traces), values_(values) {}
  /// value: of a valid trace; NaN: it does not count.
  template <class Value>
  void add(const std::string& name, const Value& value) {
    CauseTarget target{name, std::vector<double>(values_.particles.size(), kNaN)};
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      const std::size_t row = values_.row_of(traces_[i].particle);
      if (traces_[i].valid() && row < target.values.size()) target.values[row] = value(i);
    }
    const auto counts = [](double y) { return !std::isnan(y); };
    if (std::any_of(target.values.begin(), target.values.end(), counts)) list.push_back(std::move(target));
  }
  std::vector<CauseTarget> list;

 private:
  const std::vector<ExplainedTrace>& traces_;
  const ParticleValues& values_;
};

bool varies(const std::vector<ExplainedTrace>& traces, const std::function<double(const ExplainedTrace&)>& value) {
  double first = kNaN;
  for (const ExplainedTrace& trace : traces) {
    const double x = value(trace);
    if (!trace.valid() || std::isnan(x)) continue;
    if (std::isnan(first)) first = x;
    if (x != first) return true;
  }
  return false;
}

std::vector<CauseTarget> targets_of(const CampaignInfo& info, const std::vector<ExplainedTrace>& traces,
                                    const ParticleValues& values, const std::vector<int>& side,
                                    const std::string& side_name) {
  Targets targets(traces, values);
  const auto add_if = [&](const std::string& name, const std::function<double(const ExplainedTrace&)>& value) {
    if (varies(traces, value)) targets.add(name, [&](std::size_t i) { return value(traces[i]); });
  };
  add_if("success", [](const ExplainedTrace& t) { return t.outcome == Outcome::success ? 1.0 : 0.0; });
  for (std::size_t r = 0; r < info.deciding(); ++r) {
    const auto violates = [&](const ExplainedTrace& t) { return t.violated == static_cast<int>(r); };
    const auto count = static_cast<std::size_t>(std::count_if(traces.begin(), traces.end(), violates));
    if (count < kLeastOfAClass) continue;
    add_if("failure: " + info.requirements[r].name, [&](const ExplainedTrace& t) { return violates(t) ? 1.0 : 0.0; });
  }
  const auto unmet = [](const ExplainedTrace& t) { return t.outcome == Outcome::unknown_failure ? 1.0 : 0.0; };
  const auto unknown = std::count_if(traces.begin(), traces.end(), unmet);
  if (static_cast<std::size_t>(unknown) >= kLeastOfAClass) add_if("failure: objective unmet", unmet);
  if (!side.empty()) {
    targets.add(side_name, [&](std::size_t i) { return side[i] < 0 ? kNaN : static_cast<double>(side[i]); });
  }
  for (std::size_t r = 0; r < info.requirements.size(); ++r) {
    add_if("margin: " + info.requirements[r].name, [r](const ExplainedTrace& t) { return t.margins[r]; });
  }
  add_if("margin: objective", [](const ExplainedTrace& t) { return t.objective_margin; });
  return std::move(targets.list);
}

Scatter scatter_of(const std::vector<ExplainedTrace>& traces, const Freedoms& freedoms, DipTest& test,
                   const std::function<bool(const ExplainedTrace&)>& counts) {
  std::vector<std::vector<double>> columns(freedoms.names().size());
  if (columns.empty()) {
    Scatter none;
    none.traces = static_cast<std::size_t>(std::count_if(traces.begin(), traces.end(), counts));
    none.notes.push_back("nothing moves, so that there is no state to end in");
    return none;
  }
  for (const ExplainedTrace& trace : traces) {
    for (std::size_t k = 0; counts(trace) && k < columns.size(); ++k) columns[k].push_back(trace.freedoms[k]);
  }
  freedoms.unwrap(columns);
  return judge_scatter(freedoms.names(), freedoms.units(), columns, test);
}

bool ran_to_the_end(const ExplainedTrace& trace) { return trace.valid() && !trace.cut; }

/// Sides by trace, -1: it did not run to the end; what became of the traces of each.
std::vector<int> sides_of(const std::vector<ExplainedTrace>& traces, PolicyExplanation& out) {
  if (!out.ended.bifurcates()) return {};
  std::vector<int> side;
  std::size_t next = 0;
  out.modes.resize(out.ended.freedoms[static_cast<std::size_t>(out.ended.clearest)].modes.size());
  for (const ExplainedTrace& trace : traces) {
    side.push_back(ran_to_the_end(trace) ? out.ended.side[next++] : -1);
    if (side.back() < 0) continue;
    ModeTraces& mode = out.modes[static_cast<std::size_t>(side.back())];
    mode.particles.push_back(trace.particle);
    ++(trace.outcome == Outcome::success         ? mode.success
       : trace.outcome == Outcome::known_failure ? mode.known
                                                 : mode.unknown);
  }
  return side;
}

std::string side_name_of(const Scatter& scatter) {
  if (!scatter.bifurcates()) return {};
  const FreedomSpread& one = scatter.freedoms[static_cast<std::size_t>(scatter.clearest)];
  if (one.cuts.size() > 1) return "mode of " + one.name;
  return fmt::format("mode: {} > {:.4g}{}{}", one.name, one.cuts[0], one.unit.empty() ? "" : " ", one.unit);
}

void find_margins(const CampaignInfo& info, const std::vector<ExplainedTrace>& traces, PolicyExplanation& out) {
  const std::size_t requirements = info.requirements.size();
  for (std::size_t r = 0; r <= requirements; ++r) {
    std::vector<double> margins;
    std::vector<std::uint32_t> particles;
    for (const ExplainedTrace& trace : traces) {
      if (!trace.valid()) continue;
      margins.push_back(r < requirements ? trace.margins[r] : trace.objective_margin);
      particles.push_back(trace.particle);
    }
    MarginSummary& one = out.margins.emplace_back(summarise_margins(margins, particles));
    one.name = r < requirements ? info.requirements[r].name : "objective";
    one.unit = r < requirements ? info.requirements[r].unit : info.leaves.size() == 1 ? info.leaves[0].unit : "";
  }
}

/// The degrees of freedom that growth is told of.
std::vector<std::size_t> grown_freedoms(const Freedoms& freedoms) {
  std::vector<std::size_t> out;
  for (const bool floating : {true, false}) {
    for (std::size_t k = 0; out.size() < kGrowthFreedoms && k < freedoms.names().size(); ++k) {
      if (!freedoms.units()[k].empty() == floating) out.push_back(k);
    }
    if (!out.empty()) break;
  }
  return out;
}

void find_growth(const Archive& archive, const std::vector<ExplainedTrace>& traces, const Freedoms& freedoms,
                 PolicyExplanation& out) {
  Growth& growth = out.growth;
  std::vector<std::uint32_t> ended;
  for (const ExplainedTrace& trace : traces) {
    if (ran_to_the_end(trace)) ended.push_back(trace.particle);
  }
  if (freedoms.names().empty()) {
    growth.note = "nothing moves";
    return;
  }
  constexpr std::size_t kFewest = 3;
  const std::size_t count = std::min(ended.size(), kGrowthTraces);
  if (count < kFewest) {
    growth.note = fmt::format("growth over time needs {} traces that ran to the end; {} did", kFewest, ended.size());
    return;
  }
  growth.note = "growth over time needs telemetry of traces that ran to the end (record telemetry: all)";
  const std::vector<std::size_t> chosen = grown_freedoms(freedoms);
  std::vector<std::vector<std::vector<double>>> at(kGrowthTimes,
                                                   std::vector<std::vector<double>>(freedoms.names().size()));
  std::vector<double> state(freedoms.names().size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::vector<TelemetryFrame> frames = archive.telemetry(out.policy, ended[i * ended.size() / count]);
    if (frames.empty() || frames.front().time > archive.info().end / kGrowthTimes) return;
    for (std::size_t t = 0; t < kGrowthTimes; ++t) {
      const double time = archive.info().end * static_cast<double>(t + 1) / kGrowthTimes;
      const auto behind = std::find_if(frames.begin(), frames.end(),
                                       [&](const TelemetryFrame& f) { return f.time > time * (1 + 1e-9); });
      freedoms.read(std::prev(behind)->q, state);
      for (std::size_t k = 0; k < state.size(); ++k) at[t][k].push_back(state[k]);
    }
  }
  growth.note.clear();
  growth.traces = count;
  for (const std::size_t k : chosen) {
    growth.names.push_back(freedoms.names()[k]);
    growth.units.push_back(freedoms.units()[k]);
  }
  for (std::size_t t = 0; t < kGrowthTimes; ++t) {
    freedoms.unwrap(at[t]);
    SpreadAt& one = growth.times.emplace_back();
    one.time = archive.info().end * static_cast<double>(t + 1) / kGrowthTimes;
    for (const std::size_t k : chosen) one.deviations.push_back(deviation_of(at[t][k]));
  }
}

void find_sizes(PolicyExplanation& out) {
  const double rate = static_cast<double>(out.success) / static_cast<double>(out.n);
  for (const double half : kHalfWidths) out.sizes.push_back(out.n > 0 ? particles_for_width(rate, half) : 0);
  for (const double bound : kBounds) {
    out.decisions.push_back(out.n > 0 ? particles_to_decide(rate, bound) : DecisionSize{bound});
  }
}

void count(const std::vector<ExplainedTrace>& traces, PolicyExplanation& out) {
  for (const ExplainedTrace& trace : traces) {
    out.n += trace.valid();
    out.success += trace.outcome == Outcome::success;
    out.known += trace.outcome == Outcome::known_failure;
    out.unknown += trace.outcome == Outcome::unknown_failure;
    out.invalid += !trace.valid();
  }
}

/// Paired by particle.
SurvivalPair compare(const std::string& name_a, const std::vector<ExplainedTrace>& a, const std::string& name_b,
                     const std::vector<ExplainedTrace>& b, std::size_t deciding) {
  std::vector<Lifetime> of_a, of_b;
  for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
    if (a[i].particle != b[k].particle) {
      ++(a[i].particle < b[k].particle ? i : k);
      continue;
    }
    if (a[i].valid() && b[k].valid()) {
      of_a.push_back(lifetime_of(a[i], -1, deciding));
      of_b.push_back(lifetime_of(b[k], -1, deciding));
    }
    ++i;
    ++k;
  }
  return {name_a, name_b, log_rank({of_a, of_b}), paired_log_rank(of_a, of_b), 1};
}

void compare_all(const std::vector<std::vector<ExplainedTrace>>& traces, std::size_t deciding, Explanation& out) {
  std::vector<std::vector<Lifetime>> groups;
  for (const auto& of_policy : traces) {
    groups.emplace_back();
    for (const ExplainedTrace& trace : of_policy) {
      if (trace.valid()) groups.back().push_back(lifetime_of(trace, -1, deciding));
    }
  }
  out.log_rank = log_rank(groups);
  std::vector<double> p_values;
  for (std::size_t i = 0; i < traces.size(); ++i) {
    for (std::size_t k = i + 1; k < traces.size(); ++k) {
      out.pairs.push_back(compare(out.policies[i].policy, traces[i], out.policies[k].policy, traces[k], deciding));
      p_values.push_back(out.pairs.back().paired.p_value);
    }
  }
  const std::vector<double> adjusted = holm(p_values);
  for (std::size_t i = 0; i < out.pairs.size(); ++i) out.pairs[i].p_holm = adjusted[i];
}

/// Causes of what became of traces, and, with `stories`, of the ways that they went.
void find_all_causes(const CampaignInfo& info, const std::vector<ExplainedTrace>& traces, const Stories* stories,
                     const ParticleValues& values, const std::vector<int>& side, PolicyExplanation& out) {
  out.causes = find_causes(values.table, targets_of(info, traces, values, side, side_name_of(out.ended)));
  const std::size_t others = out.causes.size();
  if (stories != nullptr) {
    const EventTree tree = event_tree(*stories, info);
    for (auto& of_node : bifurcation_causes(tree, *stories, EventWords(info, Detail::features), values)) {
      for (BifurcationCauses& one : of_node) out.causes.push_back(std::move(one.causes));
    }
  }
  out.bifurcations = out.causes.size() - others;
  for (const Causes& causes : out.causes) out.verdicts.push_back(verdict_text(causes, values.table));
}

PolicyExplanation explain_policy(const Archive& archive, const std::string& policy,
                                 const std::vector<ExplainedTrace>& traces, const Stories* stories,
                                 const Freedoms& freedoms, const ParticleValues& values, DipTest& test) {
  const CampaignInfo& info = archive.info();
  PolicyExplanation out;
  out.policy = policy;
  count(traces, out);
  out.ended = scatter_of(traces, freedoms, test, ran_to_the_end);
  out.all = scatter_of(traces, freedoms, test, [](const ExplainedTrace& trace) { return trace.valid(); });
  const std::vector<int> side = sides_of(traces, out);
  if (values.none().empty()) find_all_causes(info, traces, stories, values, side, out);
  find_growth(archive, traces, freedoms, out);
  out.survival = survivals(info, traces);
  find_margins(info, traces, out);
  find_sizes(out);
  return out;
}

}  // namespace

const MarginSummary* margins_of(const Causes& causes, const std::vector<MarginSummary>& margins) {
  const auto is = [&](const MarginSummary& one) { return "margin: " + one.name == causes.target; };
  const auto found = std::find_if(margins.begin(), margins.end(), is);
  return found == margins.end() ? nullptr : &*found;
}

Explanation explain(const Archive& archive, const std::vector<std::string>& chosen, const ExplainOptions& options) {
  const CampaignInfo& info = archive.info();
  const std::vector<std::string>& policies = chosen.empty() ? info.policies : chosen;
  Explanation out;
  out.campaign = info.scenario_name;
  out.archive = archive.path().string();
  out.complete = archive.complete();
  out.particles = info.particles;
  out.score = score(archive, "", policies);
  out.rates = rate_statistics(out.score);
  const std::uint64_t asked = info.part.count(info.particles);
  out.looked_at = std::min(asked, options.most_particles);
  const std::uint64_t end = info.part.begin + out.looked_at;
  if (out.looked_at < asked) {
    out.notes.push_back(fmt::format("rates are of all particles, everything else of the first {}", out.looked_at));
  }
  ParticleValues values = read_particle_values(archive, end);
  StoryRules rules;
  rules.detail = Detail::features;  // as `graze events` looks for bifurcations
  StoriesRead told;
  if (!values.none().empty()) {
    out.notes.push_back("no causes: " + values.none());
  } else {
    told = look_for_stories(archive, policies, rules, end);
  }
  const Freedoms freedoms(info.q_names);
  DipTest test;
  std::vector<std::vector<ExplainedTrace>> traces;
  for (std::size_t p = 0; p < policies.size(); ++p) {
    traces.push_back(explained_traces(archive, policies[p], freedoms, end));
    const Stories* stories = told.stories.empty() ? nullptr : &told.stories[p];
    out.policies.push_back(explain_policy(archive, policies[p], traces.back(), stories, freedoms, values, test));
  }
  out.parameters = std::move(values.table);
  compare_all(traces, info.deciding(), out);
  return out;
}

Explanation explain_survival(const Archive& archive, const std::vector<std::string>& chosen,
                             const ExplainOptions& options) {
  const CampaignInfo& info = archive.info();
  Explanation out;
  out.campaign = info.scenario_name;
  out.archive = archive.path().string();
  out.complete = archive.complete();
  out.particles = info.particles;
  const std::uint64_t asked = info.part.count(info.particles);
  out.looked_at = std::min(asked, options.most_particles);
  if (out.looked_at < asked) out.notes.push_back(fmt::format("of the first {} particles", out.looked_at));
  std::vector<std::vector<ExplainedTrace>> traces;
  for (const std::string& policy : chosen.empty() ? info.policies : chosen) {
    traces.push_back(explained_traces(archive, policy, Freedoms({}), info.part.begin + out.looked_at));
    PolicyExplanation& one = out.policies.emplace_back();
    one.policy = policy;
    count(traces.back(), one);
    one.survival = survivals(info, traces.back());
  }
  compare_all(traces, info.deciding(), out);
  return out;
}

}  // namespace graze
