#pragma once
// Events in words.

#include <string>
#include <vector>

#include "analysis/event_tree.h"
#include "analysis/stories.h"

namespace graze {

/// Tells contacts, branches and bifurcations of one campaign.
class EventWords {
 public:
  /// `info` outlives this; `detail`: as the words were made.
  EventWords(const CampaignInfo& info, Detail detail) : info_(info), detail_(detail) {}

  std::string word(std::uint32_t word) const { return word_text(word, detail_, info_); }
  /// "LF_FOOT-ground RH_FOOT-ground … 32 in all": no more than `most` words.
  std::string sequence(const std::vector<std::uint32_t>& words, std::size_t most = 24) const;
  /// "LF_FOOT-curb.side", "nothing more", "other contacts", "(ended before)".
  std::string branch(const EventBranch& branch) const;
  /// "the 3rd contact of LF_FOOT with curb".
  std::string node(const EventNode& node) const;
  /// The same with its time and the branch that it lies below: "1.931 s: the 1st contact of LF_FOOT, where …".
  std::string place(const EventTree& tree, std::size_t at) const;

 private:
  const CampaignInfo& info_;
  Detail detail_;
};

}  // namespace graze
