#include "jobs/campaign/source_study.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>
#include <set>

#include "archive/files/utf8.h"
#include "jobs/campaign/campaign.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/campaign/ranks.h"
#include "simulation/contained.h"

namespace graze {
namespace {

/// Those that the scenario has, between "none" and "all".
std::vector<std::string> sources_of(const Scenario& scenario) {
  std::set<std::string> there;
  for (const UncertainParameter& parameter : scenario.space.parameters) {
    if (is_uncertain(parameter)) there.insert(source_of(parameter.name));
  }
  std::vector<std::string> out = {"none"};
  for (const std::string& name : source_names()) {
    if (there.count(name) > 0) out.push_back(name);
  }
  if (!there.empty()) out.emplace_back("all");
  return out;
}

SourceLayout layout_of(const Model& model) {
  SourceLayout out;
  if (model.floating_base) out.base = model.bodies.front().q;
  for (const int body : model.actuated) out.joints.push_back(model.bodies[static_cast<std::size_t>(body)].q);
  return out;
}

/// Traces of all policies, [policy][particle].
std::vector<std::vector<SourceTrace>> simulate(const Scenario& scenario, const SourceQuestion& question,
                                               std::uint64_t particles) {
  std::vector<std::vector<SourceTrace>> out(scenario.policies.size());
  for (auto& policy : out) policy.resize(particles);
  CampaignOptions options;
  options.particles = particles;
  options.seed = question.seed;
  options.threads = question.threads;
  options.watchdog = question.watchdog;
  std::mutex mutex;
  std::string unfinished, invalid;  // the first of each, by the clock
  options.unfinished = [&](const std::string& policy, const UnfinishedParticle& one) {
    const std::lock_guard lock(mutex);
    if (!unfinished.empty()) return;
    unfinished = fmt::format("policy {}, particle {}: {}{}", printable(policy), one.particle, printable(one.reason),
                             one.by_controller ? "" : "; --watchdog 0 waits");
  };
  const double end = scenario.timing.end, step = scenario.timing.step;
  const TraceSink sink = [&](int policy, std::vector<TraceRecord> traces, const std::vector<double>&) {
    const std::lock_guard lock(mutex);
    for (TraceRecord& one : traces) {
      if (one.outcome == Outcome::invalid && invalid.empty()) {
        const std::string& name = scenario.policies[static_cast<std::size_t>(policy)].name;
        invalid =
            fmt::format("policy {}, particle {}: {}", printable(name), one.particle, printable(one.invalid_reason));
      }
      const bool lasted = one.end_time > end - 0.5 * step;
      out[static_cast<std::size_t>(policy)][one.particle] = {one.outcome, one.end_time, lasted, std::move(one.q)};
    }
  };
  const auto comm = make_local_communicator();
  const CampaignEnd run = run_campaign(scenario, options, *comm, sink);
  std::exception_ptr error = run.error;
  if (!error && !run.complete()) {
    error = std::make_exception_ptr(MachineError(
        fmt::format("sources: {} traces were left unfinished; the first: {}", run.unfinished, unfinished)));
  }
  if (!run.hanging.empty()) leave_hanging(*comm, report_error(error));
  if (error) std::rethrow_exception(error);
  if (!invalid.empty()) spdlog::warn("sources: some traces are invalid; one of them: {}", invalid);
  return out;
}

}  // namespace

std::vector<SourceSpread> study_sources(const Scenario& scenario, const SourceQuestion& question) {
  std::vector<SourceSpread> out;
  const SourceLayout layout = layout_of(scenario.model);
  const std::vector<std::string> sources = sources_of(scenario);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const std::string& source = sources[i];
    if (question.begins) question.begins(source, i + 1, sources.size());
    Scenario alone = scenario;
    alone.space = space_of_source(scenario.space, source);
    const std::uint64_t particles = source == "none" ? 1 : question.particles;
    const auto traces = simulate(alone, question, particles);
    for (std::size_t policy = 0; policy < traces.size(); ++policy) {
      SourceSpread& row = out.emplace_back();
      row.source = source;
      row.policy = scenario.policies[policy].name;
      row.parameters = static_cast<std::size_t>(
          std::count_if(alone.space.parameters.begin(), alone.space.parameters.end(), is_uncertain));
      summarise_source(traces[policy], layout, row);
    }
  }
  return out;
}

}  // namespace graze
