#include "jobs/workers/determinism.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "archive/files/utf8.h"
#include "jobs/workers/controllers.h"
#include "simulation/contained.h"
#include "simulation/particles.h"

namespace graze {
namespace {

using Records = std::map<std::uint32_t, TraceRecord>;

/// How two traces of one particle differ; empty: they are the same bits.
std::string difference_of(const TraceRecord& a, const TraceRecord& b) {
  if (a.outcome != b.outcome) {
    return fmt::format("{} once, {} then", outcome_name(a.outcome), outcome_name(b.outcome));
  }
  if (a.digest == b.digest && a.invalid_reason == b.invalid_reason) return "";
  if (a.outcome == Outcome::invalid) return "invalid both times, for other reasons or at other steps";
  return fmt::format("{} both times, by other states (digest {:016x}, then {:016x})", outcome_name(a.outcome), a.digest,
                     b.digest);
}

class PromiseCheck {
 public:
  PromiseCheck(const Scenario& scenario, double watchdog)
      : scenario_(scenario),
        count_(std::min<std::uint64_t>(2 * kLanes, std::max<std::uint64_t>(scenario.particles, 1))),
        source_(scenario, scenario.seed, scenario.particles),
        elsewhere_(controllers_elsewhere(scenario, scenario.seed, scenario.particles, watchdog)) {}

  PromiseReport of(int policy, const SimulationBegins& begins) const {
    PromiseReport out;
    out.policy = scenario_.policies[static_cast<std::size_t>(policy)].name;
    const auto block = std::min<std::uint64_t>(count_, kLanes);
    std::vector<std::uint32_t> first, reversed;
    for (std::uint32_t id = 0; id < block; ++id) first.push_back(id);
    for (auto id = static_cast<std::uint32_t>(count_); id-- > 0;) reversed.push_back(id);
    std::size_t done = 0;
    const auto tell = [&](const std::string& what) {
      if (begins) begins(out.policy, what, done, 3 + first.size());
      ++done;
    };
    TraceWatch watch;
    ContainedRun run(scenario_, scenario_.seed, watch, elsewhere_);
    tell(fmt::format("{} particles", first.size()));
    const Records reference = simulate(run, policy, first, out);
    out.particles = reference.size();
    for (const auto& [id, record] : reference) out.invalid += record.outcome == Outcome::invalid;
    tell("the same again");
    compare(reference, simulate(run, policy, first, out), "a second time by the same controller", out);
    tell(fmt::format("{} particles in reverse order", reversed.size()));
    compare(reference, simulate(run, policy, reversed, out), "in other lanes, beside and after others", out);
    for (const std::uint32_t id : first) {
      tell(fmt::format("particle {} alone", id));
      ContainedRun fresh(scenario_, scenario_.seed, watch, elsewhere_);
      compare(reference, simulate(fresh, policy, {id}, out), "alone, by a fresh controller", out);
    }
    return out;
  }

 private:
  Records simulate(ContainedRun& run, int policy, const std::vector<std::uint32_t>& ids, PromiseReport& report) const {
    WorkUnit unit;
    unit.policy = policy;
    for (const std::uint32_t id : ids) {
      try {
        unit.particles.push_back(source_.fabricate(id, source_.draw(id)));
      } catch (const InputError&) {  // the same each time
      }
    }
    if (unit.particles.empty()) return {};
    run.run(unit);
    report.unfinished += unit.unfinished.size();
    if (unit.mixes_up() && report.mixed_up++ == 0) report.failed = unit.failed_together;
    report.late += unit.mixes_up() && unit.came_late;
    Records out;
    for (TraceRecord& record : unit.records) out[record.particle] = std::move(record);
    return out;
  }

  static void compare(const Records& reference, const Records& other, const std::string& company, PromiseReport& out) {
    for (const auto& [id, record] : other) {
      const auto known = reference.find(id);
      if (known == reference.end()) continue;
      ++out.comparisons;
      const std::string difference = difference_of(known->second, record);
      if (!difference.empty()) out.broken.push_back({id, company, difference});
    }
  }

  const Scenario& scenario_;
  const std::uint64_t count_;
  const ParticleSource source_;
  const RunElsewhere elsewhere_;
};

}  // namespace

namespace {

std::string verdict_of(const PromiseReport& report) {
  if (!report.broken.empty()) return fmt::format("{} came out ANOTHER WAY", report.broken.size());
  if (report.mixed_up > 0) {
    return fmt::format("{} {} although its robots do not: robots or lanes are mixed up{}",
                       report.mixed_up == 1 ? "a block" : fmt::format("{} blocks", report.mixed_up),
                       report.late == report.mixed_up ? "did NOT COME BACK" : "FAILED",
                       report.late == report.mixed_up ? ", or the controller is too slow for its timeout" : "");
  }
  if (report.unfinished > 0) return fmt::format("{} traces were left unfinished, so nobody knows", report.unfinished);
  if (!report.compared()) return "NOTHING was compared: no trace is valid ('graze run' tells why)";
  return "the same bits in any company";
}

}  // namespace

std::vector<PromiseReport> check_promises(const Scenario& scenario, double watchdog, const SimulationBegins& begins,
                                          const std::function<void(const PromiseReport&)>& ends) {
  try_controllers(scenario);
  const PromiseCheck check(scenario, watchdog);
  std::vector<PromiseReport> out;
  for (std::size_t i = 0; i < scenario.policies.size(); ++i) {
    out.push_back(check.of(static_cast<int>(i), begins));
    if (ends) ends(out.back());
  }
  return out;
}

std::string promise_text(const PromiseReport& report) {
  constexpr std::size_t kShown = 5;
  const std::string invalid = report.invalid > 0 ? fmt::format(", {} of them invalid", report.invalid) : "";
  std::string out = fmt::format("{}: {} particles{}, {} comparisons: {}\n", report.policy, report.particles, invalid,
                                report.comparisons, verdict_of(report));
  if (report.mixed_up > 0) {
    out += fmt::format("  beside others, and no more when each robot was alone: {}\n", printable(report.failed));
  }
  for (std::size_t i = 0; i < std::min(kShown, report.broken.size()); ++i) {
    const BrokenPromise& one = report.broken[i];
    out += fmt::format("  particle {}, {}: {}\n", one.particle, one.company, one.difference);
  }
  if (report.broken.size() > kShown) out += fmt::format("  … {} more\n", report.broken.size() - kShown);
  return out;
}

}  // namespace graze
