#include "analysis/events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/at_once.h"

namespace graze {
namespace {

/// Particles that causes of bifurcations are looked for among; more take time and find what they do.
constexpr std::uint64_t kMostOfBifurcations = 5'000;

/// s: the median time between two beginnings of one contact in a trace: about a step of a gait. 0: nothing repeats.
double usual_period(const Stories& stories) {
  constexpr std::size_t kTraces = 2000;  // more do not move a median
  std::vector<double> periods;
  for (std::size_t i = 0; i < std::min(kTraces, stories.size()); ++i) {
    std::map<std::uint32_t, double> last;
    for (const Token& token : stories[i].tokens) {
      const auto [entry, fresh] = last.try_emplace(token.word, token.begin);
      if (!fresh) periods.push_back(token.begin - entry->second);
      entry->second = token.begin;
    }
  }
  return periods.empty() ? 0 : median(std::move(periods));
}

PolicyEvents::Around around(const Stories& stories, const EventBranch& branch, double from, double to) {
  PolicyEvents::Around out;
  out.from = from;
  out.to = to;
  std::map<std::vector<std::uint32_t>, std::uint64_t> sequences;
  for (const std::size_t trace : branch.traces) {
    std::vector<std::uint32_t> words;
    for (const Token& token : stories[trace].tokens) {
      if (token.begin >= from && token.begin <= to) words.push_back(token.word);
    }
    ++sequences[words];
    ++out.n;
  }
  for (const auto& [words, n] : sequences) {
    if (n > out.alike) out.alike = n, out.words = words;
  }
  return out;
}

/// From `margin` s before the earliest branch of a node until `margin` after the last.
std::vector<PolicyEvents::Around> around_node(const Stories& stories, const EventNode& node, double margin) {
  double last = node.time;
  for (const EventBranch& branch : node.branches) {
    if (!std::isnan(branch.time.median)) last = std::max(last, branch.time.median);
  }
  std::vector<PolicyEvents::Around> out;
  for (const EventBranch& branch : node.branches) {
    out.push_back(around(stories, branch, node.time - margin, last + margin));
  }
  return out;
}

/// `fine`: with features, at least; `told`: as sequences are told.
PolicyEvents events_of(const Stories& fine, const Stories& told, const CampaignInfo& info,
                       const EventsRequest& request) {
  PolicyEvents out;
  out.policy = fine.policy();
  EventTreeRules rules = request.tree;
  rules.until = request.rules.to;
  out.tree = event_tree(fine, info, rules);
  out.sequences = count_sequences(told, info.deciding());
  if (request.cycle > 0) out.cycles = count_cycles(told, request.cycle, info.end);
  const double margin = std::max(0.5 * usual_period(told), request.rules.simultaneous);
  for (const EventNode& node : out.tree.nodes) out.around.push_back(around_node(told, node, margin));
  return out;
}

/// Least gaps of the pair of a branch's contact in traces of other branches, by witnesses of lengths over pairs.
void add_near_misses(const Archive& archive, const Stories& stories, PolicyEvents& out) {
  const CampaignInfo& info = archive.info();
  std::vector<std::size_t> witnesses;
  for (std::size_t r = 0; r < info.requirements.size(); ++r) {
    if (info.requirements[r].parts == "pairs" && info.requirements[r].unit == "m") witnesses.push_back(r);
  }
  if (witnesses.empty() || out.tree.nodes.empty()) return;
  std::map<std::uint32_t, std::size_t> row_of;
  for (std::size_t i = 0; i < stories.size(); ++i) row_of[stories[i].particle] = i;
  struct Margin {
    double gap;
    int part;
  };
  std::vector<Margin> margins(stories.size() * witnesses.size(), {0, kNoPart});  // [trace][witness]
  archive.scan(out.policy, kMargins | kMarginParts, [&](const TraceRows& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto found = row_of.find(rows.particle(i));
      if (found == row_of.end() || rows.margin_parts(i).empty()) continue;
      for (std::size_t w = 0; w < witnesses.size(); ++w) {
        const std::size_t r = witnesses[w];
        margins[found->second * witnesses.size() + w] = {rows.margins(i)[r], rows.margin_parts(i)[r]};
      }
    }
  });
  const int parts = static_cast<int>(info.colliders.size());
  for (std::size_t n = 0; n < out.tree.nodes.size(); ++n) {
    const EventNode& node = out.tree.nodes[n];
    std::set<int> told;
    for (std::size_t b = 0; b < node.branches.size(); ++b) {
      const EventBranch& branch = node.branches[b];
      const int pair = part_a(branch.word) * parts + part_b(branch.word);
      if (branch.kind != EventBranch::Kind::contact || !told.insert(pair).second) continue;
      for (std::size_t w = 0; w < witnesses.size(); ++w) {
        PolicyEvents::NearMiss one{n, b, info.requirements[witnesses[w]].name};
        std::vector<double> gaps;
        for (const EventBranch& other : node.branches) {
          if (parts_only(other.word) == parts_only(branch.word) && other.kind == EventBranch::Kind::contact) continue;
          one.other += other.traces.size();
          for (const std::size_t trace : other.traces) {
            const Margin& margin = margins[trace * witnesses.size() + w];
            if (margin.part == pair) gaps.push_back(margin.gap);
          }
        }
        one.n = gaps.size();
        one.gap = quantiles(std::move(gaps));
        if (one.n > 0) out.near_misses.push_back(std::move(one));
      }
    }
  }
}

/// What novelties are told against, by policy; none: each policy's successes.
std::vector<Stories> read_reference(const Archive& archive, const EventsRequest& request,
                                    const std::vector<std::string>& policies, const StoryRules& rules) {
  std::vector<Stories> out;
  if (request.reference.empty()) return out;
  const Archive reference(request.reference);
  if (reference.info().colliders != archive.info().colliders) {
    throw InputError(fmt::format("{}: is about other parts than {}; a reference has the same robot and world",
                                 request.reference, archive.path().string()));
  }
  const auto& names = reference.info().policies;
  // Read together, as the campaign's are: what is light is taken over all policies that are asked for.
  std::vector<std::string> wanted;
  std::vector<std::size_t> of;  // policy: row of `wanted`
  for (const std::string& policy : policies) {
    const bool same = std::find(names.begin(), names.end(), policy) != names.end();
    if (!same && names.size() != 1) {
      throw InputError(fmt::format("{}: has no policy '{}' to compare with; it has {}", request.reference, policy,
                                   fmt::join(names, ", ")));
    }
    const auto place = std::find(wanted.begin(), wanted.end(), same ? policy : names.front());
    of.push_back(static_cast<std::size_t>(place - wanted.begin()));
    if (place == wanted.end()) wanted.push_back(same ? policy : names.front());
  }
  const std::vector<Stories> read = read_stories(reference, wanted, rules);
  for (const std::size_t row : of) out.push_back(read[row]);
  return out;
}

/// The nominal traces as stories, by policy. What is light is what is light in the campaign.
std::vector<Stories> tell_nominal(const EventsRequest& request, const std::vector<std::string>& policies,
                                  const StoryRules& rules, const UsualImpulses& usual, CampaignEvents& out) {
  const std::vector<TraceRecord> traces = request.nominal(policies);
  StoryTeller teller(policies, rules, out.info.step, usual);
  for (std::size_t p = 0; p < policies.size(); ++p) {
    const TraceRecord& trace = traces.at(p);
    if (trace.outcome == Outcome::invalid) {
      throw InputError(fmt::format("--reference nominal: under policy '{}' the nominal trace is invalid: {}",
                                   policies[p], trace.invalid_reason));
    }
    out.policies[p].nominal = {trace.outcome, trace.end_time};
    teller.add(p, trace.particle, trace.outcome, trace.violated, trace.end_time, trace.phases);
  }
  return teller.take();
}

void add_novelties(const std::vector<Stories>& fine, const std::vector<Stories>& others, std::size_t requirements,
                   std::vector<PolicyEvents>& out) {
  at_once(fine.size(), [&](std::size_t p) {
    IsReference succeeded;
    for (std::size_t i = 0; i < fine[p].size(); ++i) succeeded.push_back(fine[p][i].outcome == Outcome::success);
    const Stories* other = others.empty() ? nullptr : &others[p];
    out[p].reference =
        other ? other->size() : static_cast<std::uint64_t>(std::count(succeeded.begin(), succeeded.end(), true));
    if (out[p].reference > 0) out[p].novelties = novelties(fine[p], requirements, succeeded, other);
  });
}

/// Values are read only if there is a bifurcation to explain.
void add_causes(const Archive& archive, const std::vector<Stories>& fine, CampaignEvents& out) {
  const auto divides = [](const PolicyEvents& policy) { return !policy.tree.nodes.empty(); };
  if (std::none_of(out.policies.begin(), out.policies.end(), divides)) return;
  ParticleValues values = read_particle_values(archive, kMostOfBifurcations);
  out.no_causes = values.none();
  const EventWords words(out.info, std::max(out.request.rules.detail, Detail::features));
  at_once(out.no_causes.empty() ? fine.size() : 0, [&](std::size_t p) {
    out.policies[p].causes = bifurcation_causes(out.policies[p].tree, fine[p], words, values);
  });
  out.parameters = std::move(values.table);
}

}  // namespace

CampaignEvents campaign_events(const Archive& archive, const EventsRequest& request) {
  CampaignEvents out;
  out.archive = request.name.empty() ? archive.path().string() : request.name;
  out.info = archive.info();
  out.campaign = out.info.scenario_name;
  out.complete = archive.complete();
  out.request = request;
  const std::vector<std::string>& policies = request.policies.empty() ? out.info.policies : request.policies;
  StoryRules rules = request.rules;
  rules.detail = std::max(rules.detail, Detail::features);
  const StoriesRead read = look_for_stories(archive, policies, rules);
  if (!read.none.empty()) throw NoStories(read.none);
  const std::vector<Stories>& fine = read.stories;
  const bool same = rules.detail == request.rules.detail;
  out.policies.resize(fine.size());
  at_once(fine.size(), [&](std::size_t p) {
    out.policies[p] = same ? events_of(fine[p], fine[p], out.info, request)
                           : events_of(fine[p], told_by_parts(fine[p], rules.simultaneous), out.info, request);
  });
  for (std::size_t p = 0; p < fine.size(); ++p) add_near_misses(archive, fine[p], out.policies[p]);
  add_causes(archive, fine, out);
  const std::vector<Stories> others = request.nominal ? tell_nominal(request, policies, rules, read.usual, out)
                                                      : read_reference(archive, request, policies, rules);
  add_novelties(fine, others, out.info.deciding(), out.policies);
  return out;
}

}  // namespace graze
