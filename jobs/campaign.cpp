#include "jobs/campaign.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <map>
#include <optional>

#include "jobs/block_run.h"

namespace graze {
namespace {

std::vector<std::string> parameter_paths(const Scenario& scenario) {
  std::vector<std::string> paths;
  for (const UncertainParameter& parameter : scenario.space.parameters) paths.push_back(parameter.name);
  return paths;
}

/// The particles of one unit of work: those that could be made, and the records of those that could not.
struct Group {
  std::vector<Particle> particles;
  std::vector<double> values;  // of `particles`, [particle][parameter]
  std::vector<TraceRecord> failed;
  std::vector<double> failed_values;
};

TraceRecord unfabricated(std::uint32_t id, const Scenario& scenario, const std::string& reason) {
  TraceRecord record;
  record.particle = id;
  record.outcome = Outcome::invalid;
  record.invalid_reason = reason;
  const double never = std::numeric_limits<double>::quiet_NaN();
  record.margins.assign(scenario.task.requirements.size(), never);
  record.first_violations.assign(scenario.task.requirements.size(), never);
  record.objective_margin = never;
  record.q.assign(scenario.model.nq, never);
  record.v.assign(scenario.model.nv, never);
  return record;
}

/// Particles per unit of work: a block. Where lanes cost the same whether they are busy or not and traces may end
/// early, several blocks, so that lanes that have ended can be refilled; but no less than 8 units for each thread.
std::uint64_t group_size(const Scenario& scenario, const CampaignOptions& options) {
  constexpr std::uint64_t kMostBlocks = 8, kUnitsPerThread = 8;
  if (scenario.physics != "lanes" || !scenario.task.stop_at_violation) return kLanes;
  const int threads = options.threads > 0 ? options.threads : tbb::this_task_arena::max_concurrency();
  const std::uint64_t traces = options.particles * scenario.policies.size();
  const std::uint64_t blocks = traces / (kLanes * kUnitsPerThread * static_cast<std::uint64_t>(threads));
  return kLanes * std::clamp<std::uint64_t>(blocks, 1, kMostBlocks);
}

class Campaign {
 public:
  Campaign(const Scenario& scenario, const CampaignOptions& options, CampaignProgress& progress, const TraceSink& sink)
      : scenario_(scenario),
        options_(options),
        progress_(progress),
        sink_(sink),
        sampler_(scenario.space, scenario.design, options.seed, options.particles),
        fabricator_(scenario.world, parameter_paths(scenario)),
        group_(group_size(scenario, options)) {}

  bool run() {
    const std::uint64_t groups = (options_.particles + group_ - 1) / group_;
    const std::uint64_t units = groups * scenario_.policies.size();
    tbb::task_arena arena(options_.threads > 0 ? options_.threads : tbb::task_arena::automatic);
    arena.execute([&] {
      tbb::parallel_for(
          tbb::blocked_range<std::uint64_t>(0, units, 1),
          [&](const tbb::blocked_range<std::uint64_t>& range) {
            for (std::uint64_t unit = range.begin(); unit < range.end() && !stopped(); ++unit) run_unit(unit);
          },
          tbb::simple_partitioner());
    });
    return progress_.traces + options_.finished == options_.particles * scenario_.policies.size();
  }

 private:
  bool stopped() const { return options_.stop && options_.stop->load(std::memory_order_relaxed); }

  void run_unit(std::uint64_t unit) {
    const int policies = static_cast<int>(scenario_.policies.size());
    const int policy = static_cast<int>(unit % policies);
    Group group = make_group(unit / policies, scenario_.policies[policy].name);
    if (group.particles.empty() && group.failed.empty()) return;
    auto& runs = runs_.local();
    auto run = runs.find(policy);
    if (run == runs.end()) {
      run = runs.emplace(policy, BlockRun(scenario_, scenario_.policies[policy], options_.seed)).first;
    }
    RunCost cost;
    std::vector<TraceRecord> records = run->second.run(group.particles, &cost);
    std::move(group.failed.begin(), group.failed.end(), std::back_inserter(records));
    group.values.insert(group.values.end(), group.failed_values.begin(), group.failed_values.end());
    count(records, cost);
    sink_(policy, std::move(records), std::move(group.values));
  }

  /// The particles of a group that are not finished under a policy.
  Group make_group(std::uint64_t index, const std::string& policy) {
    Group group;
    const std::uint64_t end = std::min<std::uint64_t>(options_.particles, (index + 1) * group_);
    for (std::uint64_t i = index * group_; i < end; ++i) {
      if (options_.is_finished && options_.is_finished(policy, i)) continue;
      const auto id = static_cast<std::uint32_t>(i);
      const std::vector<double> values = sampler_.draw(id);
      try {
        group.particles.push_back(fabricator_.fabricate(id, values));
        group.values.insert(group.values.end(), values.begin(), values.end());
      } catch (const InputError& error) {
        group.failed.push_back(unfabricated(id, scenario_, error.what()));
        group.failed_values.insert(group.failed_values.end(), values.begin(), values.end());
      }
    }
    return group;
  }

  void count(const std::vector<TraceRecord>& records, const RunCost& cost) {
    for (const TraceRecord& record : records) {
      switch (record.outcome) {
        case Outcome::success:
          ++progress_.success;
          break;
        case Outcome::known_failure:
          ++progress_.known;
          break;
        case Outcome::unknown_failure:
          ++progress_.unknown;
          break;
        case Outcome::invalid:
          ++progress_.invalid;
          break;
      }
    }
    progress_.steps += cost.steps;
    progress_.traces += records.size();
  }

  const Scenario& scenario_;
  const CampaignOptions& options_;
  CampaignProgress& progress_;
  const TraceSink& sink_;
  const Sampler sampler_;
  const Fabricator fabricator_;
  const std::uint64_t group_;                                      // particles per unit of work
  tbb::enumerable_thread_specific<std::map<int, BlockRun>> runs_;  // by policy, made when first needed
};

}  // namespace

bool run_campaign(const Scenario& scenario, const CampaignOptions& options, CampaignProgress& progress,
                  const TraceSink& sink) {
  return Campaign(scenario, options, progress, sink).run();
}

}  // namespace graze
