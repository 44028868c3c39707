// score(): counts, intervals and paired comparisons. docs/statistics.md says what the numbers mean.
#include "analysis/score.h"

#include <algorithm>
#include <limits>

#include "analysis/proportions.h"
#include "analysis/sequential.h"

namespace graze {
namespace {

PolicyScore score_policy(const TraceTable& table, std::size_t requirements) {
  PolicyScore out;
  out.policy = table.policy;
  out.by_requirement.assign(requirements, 0);
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table.outcome[i] != Outcome::invalid && table.objective_margin[i] >= 0) ++out.objective_met;
    switch (table.outcome[i]) {
      case Outcome::success:
        ++out.success;
        break;
      case Outcome::known_failure:
        ++out.known;
        ++out.by_requirement[static_cast<std::size_t>(table.violated[i])];
        break;
      case Outcome::unknown_failure:
        ++out.unknown;
        break;
      case Outcome::invalid:
        ++out.invalid;
        break;
    }
  }
  out.n = out.success + out.known + out.unknown;
  out.rate = out.n > 0 ? static_cast<double>(out.success) / static_cast<double>(out.n)
                       : std::numeric_limits<double>::quiet_NaN();
  out.interval = clopper_pearson(out.success, out.n);
  return out;
}

/// Both tables are in order of particle id.
PairedComparison compare(const TraceTable& a, const TraceTable& b) {
  PairedComparison pair;
  pair.a = a.policy;
  pair.b = b.policy;
  for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
    if (a.particle[i] != b.particle[k]) {
      a.particle[i] < b.particle[k] ? ++i : ++k;
      continue;
    }
    const Outcome of_a = a.outcome[i++], of_b = b.outcome[k++];
    if (of_a == Outcome::invalid || of_b == Outcome::invalid) continue;
    const bool met_a = of_a == Outcome::success, met_b = of_b == Outcome::success;
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
  const double mass = mixture_mass(questions);
  out.stopped_by_question = !questions.empty();
  out.confidence = info.until.confidence;
  for (PolicyScore& policy : out.policies) {
    if (out.stopped_by_question) policy.interval = confidence_sequence(policy.success, policy.n, 0.95, mass);
    if (!out.complete) continue;  // what is there is not the first particles
    const Interval interval = confidence_sequence(policy.success, policy.n, out.confidence, mass);
    for (const Question& question : questions) {
      if (!matches(question.selector, policy.policy)) continue;
      out.answers.push_back(
          {question.text, policy.policy, verdict_name(judge(question, interval)), policy.n, interval});
    }
  }
}

}  // namespace

Score score(const Archive& archive, const std::string& name) {
  const CampaignInfo& info = archive.info();
  Score out;
  out.campaign = info.scenario_name;
  out.complete = archive.complete();
  out.particles = info.particles;
  for (const auto& requirement : info.requirements) out.requirements.push_back(requirement.name);
  std::vector<TraceTable> tables;
  for (const std::string& policy : info.policies) tables.push_back(archive.traces(policy));
  for (const TraceTable& table : tables) out.policies.push_back(score_policy(table, out.requirements.size()));
  answer_questions(info, out);
  out.archive = name.empty() ? archive.path().string() : name;
  out.failures = first_failures(archive);
  for (std::size_t i = 0; i < tables.size(); ++i) {
    for (std::size_t k = i + 1; k < tables.size(); ++k) out.pairs.push_back(compare(tables[i], tables[k]));
  }
  return out;
}

}  // namespace graze
