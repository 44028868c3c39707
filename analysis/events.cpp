#include "analysis/events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace graze {
namespace {

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
  if (periods.empty()) return 0;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
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

PolicyEvents events_of(const Stories& stories, const CampaignInfo& info, const EventsRequest& request) {
  PolicyEvents out;
  out.policy = stories.policy();
  const std::size_t requirements = info.deciding();
  out.tree = event_tree(stories, moving_parts(info), requirements, info.end, request.tree);
  out.sequences = count_sequences(stories, requirements);
  if (request.cycle > 0) out.cycles = count_cycles(stories, request.cycle, info.end);
  const double period = usual_period(stories);
  for (const EventNode& node : out.tree.nodes) {
    double last = node.time;
    for (const EventBranch& branch : node.branches) {
      if (branch.kind == EventBranch::Kind::contact) last = std::max(last, branch.time.median);
    }
    auto& all = out.around.emplace_back();
    for (const EventBranch& branch : node.branches) {
      all.push_back(around(stories, branch, node.time - 0.5 * period, last + 0.5 * period));
    }
  }
  return out;
}

void add_novelties(const Archive& archive, const EventsRequest& request, const std::vector<std::string>& policies,
                   std::vector<PolicyEvents>& out) {
  StoryRules rules = request.rules;
  rules.detail = std::max(rules.detail, Detail::features);
  const CampaignInfo& info = archive.info();
  const std::vector<Stories> own = read_stories(archive, policies, rules);
  std::vector<Stories> others;
  if (!request.reference.empty()) {
    const Archive reference(request.reference);
    if (reference.info().colliders != info.colliders) {
      throw InputError(fmt::format("{}: is about other parts than {}; a reference has the same robot and world",
                                   request.reference, archive.path().string()));
    }
    for (const std::string& policy : policies) {
      const auto& names = reference.info().policies;
      const bool same = std::find(names.begin(), names.end(), policy) != names.end();
      if (!same && names.size() != 1) {
        throw InputError(fmt::format("{}: has no policy '{}' to compare with; it has {}", request.reference, policy,
                                     fmt::join(names, ", ")));
      }
      others.push_back(std::move(read_stories(reference, {same ? policy : names.front()}, rules).front()));
    }
  }
  for (std::size_t p = 0; p < policies.size(); ++p) {
    IsReference succeeded;
    for (std::size_t i = 0; i < own[p].size(); ++i) succeeded.push_back(own[p][i].outcome == Outcome::success);
    const Stories* other = others.empty() ? nullptr : &others[p];
    out[p].reference =
        other ? other->size() : static_cast<std::uint64_t>(std::count(succeeded.begin(), succeeded.end(), true));
    out[p].novelties = novelties(own[p], info.deciding(), succeeded, other);
  }
}

}  // namespace

CampaignEvents campaign_events(const Archive& archive, const EventsRequest& request) {
  CampaignEvents out;
  out.archive = request.name.empty() ? archive.path().string() : request.name;
  out.info = archive.info();
  out.campaign = out.info.scenario_name;
  out.request = request;
  const std::vector<std::string>& policies = request.policies.empty() ? out.info.policies : request.policies;
  for (const Stories& stories : read_stories(archive, policies, request.rules)) {
    out.policies.push_back(events_of(stories, out.info, request));
  }
  add_novelties(archive, request, policies, out.policies);
  return out;
}

}  // namespace graze
