#include "analysis/sequences.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr double kMostCycles = 10000;

std::vector<std::uint32_t> words_of(const Story& story) {
  std::vector<std::uint32_t> out;
  out.reserve(story.tokens.size());
  for (const Token& token : story.tokens) out.push_back(token.word);
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
    const auto [entry, fresh] =
        by_words.try_emplace(words_of(story), SequenceCount{{}, OutcomeCounts(requirements), 0});
    if (fresh) entry->second.example = story.particle;
    entry->second.outcomes.add(story);
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
  if (end / cycle > kMostCycles) {
    throw InputError(fmt::format("--cycle {:g} s: {:.3g} cycles until {:g} s; at most {} can be told", cycle,
                                 end / cycle, end, kMostCycles));
  }
  // The first cycle may begin before 0 by no more than rounding.
  const double offset = quiet_offset(stories, cycle), first = offset < -1e-9 ? offset + cycle : offset;
  const auto last = std::floor((end * (1 + 1e-9) - first) / cycle);
  std::vector<CycleCount> out(last > 0 ? static_cast<std::size_t>(last) : 0);
  for (std::size_t k = 0; k < out.size(); ++k) {
    out[k].from = first + static_cast<double>(k) * cycle;
    out[k].to = first + static_cast<double>(k + 1) * cycle;
  }
  std::vector<std::map<std::vector<std::uint32_t>, std::uint64_t>> sequences(out.size());
  std::vector<std::vector<std::uint32_t>> words(out.size());
  for (std::size_t i = 0; i < stories.size(); ++i) {
    const Story story = stories[i];
    for (auto& of_cycle : words) of_cycle.clear();
    for (const Token& token : story.tokens) {
      const double place = std::floor((static_cast<double>(token.begin) - first) / cycle);
      if (place >= 0 && place < last) words[static_cast<std::size_t>(place)].push_back(token.word);
    }
    for (std::size_t k = 0; k < out.size() && story.end_time >= out[k].to - 1e-9; ++k) {
      ++sequences[k][words[k]];
      ++out[k].n;
    }
  }
  for (std::size_t k = 0; k < out.size(); ++k) {
    out[k].distinct = sequences[k].size();
    for (const auto& [of_cycle, n] : sequences[k]) {
      if (n > out[k].alike) out[k].alike = n, out[k].words = of_cycle;
    }
  }
  std::erase_if(out, [](const CycleCount& one) { return one.n == 0; });
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
    const auto [entry, fresh] = found.try_emplace(
        {static_cast<int>(kind), word}, Novelty{kind, word, OutcomeCounts(requirements), time, story.particle});
    Novelty& one = entry->second;
    one.outcomes.add(story);
    if (time < one.first || (std::isnan(one.first) && !std::isnan(time)))
      one.first = time, one.example = story.particle;
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
      note(Novelty::Kind::sequence, 0, story.tokens.empty() ? std::nan("") : story.tokens.front().begin, story);
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
