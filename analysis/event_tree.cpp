#include "analysis/event_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
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

using StoryRows = std::vector<std::uint32_t>;  // of Stories

/// The words of one thread in each trace. Words alone: there are as many threads as pairs that touch, and most nodes
/// are looked at for nothing else.
class ThreadWords {
 public:
  /// The next trace begins.
  void next() { first_.push_back(words_.size()); }
  void add(std::uint32_t word) { words_.push_back(word); }
  std::span<const std::uint32_t> of(std::size_t trace) const {
    const std::size_t end = trace + 1 < first_.size() ? first_[trace + 1] : words_.size();
    return std::span(words_).subspan(first_[trace], end - first_[trace]);
  }

 private:
  std::vector<std::uint32_t> words_;
  std::vector<std::size_t> first_;
};

/// Traces that stand at the same node of a thread.
struct Place {
  std::size_t thread;
  std::size_t depth;  // contacts before
  StoryRows traces;
};

/// How many traces take a branch, and how they end.
struct Way {
  std::uint64_t way;
  std::uint64_t n = 0;
  std::vector<double> classes = {};  // [class]
  StoryRows traces = {};             // where they were asked for
};

/// A node and what it is worth. Not its traces: they are found again for the one that is chosen.
struct Candidate {
  std::size_t thread = 0, depth = 0;
  std::uint32_t example = 0;  // a trace that comes by
  double p_value = 1;
  double information = 0, unknown = 0;  // nats over all its traces: what the branches tell of the class, what there is
};

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

/// Each once, in order.
std::vector<std::uint32_t> words_in(const Stories& stories) {
  std::vector<std::uint32_t> out;
  for (std::size_t i = 0; i < stories.size(); ++i) {
    for (const Token& token : stories[i].tokens) {
      const auto place = std::lower_bound(out.begin(), out.end(), token.word);
      if (place == out.end() || *place != token.word) out.insert(place, token.word);
    }
  }
  return out;
}

class Grower {
 public:
  Grower(const Stories& stories, const std::vector<int>& parts, std::size_t requirements, double end,
         const EventTreeRules& rules)
      : stories_(stories), requirements_(requirements), classes_(rules.kinds ? requirements + 2 : 2), rules_(rules) {
    const std::vector<std::uint32_t> words = words_in(stories);
    for (const int part : parts) threads_.push_back({part, -1});
    std::set<std::pair<int, int>> pairs;
    for (const std::uint32_t word : words) pairs.insert({part_a(word), part_b(word)});
    const auto moves = [&](int part) { return std::find(parts.begin(), parts.end(), part) != parts.end(); };
    for (const auto& [a, b] : pairs) threads_.push_back(moves(a) ? Thread{a, b} : Thread{b, a});
    follow_threads(words);
    for (std::size_t i = 0; i < stories.size(); ++i) {
      class_.push_back(class_of(stories[i]));
      lasted_.push_back(stories[i].end_time > end * (1 - 1e-9));
    }
  }

  EventTree grow() {
    StoryRows all(stories_.size());
    std::iota(all.begin(), all.end(), 0u);
    tree_.all = count(all);
    tree_.kinds = rules_.kinds;
    split(all, 0, -1, -1);
    return std::move(tree_);
  }

 private:
  /// Tells each thread its words: one pass over the tokens, since there are many threads and more tokens.
  void follow_threads(const std::vector<std::uint32_t>& words) {
    std::vector<std::vector<std::uint32_t>> threads_of(words.size());  // [word]
    for (std::size_t w = 0; w < words.size(); ++w) {
      for (std::uint32_t thread = 0; thread < threads_.size(); ++thread) {
        if (threads_[thread].has(words[w])) threads_of[w].push_back(thread);
      }
    }
    words_.resize(threads_.size());
    for (std::size_t i = 0; i < stories_.size(); ++i) {
      for (ThreadWords& thread : words_) thread.next();
      for (const Token& token : stories_[i].tokens) {
        const auto at = std::lower_bound(words.begin(), words.end(), token.word) - words.begin();
        for (const std::uint32_t thread : threads_of[static_cast<std::size_t>(at)]) words_[thread].add(token.word);
      }
    }
  }

  /// 0: success; then failure, or violated requirements and, last, objective unmet.
  std::uint32_t class_of(const Story& story) const {
    if (story.outcome == Outcome::success) return 0;
    const bool violated = story.outcome == Outcome::known_failure && rules_.kinds;
    return violated ? static_cast<std::uint32_t>(story.violated) + 1 : static_cast<std::uint32_t>(classes_ - 1);
  }

  OutcomeCounts count(const StoryRows& traces) const {
    OutcomeCounts out(requirements_);
    for (const std::uint32_t trace : traces) out.add(stories_[trace]);
    return out;
  }

  std::uint64_t way_of(const Place& place, std::uint32_t trace) const {
    const auto words = words_[place.thread].of(trace);
    if (place.depth < words.size()) return words[place.depth];
    return lasted_[trace] ? kNothing : kCut;
  }

  /// Branches in the order of their words. `wanted`: of which the traces are kept, by way and number.
  template <class Wanted>
  std::vector<Way> ways_of(const Place& place, const Wanted& wanted) const {
    std::vector<Way> out;
    std::vector<std::uint32_t> taken;  // by trace of the place
    std::uint32_t at = 0;
    for (const std::uint32_t trace : place.traces) {
      const std::uint64_t way = way_of(place, trace);
      if (out.empty() || out[at].way != way) {
        const auto found = std::find_if(out.begin(), out.end(), [&](const Way& one) { return one.way == way; });
        at = static_cast<std::uint32_t>(found - out.begin());
        if (found == out.end()) out.push_back({way, 0, std::vector<double>(classes_)});
      }
      ++out[at].n;
      ++out[at].classes[class_[trace]];
      taken.push_back(at);
    }
    std::vector<bool> keep;
    for (Way& one : out) {
      keep.push_back(wanted(one));
      if (keep.back()) one.traces.reserve(one.n);
    }
    for (std::size_t i = 0; i < taken.size(); ++i) {
      if (keep[taken[i]]) out[taken[i]].traces.push_back(place.traces[i]);
    }
    std::sort(out.begin(), out.end(), [](const Way& a, const Way& b) { return a.way < b.way; });
    return out;
  }

  void put_rare_together(std::vector<Way>& ways) const {
    Way rare{kOthers, 0, std::vector<double>(classes_)};
    std::erase_if(ways, [&](const Way& one) {
      if (one.way == kCut || one.n >= rules_.fewest) return false;
      rare.n += one.n;
      for (std::size_t k = 0; k < classes_; ++k) rare.classes[k] += one.classes[k];
      rare.traces.insert(rare.traces.end(), one.traces.begin(), one.traces.end());
      return true;
    });
    if (rare.n >= rules_.fewest) ways.push_back(std::move(rare));
  }

  /// Every node at which traces part, with what their outcomes say.
  std::vector<Candidate> candidates(const StoryRows& traces) const {
    std::vector<Candidate> out;
    for (std::size_t thread = 0; thread < threads_.size(); ++thread) {
      std::vector<Place> places = {{thread, 0, traces}};
      while (!places.empty()) {
        const Place place = std::move(places.back());
        places.pop_back();
        std::vector<Way> ways =
            ways_of(place, [&](const Way& one) { return one.way < kNothing && one.n >= 2 * rules_.fewest; });
        for (Way& one : ways) {
          if (!one.traces.empty()) places.push_back({thread, place.depth + 1, std::move(one.traces)});
          one.traces.clear();
        }
        std::vector<double> classes(classes_);
        for (const Way& one : ways) {
          for (std::size_t k = 0; k < classes_; ++k) classes[k] += one.classes[k];
        }
        put_rare_together(ways);
        std::optional<Candidate> one = weigh(place, ways);
        if (!one) continue;
        one->unknown = entropy(classes) * static_cast<double>(place.traces.size());
        out.push_back(*one);
      }
    }
    return out;
  }

  /// The branches of a candidate, with those of `traces` that have had the same contacts as its example.
  std::vector<Way> branches_of(const Candidate& one, const StoryRows& traces) const {
    Place place{one.thread, one.depth, {}};
    const ThreadWords& words = words_[one.thread];
    const auto past = words.of(one.example).first(one.depth);
    for (const std::uint32_t trace : traces) {
      const auto own = words.of(trace);
      const bool same = own.size() >= past.size() && std::equal(past.begin(), past.end(), own.begin());
      if (same) place.traces.push_back(trace);
    }
    std::vector<Way> out = ways_of(place, [](const Way&) { return true; });
    put_rare_together(out);
    return out;
  }

  /// None if fewer than two branches have enough traces. Traces that were cut off before say nothing about what their
  /// part would have done.
  std::optional<Candidate> weigh(const Place& place, const std::vector<Way>& ways) const {
    std::vector<std::vector<double>> table;  // [branch][class]
    std::vector<double> sums(classes_), sizes;
    for (const Way& one : ways) {
      if (one.way == kCut) continue;
      table.push_back(one.classes);
      for (std::size_t k = 0; k < classes_; ++k) sums[k] += one.classes[k];
      sizes.push_back(static_cast<double>(one.n));
    }
    if (table.size() < 2) return std::nullopt;
    Candidate out{place.thread, place.depth, place.traces.front(), p_value(table, sums, sizes)};
    double within = 0;
    const double all = std::accumulate(sizes.begin(), sizes.end(), 0.0);
    for (std::size_t b = 0; b < table.size(); ++b) within += sizes[b] / all * entropy(table[b]);
    // In nats, times the share of traces that it is about, so that nodes of few traces do not outdo the root's.
    out.information = (entropy(sums) - within) * all;
    return out;
  }

  /// The contacts of some traces at a node; of those that have one there.
  std::vector<Token> tokens_of(const Candidate& one, const StoryRows& traces) const {
    std::vector<Token> out;
    for (const std::uint32_t trace : traces) {
      std::size_t left = one.depth;
      for (const Token& token : stories_[trace].tokens) {
        if (!threads_[one.thread].has(token.word) || left-- > 0) continue;
        out.push_back(token);
        break;
      }
    }
    return out;
  }

  /// s: of the median trace of the branch that comes first; of the rare contacts where there is no other.
  double time_of(const Candidate& one, const std::vector<Way>& ways) const {
    double named = std::numeric_limits<double>::infinity(), rare = named;
    for (const Way& way : ways) {
      if (way.way == kNothing || way.way == kCut) continue;
      std::vector<double> begins;
      for (const Token& token : tokens_of(one, way.traces)) begins.push_back(token.begin);
      if (begins.empty()) continue;
      double& least = way.way == kOthers ? rare : named;
      least = std::min(least, median(std::move(begins)));
    }
    return std::isfinite(named) ? named : rare;
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

  void split(const StoryRows& traces, int depth, int parent, int parent_branch) {
    if (depth >= rules_.depth || traces.size() < 2 * rules_.fewest) return;
    const std::vector<Candidate> all = candidates(traces);
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
    double first = 0;
    std::vector<Way> ways;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (corrected[i] > error_rate || all[i].information < 0.5 * most) continue;
      std::vector<Way> own = branches_of(all[i], traces);
      const double time = time_of(all[i], own);
      if (best < all.size() && time >= first) continue;
      best = i, first = time, ways = std::move(own);
    }
    add(all[best], ways, first, corrected[best], depth, parent, parent_branch);
    const int node = static_cast<int>(tree_.nodes.size()) - 1;
    for (std::size_t b = 0; b < tree_.nodes[node].branches.size(); ++b) {
      const auto& of_branch = tree_.nodes[node].branches[b].traces;
      const StoryRows those(of_branch.begin(), of_branch.end());  // nodes grow meanwhile
      split(those, depth + 1, node, static_cast<int>(b));
    }
  }

  void add(const Candidate& one, const std::vector<Way>& ways, double time, double p_value, int depth, int parent,
           int parent_branch) {
    EventNode node;
    node.part = threads_[one.thread].part;
    node.with = threads_[one.thread].with;
    const auto past = words_[one.thread].of(one.example).first(one.depth);
    node.past.assign(past.begin(), past.end());
    node.time = time;
    node.p_value = p_value;
    node.information = one.information / one.unknown;
    node.depth = depth;
    node.parent = parent;
    node.parent_branch = parent_branch;
    for (const Way& way : ways) {
      EventBranch branch;
      branch.kind = way.way == kNothing  ? EventBranch::Kind::nothing
                    : way.way == kCut    ? EventBranch::Kind::cut
                    : way.way == kOthers ? EventBranch::Kind::others
                                         : EventBranch::Kind::contact;
      branch.word = way.way < kNothing ? static_cast<std::uint32_t>(way.way) : 0;
      branch.outcomes = count(way.traces);
      std::vector<double> times, impulses;
      for (const Token& token : tokens_of(one, way.traces)) {
        times.push_back(token.begin);
        impulses.push_back(token.impulse);
      }
      branch.time = quantiles(std::move(times));
      branch.impulse = quantiles(std::move(impulses));
      branch.traces.assign(way.traces.begin(), way.traces.end());
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
  std::vector<std::uint32_t> class_;  // [trace]
  std::vector<bool> lasted_;          // [trace]: it was not cut off
  const std::size_t requirements_, classes_;
  const EventTreeRules rules_;
  std::vector<ThreadWords> words_;  // [thread]
  EventTree tree_;
};

}  // namespace

void OutcomeCounts::add(const Story& story) {
  ++n;
  if (story.outcome == Outcome::success) ++success;
  if (story.outcome == Outcome::unknown_failure) ++unknown;
  if (story.outcome == Outcome::known_failure) ++violated[static_cast<std::size_t>(story.violated)];
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
  // Who ends after the last contact that is looked at was seen as long as all others.
  return event_tree(stories, moving_parts(info), info.deciding(), std::min(info.end, rules.until), rules);
}

}  // namespace graze
