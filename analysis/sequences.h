#pragma once
// Sequences of contacts: which there are, how they end, and what is new in some of them (§3.6.1).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/event_tree.h"
#include "analysis/stories.h"

namespace graze {

/// One sequence, and the traces that have it.
struct SequenceCount {
  std::vector<std::uint32_t> words;
  OutcomeCounts outcomes;
  std::uint32_t example = 0;  // lowest particle
};

/// By number of traces, most first; then by words.
std::vector<SequenceCount> count_sequences(const Stories& stories, std::size_t requirements);

/// What traces do in one cycle of a gait: contacts that begin in [k T, (k + 1) T).
struct CycleCount {
  double from = 0, to = 0;            // s
  std::uint64_t n = 0, distinct = 0;  // traces that last so long; sequences
  std::uint64_t alike = 0;            // traces that share the most frequent one
  std::vector<std::uint32_t> words;   // of it
};

/// Of each whole cycle until `end` s. `cycle`: T, s. `rules.simultaneous` as the stories were read with. Contacts at
/// the border of a cycle count as of the cycle in which most traces have them: the cut is shifted to the widest gap
/// between beginnings, by at most a quarter of T.
std::vector<CycleCount> count_cycles(const Stories& stories, double cycle, double end);

/// What the traces that are looked at have and no trace of a reference has: the kinds of §3.6.1.
struct Novelty {
  enum class Kind {
    event,     // two parts touch
    sequence,  // of all contacts
    feature,   // two parts that touch there, too, but elsewhere on them
    outcomes   // one contact, different outcomes: no reference needed
  };
  Kind kind = Kind::event;
  std::uint32_t word = 0;     // but of sequences
  OutcomeCounts outcomes;     // of the traces that have it
  double first = 0;           // s: earliest; of sequences of their first contact, NaN: the window holds none
  std::uint32_t example = 0;  // the particle that has it earliest
};

/// Which traces are the reference: others are looked at.
using IsReference = std::vector<bool>;

/// `stories` are read with features. With `reference` of another set: every trace of `stories` is looked at.
std::vector<Novelty> novelties(const Stories& stories, std::size_t requirements, const IsReference& reference,
                               const Stories* other = nullptr);

}  // namespace graze
