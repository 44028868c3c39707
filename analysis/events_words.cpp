#include "analysis/events_words.h"

#include <fmt/format.h>

#include <algorithm>

namespace graze {
namespace {

std::string ordinal(std::size_t n) {
  const std::size_t tens = n % 100;
  const bool teens = tens >= 11 && tens <= 13;
  const char* ending = teens ? "th" : n % 10 == 1 ? "st" : n % 10 == 2 ? "nd" : n % 10 == 3 ? "rd" : "th";
  return fmt::format("{}{}", n, ending);
}

}  // namespace

std::string EventWords::sequence(const std::vector<std::uint32_t>& words, std::size_t most) const {
  if (words.empty()) return "(no contact)";
  std::string out;
  for (std::size_t i = 0; i < std::min(most, words.size()); ++i) out += (i > 0 ? " " : "") + word(words[i]);
  return words.size() > most ? out + fmt::format(" … {} in all", words.size()) : out;
}

std::string EventWords::branch(const EventBranch& branch) const {
  switch (branch.kind) {
    case EventBranch::Kind::contact:
      return word(branch.word);
    case EventBranch::Kind::nothing:
      return "nothing more";
    case EventBranch::Kind::others:
      return "other contacts";
    case EventBranch::Kind::cut:
      return "(ended before)";
  }
  return "";
}

std::string EventWords::node(const EventNode& node) const {
  std::string out = fmt::format("the {} contact of {}", ordinal(node.past.size() + 1),
                                info_.colliders[static_cast<std::size_t>(node.part)]);
  return node.with < 0 ? out : out + " with " + info_.colliders[static_cast<std::size_t>(node.with)];
}

std::string EventWords::place(const EventTree& tree, std::size_t at) const {
  const EventNode& one = tree.nodes[at];
  const std::string out = fmt::format("{:.3f} s: {}", one.time, node(one));
  if (one.parent < 0) return out;
  const EventNode& above = tree.nodes[static_cast<std::size_t>(one.parent)];
  return out + ", where " + branch(above.branches[static_cast<std::size_t>(one.parent_branch)]);
}

}  // namespace graze
