#pragma once
// What happened in traces, as words: contact phases in a normal form in which traces can be compared (§3.6.1).

#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "archive/archive.h"

namespace graze {

/// How finely a contact is told: which parts ("RF_FOOT-curb"), with their features ("RF_FOOT-curb.side"), or with what
/// it mostly does, too ("RF_FOOT-curb.side slip").
enum class Detail { parts, features, modes };

struct StoryRules {
  Detail detail = Detail::parts;
  /// s: contacts that begin within this time of each other are simultaneous: their order means nothing. Our choice: two
  /// feet that a trot puts down together touch within 10 ms of each other in the shipped scenarios.
  double simultaneous = 0.02;
  /// A contact counts if it carries at least this share of what contacts of its two parts usually do (nine in ten carry
  /// no more), or is under way when its trace ends. Our choice: what a foot brushes between steps is below a tenth.
  double light = 0.1;
  double from = 0, to = std::numeric_limits<double>::infinity();  // s: contacts that begin here
};

/// One contact. `word`: what touches, see word_text(); equal words are equal contacts, in all archives of one campaign.
struct Token {
  std::uint32_t word;
  float begin;    // s
  float impulse;  // N s
};

/// Parts of a word, rows of CampaignInfo::colliders.
inline int part_a(std::uint32_t word) { return static_cast<int>(word >> 20); }
inline int part_b(std::uint32_t word) { return static_cast<int>(word >> 8 & 0xfff); }
/// The word without features and modes.
inline std::uint32_t parts_only(std::uint32_t word) { return word & ~0xffu; }
/// "RF_FOOT-curb.side slip"; `detail` as the word was made with.
std::string word_text(std::uint32_t word, Detail detail, const CampaignInfo& info);

/// What happened in one trace. Tokens stand in the order of their beginnings, simultaneous ones by word.
struct Story {
  std::uint32_t particle = 0;
  Outcome outcome = Outcome::invalid;
  int violated = -1;
  double end_time = 0;  // s
  std::span<const Token> tokens;
};

/// All valid traces of a policy, by particle.
class Stories {
 public:
  std::size_t size() const { return heads_.size(); }
  Story operator[](std::size_t i) const {
    const Head& head = heads_[i];
    return {head.particle, head.outcome, head.violated, head.end_time,
            std::span(tokens_).subspan(head.first, head.count)};
  }
  const std::string& policy() const { return policy_; }

 private:
  friend class StoryTeller;
  friend Stories told_by_parts(const Stories& stories, double simultaneous);
  struct Head {
    std::uint32_t particle;
    Outcome outcome;
    int violated;
    double end_time;
    std::uint64_t first, count;  // of its tokens
  };
  std::string policy_;
  std::vector<Head> heads_;
  std::vector<Token> tokens_;
};

/// What nine in ten contacts of two parts (rows of CampaignInfo::colliders) carry at most, N s.
using UsualImpulses = std::map<std::pair<int, int>, float>;

/// Makes stories of traces that come in any order. What contacts of two parts usually carry is taken over all policies,
/// or given.
class StoryTeller {
 public:
  /// `step`: of the physics, s.
  StoryTeller(const std::vector<std::string>& policies, const StoryRules& rules, double step);
  /// With what is usual elsewhere; all contacts of parts that never touched there count.
  StoryTeller(const std::vector<std::string>& policies, const StoryRules& rules, double step, UsualImpulses usual);
  /// Invalid traces are passed over.
  void add(std::size_t policy, std::uint32_t particle, Outcome outcome, int violated, double end_time,
           std::span<const ContactPhase> phases);
  /// One per policy. Nothing can be added afterwards.
  std::vector<Stories> take();
  /// What is usual here, or was given; after take().
  const UsualImpulses& usual() const { return usual_; }

 private:
  void find_usual();

  StoryRules rules_;
  double step_;
  bool given_ = false;
  std::map<std::pair<int, int>, std::vector<float>> impulses_;  // unless what is usual was given
  UsualImpulses usual_;
  std::vector<Stories> stories_;
};

/// There are no contact phases to tell of.
class NoStories : public InputError {
 public:
  using InputError::InputError;
};

/// Stories by policy, or why there are none: the archive keeps no contact phases, or too many parts touch.
struct StoriesRead {
  std::vector<Stories> stories;
  UsualImpulses usual;
  std::string none;
};
/// Of particles below `end`.
StoriesRead look_for_stories(const Archive& archive, const std::vector<std::string>& policies, const StoryRules& rules,
                             std::uint64_t end = std::numeric_limits<std::uint64_t>::max());
/// The same; throws NoStories if there are none.
std::vector<Stories> read_stories(const Archive& archive, const std::vector<std::string>& policies,
                                  const StoryRules& rules);

/// The same told by parts alone.
Stories told_by_parts(const Stories& stories, double simultaneous);

/// Puts simultaneous tokens, which stand in the order of their beginnings, in the order of their words.
void order_simultaneous(std::span<Token> tokens, double simultaneous);

}  // namespace graze
