#include "analysis/event_tree.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "analysis/significance.h"

namespace graze {
namespace {

/// Which branch a trace takes: a word, or what stands for its absence.
constexpr std::uint64_t kNothing = std::uint64_t{1} << 32, kCut = kNothing + 1, kOthers = kNothing + 2;

/// Contacts that are followed: of a part with any other, or with one.
struct Thread {
  int part, with;  // with -1: any

  bool has(std::uint32_t word) const {
    const int a = part_a(word), b = part_b(word);
    return with < 0 ? a == part || b == part : (a == part && b == with) || (a == with && b == part);
  }
};

/// The tokens of one thread in each trace.
class PartStories {
 public:
  PartStories(const Stories& stories, const Thread& thread) {
    for (std::size_t i = 0; i < stories.size(); ++i) {
      first_.push_back(tokens_.size());
      for (const Token& token : stories[i].tokens) {
        if (thread.has(token.word)) tokens_.push_back(token);
      }
    }
    first_.push_back(tokens_.size());
  }
  std::span<const Token> of(std::size_t trace) const {
    return std::span(tokens_).subspan(first_[trace], first_[trace + 1] - first_[trace]);
  }

 private:
  std::vector<Token> tokens_;
  std::vector<std::size_t> first_;
};

/// Traces that stand at the same node of a part.
struct Place {
  int part;
  std::size_t depth;  // contacts before
  std::vector<std::size_t> traces;
};

struct Candidate {
  int part = 0;
  std::size_t depth = 0;
  double p_value = 1, information = 0, time = 0;
  std::vector<std::size_t> traces;
  std::map<std::uint64_t, std::vector<std::size_t>> ways;
};

double median(std::vector<double>& x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

double entropy(const std::vector<double>& counts) {
  const double sum = std::accumulate(counts.begin(), counts.end(), 0.0);
  double out = 0;
  for (const double count : counts) {
    if (count > 0) out -= count / sum * std::log(count / sum);
  }
  return out;
}

/// Two-sided p-value of independence. Fisher's exact test; the chi-square test where all expected counts are so large
/// that the two agree, and the sums of the exact one long.
double fourfold_p(const FourfoldTable& t) {
  constexpr double kLarge = 1000;
  const double row = static_cast<double>(t.both + t.only_a), column = static_cast<double>(t.both + t.only_b);
  const double n = row + static_cast<double>(t.only_b + t.neither);
  if (std::min(row, n - row) * std::min(column, n - column) / n <= kLarge) return fisher_two_sided(t);
  const double difference = static_cast<double>(t.both) * n - row * column;
  return upper_chi_square(n * (difference / row) * (difference / column) / ((n - row) * (n - column)), 1);
}

class Grower {
 public:
  Grower(const Stories& stories, const std::vector<int>& parts, std::size_t requirements, double end,
         const EventTreeRules& rules)
      : stories_(stories),
        requirements_(requirements),
        classes_(rules.kinds ? requirements + 2 : 2),
        end_(end),
        rules_(rules) {
    for (const int part : parts) threads_.push_back({part, -1});
    std::set<std::pair<int, int>> pairs;
    for (std::size_t i = 0; i < stories.size(); ++i) {
      for (const Token& token : stories[i].tokens) pairs.insert({part_a(token.word), part_b(token.word)});
    }
    const auto moves = [&](int part) { return std::find(parts.begin(), parts.end(), part) != parts.end(); };
    for (const auto& [a, b] : pairs) threads_.push_back(moves(a) ? Thread{a, b} : Thread{b, a});
    for (const Thread& thread : threads_) of_part_.emplace_back(stories, thread);
  }

  EventTree grow() {
    std::vector<std::size_t> all(stories_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    tree_.all = count(all);
    tree_.kinds = rules_.kinds;
    split(all, 0, -1, -1);
    return std::move(tree_);
  }

 private:
  /// 0: success; then failure, or violated requirements and, last, objective unmet.
  std::size_t class_of(std::size_t trace) const {
    const Story story = stories_[trace];
    if (story.outcome == Outcome::success) return 0;
    return story.outcome == Outcome::known_failure && rules_.kinds ? static_cast<std::size_t>(story.violated) + 1
                                                                   : classes_ - 1;
  }

  OutcomeCounts count(const std::vector<std::size_t>& traces) const {
    OutcomeCounts out;
    out.violated.assign(requirements_, 0);
    for (const std::size_t trace : traces) {
      const Story story = stories_[trace];
      ++out.n;
      if (story.outcome == Outcome::success) ++out.success;
      if (story.outcome == Outcome::unknown_failure) ++out.unknown;
      if (story.outcome == Outcome::known_failure) ++out.violated[static_cast<std::size_t>(story.violated)];
    }
    return out;
  }

  std::uint64_t way_of(std::size_t part, std::size_t trace, std::size_t depth) const {
    const auto tokens = of_part_[part].of(trace);
    if (depth < tokens.size()) return tokens[depth].word;
    return stories_[trace].end_time > end_ * (1 - 1e-9) ? kNothing : kCut;
  }

  /// Every node at which traces part, with what their outcomes say.
  std::vector<Candidate> candidates(const std::vector<std::size_t>& traces) const {
    std::vector<Candidate> out;
    for (std::size_t part = 0; part < threads_.size(); ++part) {
      std::vector<Place> places = {{static_cast<int>(part), 0, traces}};
      while (!places.empty()) {
        const Place place = std::move(places.back());
        places.pop_back();
        std::map<std::uint64_t, std::vector<std::size_t>> ways;
        for (const std::size_t trace : place.traces) ways[way_of(part, trace, place.depth)].push_back(trace);
        for (const auto& [way, those] : ways) {
          if (way < kNothing && those.size() >= 2 * rules_.fewest) {
            places.push_back({place.part, place.depth + 1, those});
          }
        }
        if (std::optional<Candidate> one = weigh(place, std::move(ways))) out.push_back(std::move(*one));
      }
    }
    return out;
  }

  /// None if fewer than two branches have enough traces. Traces that were cut off before say nothing about what their
  /// part would have done.
  std::optional<Candidate> weigh(const Place& place, std::map<std::uint64_t, std::vector<std::size_t>> ways) const {
    std::vector<std::size_t> rare;
    for (auto way = ways.begin(); way != ways.end();) {
      const bool keep = way->first == kCut || way->second.size() >= rules_.fewest;
      if (!keep) rare.insert(rare.end(), way->second.begin(), way->second.end());
      way = keep ? std::next(way) : ways.erase(way);
    }
    if (rare.size() >= rules_.fewest) ways[kOthers] = rare;
    if (ways.size() - ways.count(kCut) < 2) return std::nullopt;
    std::vector<std::vector<double>> table;  // [branch][class]
    std::vector<double> sums(classes_), sizes;
    for (const auto& [way, those] : ways) {
      if (way == kCut) continue;
      table.emplace_back(classes_);
      for (const std::size_t trace : those) ++table.back()[class_of(trace)];
      for (std::size_t k = 0; k < classes_; ++k) sums[k] += table.back()[k];
      sizes.push_back(static_cast<double>(those.size()));
    }
    Candidate out;
    out.part = place.part;
    out.depth = place.depth;
    out.traces = place.traces;
    out.p_value = p_value(table, sums, sizes);
    double within = 0;
    const double all = std::accumulate(sizes.begin(), sizes.end(), 0.0);
    for (std::size_t b = 0; b < table.size(); ++b) within += sizes[b] / all * entropy(table[b]);
    // In nats, times the share of traces that it is about, so that nodes of few traces do not outdo the root's.
    out.information = (entropy(sums) - within) * all;
    out.time = std::numeric_limits<double>::infinity();
    for (const auto& [way, those] : ways) {
      if (way >= kNothing) continue;
      std::vector<double> begins;
      for (const std::size_t trace : those) begins.push_back(of_part_[place.part].of(trace)[place.depth].begin);
      out.time = std::min(out.time, median(begins));
    }
    out.ways = std::move(ways);
    return out;
  }

  double p_value(const std::vector<std::vector<double>>& table, const std::vector<double>& sums,
                 const std::vector<double>& sizes) const {
    const double all = std::accumulate(sizes.begin(), sizes.end(), 0.0);
    double least = 1;
    std::size_t tests = 0;
    for (std::size_t k = 0; k < classes_; ++k) {
      if (sums[k] == 0 || sums[k] == all) continue;
      for (std::size_t b = 0; b < table.size(); ++b) {
        if (b == 1 && table.size() == 2) continue;  // the same as b == 0
        const auto n = [](double x) { return static_cast<std::uint64_t>(x); };
        least = std::min(least, fourfold_p({n(table[b][k]), n(sizes[b] - table[b][k]), n(sums[k] - table[b][k]),
                                            n(all - sizes[b] - sums[k] + table[b][k])}));
        ++tests;
      }
    }
    return tests == 0 ? 1.0 : std::min(1.0, least * static_cast<double>(tests));
  }

  void split(const std::vector<std::size_t>& traces, int depth, int parent, int parent_branch) {
    if (depth >= rules_.depth || traces.size() < 2 * rules_.fewest) return;
    std::vector<Candidate> all = candidates(traces);
    tree_.tested += all.size();
    std::vector<double> raw;
    for (const Candidate& one : all) raw.push_back(one.p_value);
    const std::vector<double> corrected = holm(raw);
    double most = 0;
    const double error_rate = rules_.error_rate * std::pow(0.5, depth);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (corrected[i] <= error_rate) most = std::max(most, all[i].information);
    }
    if (most == 0) return;
    std::size_t best = all.size();
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (corrected[i] > error_rate || all[i].information < 0.5 * most) continue;
      if (best == all.size() || all[i].time < all[best].time) best = i;
    }
    add(all[best], corrected[best], depth, parent, parent_branch);
    const int node = static_cast<int>(tree_.nodes.size()) - 1;
    for (std::size_t b = 0; b < tree_.nodes[node].branches.size(); ++b) {
      const std::vector<std::size_t> those = tree_.nodes[node].branches[b].traces;  // nodes_ grows meanwhile
      split(those, depth + 1, node, static_cast<int>(b));
    }
  }

  void add(const Candidate& one, double p_value, int depth, int parent, int parent_branch) {
    EventNode node;
    const PartStories& of_part = of_part_[static_cast<std::size_t>(one.part)];
    node.part = threads_[static_cast<std::size_t>(one.part)].part;
    node.with = threads_[static_cast<std::size_t>(one.part)].with;
    for (std::size_t k = 0; k < one.depth; ++k) node.past.push_back(of_part.of(one.traces.front())[k].word);
    node.time = one.time;
    node.p_value = p_value;
    std::vector<double> classes(classes_);
    for (const std::size_t trace : one.traces) ++classes[class_of(trace)];
    node.information = one.information / (entropy(classes) * static_cast<double>(one.traces.size()));
    node.depth = depth;
    node.parent = parent;
    node.parent_branch = parent_branch;
    for (const auto& [way, those] : one.ways) {
      EventBranch branch;
      branch.kind = way == kNothing  ? EventBranch::Kind::nothing
                    : way == kCut    ? EventBranch::Kind::cut
                    : way == kOthers ? EventBranch::Kind::others
                                     : EventBranch::Kind::contact;
      branch.word = way < kNothing ? static_cast<std::uint32_t>(way) : 0;
      branch.outcomes = count(those);
      std::vector<double> times, impulses;
      for (const std::size_t trace : those) {
        const auto tokens = of_part.of(trace);
        if (one.depth >= tokens.size()) continue;
        times.push_back(tokens[one.depth].begin);
        impulses.push_back(tokens[one.depth].impulse);
      }
      branch.time = quantiles(std::move(times));
      branch.impulse = quantiles(std::move(impulses));
      branch.traces = those;
      node.branches.push_back(std::move(branch));
    }
    std::stable_sort(node.branches.begin(), node.branches.end(), [](const EventBranch& a, const EventBranch& b) {
      const bool cut_a = a.kind == EventBranch::Kind::cut, cut_b = b.kind == EventBranch::Kind::cut;
      return cut_a != cut_b ? cut_b : a.outcomes.n > b.outcomes.n;
    });
    if (parent >= 0) {
      tree_.nodes[static_cast<std::size_t>(parent)].branches[static_cast<std::size_t>(parent_branch)].node =
          static_cast<int>(tree_.nodes.size());
    }
    tree_.nodes.push_back(std::move(node));
  }

  const Stories& stories_;
  std::vector<Thread> threads_;
  const std::size_t requirements_, classes_;
  const double end_;
  const EventTreeRules rules_;
  std::vector<PartStories> of_part_;
  EventTree tree_;
};

}  // namespace

Quantiles quantiles(std::vector<double> x) {
  if (x.empty()) return {std::nan(""), std::nan(""), std::nan("")};
  std::sort(x.begin(), x.end());
  const auto at = [&](double q) {
    return x[static_cast<std::size_t>(std::lround(q * static_cast<double>(x.size() - 1)))];
  };
  return {at(0.05), at(0.5), at(0.95)};
}

double OutcomeCounts::rate() const {
  return n == 0 ? std::nan("") : static_cast<double>(success) / static_cast<double>(n);
}

Interval OutcomeCounts::interval() const { return clopper_pearson(success, n); }

std::vector<int> moving_parts(const CampaignInfo& info) {
  std::vector<int> out;
  for (std::size_t i = 0; i < info.colliders.size(); ++i) {
    const std::string& name = info.colliders[i];
    const bool moves = std::any_of(info.links.begin(), info.links.end(), [&](const std::string& link) {
      return name == link || (name.starts_with(link + ".") &&
                              name.find_first_not_of("0123456789", link.size() + 1) == std::string::npos);
    });
    if (moves) out.push_back(static_cast<int>(i));
  }
  return out;
}

EventTree event_tree(const Stories& stories, const std::vector<int>& parts, std::size_t requirements, double end,
                     const EventTreeRules& rules) {
  return Grower(stories, parts, requirements, end, rules).grow();
}

EventTree event_tree(const Stories& stories, const CampaignInfo& info, EventTreeRules rules) {
  bool any_success = false;
  for (std::size_t i = 0; i < stories.size(); ++i) any_success |= stories[i].outcome == Outcome::success;
  rules.kinds = rules.kinds || !any_success;
  return event_tree(stories, moving_parts(info), info.deciding(), info.end, rules);
}

}  // namespace graze
