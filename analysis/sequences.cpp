#include "analysis/sequences.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace graze {
namespace {

std::vector<std::uint32_t> words_of(const Story& story) {
  std::vector<std::uint32_t> out;
  out.reserve(story.tokens.size());
  for (const Token& token : story.tokens) out.push_back(token.word);
  return out;
}

void count(const Story& story, OutcomeCounts& out) {
  ++out.n;
  if (story.outcome == Outcome::success) ++out.success;
  if (story.outcome == Outcome::unknown_failure) ++out.unknown;
  if (story.outcome == Outcome::known_failure) ++out.violated[static_cast<std::size_t>(story.violated)];
}

OutcomeCounts none(std::size_t requirements) {
  OutcomeCounts out;
  out.violated.assign(requirements, 0);
  return out;
}

/// The middle of the widest gap between beginnings within a quarter of a cycle from 0, as an offset of all cuts.
double quiet_offset(const Stories& stories, double cycle) {
  constexpr int kBins = 200;
  std::vector<int> bins(kBins);
  for (std::size_t i = 0; i < stories.size(); ++i) {
    for (const Token& token : stories[i].tokens) {
      const double place = std::fmod(static_cast<double>(token.begin) / cycle, 1.0);
      ++bins[std::min(kBins - 1, static_cast<int>(place * kBins))];
    }
  }
  const auto at = [&](int bin) { return bins[static_cast<std::size_t>((bin + kBins) % kBins)]; };
  double best = 0;
  int widest = -1;
  for (int bin = -kBins / 4; bin <= kBins / 4; ++bin) {
    int reach = 0;
    while (reach < kBins / 2 && at(bin - reach) == 0 && at(bin + reach) == 0) ++reach;
    const double offset = (bin + 0.5) / kBins;
    if (reach > widest || (reach == widest && std::abs(offset) < std::abs(best))) widest = reach, best = offset;
  }
  return widest > 0 ? best * cycle : 0;
}

}  // namespace

std::vector<SequenceCount> count_sequences(const Stories& stories, std::size_t requirements) {
  std::map<std::vector<std::uint32_t>, SequenceCount> by_words;
  for (std::size_t i = 0; i < stories.size(); ++i) {
    const Story story = stories[i];
    const auto [entry, fresh] = by_words.try_emplace(words_of(story), SequenceCount{{}, none(requirements), 0});
    if (fresh) entry->second.example = story.particle;
    count(story, entry->second.outcomes);
  }
  std::vector<SequenceCount> out;
  for (auto& [words, one] : by_words) {
    one.words = words;
    out.push_back(std::move(one));
  }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.outcomes.n > b.outcomes.n; });
  return out;
}

std::vector<CycleCount> count_cycles(const Stories& stories, double cycle, double end) {
  std::vector<CycleCount> out;
  const double offset = quiet_offset(stories, cycle);
  for (double from = offset; from + cycle <= end * (1 + 1e-9); from += cycle) {
    if (from < -1e-9) continue;
    CycleCount one;
    one.from = from;
    one.to = from + cycle;
    std::map<std::vector<std::uint32_t>, std::uint64_t> sequences;
    for (std::size_t i = 0; i < stories.size(); ++i) {
      const Story story = stories[i];
      if (story.end_time < one.to - 1e-9) continue;
      std::vector<std::uint32_t> words;
      for (const Token& token : story.tokens) {
        if (token.begin >= one.from && token.begin < one.to) words.push_back(token.word);
      }
      ++sequences[words];
      ++one.n;
    }
    one.distinct = sequences.size();
    for (const auto& [words, n] : sequences) {
      if (n > one.alike) one.alike = n, one.words = words;
    }
    if (one.n > 0) out.push_back(std::move(one));
  }
  return out;
}

std::vector<Novelty> novelties(const Stories& stories, std::size_t requirements, const IsReference& reference,
                               const Stories* other) {
  std::set<std::uint32_t> known_parts, known_words;
  std::set<std::vector<std::uint32_t>> known_sequences;
  const auto learn = [&](const Story& story) {
    known_sequences.insert(words_of(story));
    for (const Token& token : story.tokens) known_words.insert(token.word), known_parts.insert(parts_only(token.word));
  };
  for (std::size_t i = 0; other == nullptr && i < stories.size(); ++i) {
    if (reference[i]) learn(stories[i]);
  }
  for (std::size_t i = 0; other != nullptr && i < other->size(); ++i) learn((*other)[i]);

  std::map<std::pair<int, std::uint32_t>, Novelty> found;
  const auto note = [&](Novelty::Kind kind, std::uint32_t word, double time, const Story& story) {
    const auto [entry, fresh] = found.try_emplace({static_cast<int>(kind), word},
                                                  Novelty{kind, word, none(requirements), time, story.particle});
    Novelty& one = entry->second;
    count(story, one.outcomes);
    if (time < one.first) one.first = time, one.example = story.particle;
  };
  for (std::size_t i = 0; i < stories.size(); ++i) {
    const Story story = stories[i];
    const bool looked_at = other != nullptr || !reference[i];
    std::set<std::pair<int, std::uint32_t>> noted;
    for (const Token& token : story.tokens) {
      const std::uint32_t parts = parts_only(token.word);
      const auto once = [&](Novelty::Kind kind, std::uint32_t word) {
        if (noted.insert({static_cast<int>(kind), word}).second) note(kind, word, token.begin, story);
      };
      if (looked_at && !known_parts.contains(parts)) once(Novelty::Kind::event, parts);
      if (looked_at && known_parts.contains(parts) && !known_words.contains(token.word)) {
        once(Novelty::Kind::feature, token.word);
      }
      once(Novelty::Kind::outcomes, parts);
    }
    if (looked_at && !known_sequences.contains(words_of(story))) {
      note(Novelty::Kind::sequence, 0, story.tokens.empty() ? 0.0 : story.tokens.front().begin, story);
    }
  }
  std::vector<Novelty> out;
  for (auto& [key, one] : found) {
    if (one.kind == Novelty::Kind::outcomes) {
      // Contacts that some traces have and some have not, and after which both ends are met with in one trace of
      // twenty.
      const std::uint64_t n = one.outcomes.n, less = std::min(one.outcomes.success, n - one.outcomes.success);
      const bool told = less >= 2 && 20 * less >= n && 10 * n < 9 * stories.size();
      if (!told) continue;
    }
    out.push_back(std::move(one));
  }
  std::stable_sort(out.begin(), out.end(), [](const Novelty& a, const Novelty& b) {
    return a.kind != b.kind ? a.kind < b.kind : a.outcomes.n > b.outcomes.n;
  });
  return out;
}

}  // namespace graze
