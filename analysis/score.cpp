// score(): counts, intervals and paired comparisons. docs/statistics.md says what the numbers mean.
#include "analysis/score.h"

#include <algorithm>
#include <limits>

#include "analysis/proportions.h"
#include "analysis/sequential.h"
#include "archive/files/shell_word.h"
#include "archive/outcomes.h"

namespace graze {
namespace {

/// Which particles have a valid trace under a policy, and which of these succeeded: two bits each.
struct Ends {
  std::vector<bool> valid, success;

  void add(const TraceOutcome& trace) {
    if (trace.outcome == Outcome::invalid) return;
    if (trace.particle >= valid.size()) {
      const std::size_t size = std::max<std::size_t>(std::size_t{trace.particle} + 1, 2 * valid.size());
      valid.resize(size);
      success.resize(size);
    }
    valid[trace.particle] = true;
    success[trace.particle] = trace.outcome == Outcome::success;
  }
};

void count(const TraceOutcome& trace, PolicyScore& out) {
  const bool valid = trace.outcome != Outcome::invalid, met = valid && !trace.cut && trace.objective_margin >= 0;
  if (met) ++out.objective_met;
  for (std::size_t k = 0; k < out.kept.size(); ++k) {
    const bool kept = valid && (trace.kept >> k & 1u);
    out.kept[k].all += kept;
    out.kept[k].met += kept && met;
    out.kept[k].undecided += valid && (trace.undecided >> k & 1u);
  }
  switch (trace.outcome) {
    case Outcome::success:
      ++out.success;
      break;
    case Outcome::known_failure:
      ++out.known;
      ++out.by_requirement[static_cast<std::size_t>(trace.violated)];
      break;
    case Outcome::unknown_failure:
      ++out.unknown;
      break;
    case Outcome::invalid:
      ++out.invalid;
      break;
  }
}

/// `ends`: filled, too, if pairs are to be compared. Appends to `failures` the first of each kind.
PolicyScore score_policy(const Archive& archive, const std::string& policy, Ends* ends,
                         std::vector<Failure>& failures) {
  PolicyScore out;
  WaysToFail ways;
  Culprits culprits;
  ConvergenceSum convergence;
  out.policy = policy;
  const CampaignInfo& info = archive.info();
  out.by_requirement.assign(info.deciding(), 0);
  out.kept.resize(std::min(info.requirements.size() - info.deciding(), kMostMeasures));
  visit_outcomes(archive, policy, [&](std::span<const TraceOutcome> traces) {
    for (const TraceOutcome& trace : traces) {
      count(trace, out);
      ways.add(trace);
      culprits.add(trace);
      convergence.add(trace);
      if (ends != nullptr) ends->add(trace);
    }
  });
  const std::vector<Failure> firsts = ways.firsts(archive, policy);
  failures.insert(failures.end(), firsts.begin(), firsts.end());
  out.culprits = culprits.counts(archive.info());
  out.convergence = convergence.total();
  out.n = out.success + out.known + out.unknown;
  out.rate = out.n > 0 ? static_cast<double>(out.success) / static_cast<double>(out.n)
                       : std::numeric_limits<double>::quiet_NaN();
  for (PolicyScore::Kept& kept : out.kept) kept.interval = clopper_pearson(kept.all, out.n);
  return out;
}

PairedComparison compare(const std::string& name_a, const Ends& a, const std::string& name_b, const Ends& b) {
  PairedComparison pair;
  pair.a = name_a;
  pair.b = name_b;
  for (std::size_t i = 0; i < std::min(a.valid.size(), b.valid.size()); ++i) {
    if (!a.valid[i] || !b.valid[i]) continue;
    const bool met_a = a.success[i], met_b = b.success[i];
    ++(met_a ? met_b ? pair.both : pair.only_a : met_b ? pair.only_b : pair.neither);
  }
  pair.n = pair.both + pair.only_a + pair.only_b + pair.neither;
  const PairedTable counts{pair.both, pair.only_a, pair.only_b, pair.neither};
  pair.difference = paired_difference(counts);
  pair.interval = newcombe_paired(counts);
  pair.p_value = mcnemar_exact(pair.only_a, pair.only_b);
  return pair;
}

/// The size of the campaign was found by looking: only the confidence sequence holds then, and it answers the
/// questions.
void answer_questions(const CampaignInfo& info, Score& out) {
  const std::vector<Question> questions = questions_of(info);
  const double mass = out.mixture_mass = mixture_mass(questions);
  out.stopped_by_question = !questions.empty();
  out.confidence = info.until.confidence;
  for (PolicyScore& policy : out.policies) {
    policy.interval = out.interval(policy.success, policy.n);
    if (!out.complete) continue;  // what is there is not the first particles
    const auto interval = [&](std::uint64_t k, std::uint64_t n) {
      return confidence_sequence(k, n, out.confidence, mass);
    };
    const RateCount count{policy.success, policy.n, policy.invalid};
    for (const Question& question : questions) {
      if (!matches(question.selector, policy.policy)) continue;
      const Verdict verdict = judge(question, count, interval);
      const Interval valid = interval(count.success, count.valid);
      out.answers.push_back({question.text, policy.policy, verdict_name(verdict), policy.n, policy.invalid, valid,
                             verdict != judge(question, valid)});
    }
  }
}

std::string listing_command(const std::string& archive, const std::vector<std::string>& chosen, const char* what) {
  std::string out = "graze score " + shell_path(archive);
  for (const std::string& policy : chosen) out += " " + shell_option("--policy", policy);
  return out + " " + what;
}

}  // namespace

Interval Score::interval(std::uint64_t k, std::uint64_t n, double level) const {
  return stopped_by_question ? confidence_sequence(k, n, level, mixture_mass) : clopper_pearson(k, n, level);
}

Score score(const Archive& archive, const std::string& name, const std::vector<std::string>& chosen) {
  const CampaignInfo& info = archive.info();
  Score out;
  out.campaign = info.scenario_name;
  out.complete = archive.complete();
  out.part = info.part;
  out.particles = info.particles;
  out.unconverged = info.unconverged;
  for (const auto& requirement : info.requirements) {
    (requirement.measure ? out.measures : out.requirements).push_back(requirement.name);
  }
  const std::vector<std::string>& policies = chosen.empty() ? info.policies : chosen;
  std::vector<Ends> ends(policies.size());
  for (std::size_t i = 0; i < policies.size(); ++i) {
    out.policies.push_back(score_policy(archive, policies[i], policies.size() > 1 ? &ends[i] : nullptr, out.failures));
  }
  answer_questions(info, out);
  out.archive = name.empty() ? archive.path().string() : name;
  out.trust = needs_trust(archive.info());
  const std::vector<std::string> named = policies == info.policies ? std::vector<std::string>{} : policies;
  out.failures_command = listing_command(out.archive, named, "--failures");
  out.flagged_command = listing_command(out.archive, named, "--flagged");
  for (std::size_t i = 0; i < policies.size(); ++i) {
    for (std::size_t k = i + 1; k < policies.size(); ++k) {
      out.pairs.push_back(compare(policies[i], ends[i], policies[k], ends[k]));
    }
  }
  return out;
}

}  // namespace graze
