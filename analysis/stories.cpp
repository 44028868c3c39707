#include "analysis/stories.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/at_once.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

// A word: collider a (12 bits), collider b (12), features of a and b (3 each), mode (2).
constexpr int kParts = 1 << 12;

std::uint32_t word_of(const ContactPhase& phase, Detail detail) {
  auto word = static_cast<std::uint32_t>(phase.a) << 20 | static_cast<std::uint32_t>(phase.b) << 8;
  if (detail == Detail::parts) return word;
  word |= static_cast<std::uint32_t>(phase.feature_a) << 5 | static_cast<std::uint32_t>(phase.feature_b) << 2;
  if (detail == Detail::features) return word;
  const double stick = 1 - phase.slip - phase.roll;
  const ContactMode mode = phase.slip > std::max(stick, phase.roll) ? ContactMode::slip
                           : phase.roll > stick                     ? ContactMode::roll
                                                                    : ContactMode::stick;
  return word | static_cast<std::uint32_t>(mode);
}

std::string part_text(int part, std::uint32_t feature, const CampaignInfo& info) {
  const std::string& name = info.colliders.at(static_cast<std::size_t>(part));
  if (feature == static_cast<std::uint32_t>(Feature::surface)) return name;
  return name + "." + std::string(feature_name(static_cast<Feature>(feature)));
}

}  // namespace

std::string word_text(std::uint32_t word, Detail detail, const CampaignInfo& info) {
  std::string out = part_text(part_a(word), word >> 5 & 7, info) + "-" + part_text(part_b(word), word >> 2 & 7, info);
  constexpr const char* kModes[] = {" stick", " slip", " roll"};
  return detail == Detail::modes ? out + kModes[word & 3] : out;
}

void order_simultaneous(std::span<Token> tokens, double simultaneous) {
  for (std::size_t first = 0; first < tokens.size();) {
    std::size_t last = first + 1;
    while (last < tokens.size() && tokens[last].begin - tokens[first].begin <= simultaneous) ++last;
    std::sort(tokens.begin() + static_cast<std::ptrdiff_t>(first), tokens.begin() + static_cast<std::ptrdiff_t>(last),
              [](const Token& a, const Token& b) { return a.word != b.word ? a.word < b.word : a.begin < b.begin; });
    first = last;
  }
}

Stories told_by_parts(const Stories& stories, double simultaneous) {
  Stories out = stories;
  for (const Stories::Head& head : out.heads_) {
    const std::span<Token> tokens = std::span(out.tokens_).subspan(head.first, head.count);
    for (Token& token : tokens) token.word = parts_only(token.word);
    std::sort(tokens.begin(), tokens.end(), [](const Token& a, const Token& b) { return a.begin < b.begin; });
    order_simultaneous(tokens, simultaneous);
  }
  return out;
}

void StoryTeller::find_usual() {
  for (auto& [pair, all] : impulses_) {
    const auto ninth = all.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(all.size() - 1));
    std::nth_element(all.begin(), ninth, all.end());
    usual_[pair] = *ninth;
  }
  impulses_.clear();
}

StoryTeller::StoryTeller(const std::vector<std::string>& policies, const StoryRules& rules, double step)
    : rules_(rules), step_(step), stories_(policies.size()) {
  for (std::size_t p = 0; p < policies.size(); ++p) stories_[p].policy_ = policies[p];
}

StoryTeller::StoryTeller(const std::vector<std::string>& policies, const StoryRules& rules, double step,
                         UsualImpulses usual)
    : StoryTeller(policies, rules, step) {
  given_ = true;
  usual_ = std::move(usual);
}

void StoryTeller::add(std::size_t policy, std::uint32_t particle, Outcome outcome, int violated, double end_time,
                      std::span<const ContactPhase> phases) {
  if (outcome == Outcome::invalid) return;
  Stories& stories = stories_[policy];
  const std::uint64_t first = stories.tokens_.size();
  for (const ContactPhase& phase : phases) {
    const auto impulse = static_cast<float>(phase.impulse);
    if (!given_) impulses_[{phase.a, phase.b}].push_back(impulse);
    if (phase.begin < rules_.from || phase.begin >= rules_.to) continue;
    const bool under_way = phase.end > end_time - 1.5 * step_;
    // Negative: counts, whatever it carries.
    stories.tokens_.push_back(
        {word_of(phase, rules_.detail), static_cast<float>(phase.begin), under_way ? -impulse : impulse});
  }
  stories.heads_.push_back({particle, outcome, violated, end_time, first, stories.tokens_.size() - first});
}

std::vector<Stories> StoryTeller::take() {
  find_usual();
  const auto usual = [&](std::uint32_t word) {
    const auto found = usual_.find({part_a(word), part_b(word)});
    return found == usual_.end() ? 0.0f : found->second;
  };
  at_once(stories_.size(), [&](std::size_t p) {
    Stories& stories = stories_[p];
    for (Stories::Head& head : stories.heads_) {
      const auto first = stories.tokens_.begin() + static_cast<std::ptrdiff_t>(head.first);
      const auto last = std::remove_if(first, first + static_cast<std::ptrdiff_t>(head.count), [&](const Token& token) {
        return !std::signbit(token.impulse) && token.impulse < static_cast<float>(rules_.light) * usual(token.word);
      });
      std::for_each(first, last, [](Token& token) { token.impulse = std::abs(token.impulse); });
      head.count = static_cast<std::uint64_t>(last - first);
      order_simultaneous({first, last}, rules_.simultaneous);
    }
    std::sort(stories.heads_.begin(), stories.heads_.end(),
              [](const auto& a, const auto& b) { return a.particle < b.particle; });
  });
  return std::move(stories_);
}

StoriesRead look_for_stories(const Archive& archive, const std::vector<std::string>& policies, const StoryRules& rules,
                             std::uint64_t end) {
  const CampaignInfo& info = archive.info();
  StoriesRead out;
  if (info.colliders.size() > kParts) {
    out.none = fmt::format("{}: {} parts that can touch; contacts are told apart of at most {}",
                           archive.path().string(), info.colliders.size(), kParts);
    return out;
  }
  StoryTeller teller(policies, rules, info.step);
  bool any_phase = false, any_trace = false, any_valid = false;
  for (std::size_t p = 0; p < policies.size(); ++p) {
    const auto take = [&](const TraceRows& rows) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        any_trace = true;
        any_valid = any_valid || rows.outcome(i) != Outcome::invalid;
        any_phase = any_phase || !rows.phases(i).empty();
        teller.add(p, rows.particle(i), rows.outcome(i), rows.violated(i), rows.end_time(i), rows.phases(i));
      }
    };
    archive.scan(policies[p], kEndTime | kContactPhases | (rules.detail == Detail::modes ? kPhaseShares : 0u), take,
                 [&](std::uint32_t particle, Outcome) { return particle < end; });
  }
  if (any_phase) {
    out.stories = teller.take();
    out.usual = teller.usual();
    return out;
  }
  if (any_trace && !any_valid) {
    out.none = fmt::format("{}: has no contact phases to compare: no trace is valid; 'graze score' tells why",
                           archive.path().string());
    return out;
  }
  out.none = fmt::format(
      "{}: has no contact phases: nothing touched, or record.phases was false, or an older program "
      "made it; simulate it again with record.phases",
      archive.path().string());
  return out;
}

std::vector<Stories> read_stories(const Archive& archive, const std::vector<std::string>& policies,
                                  const StoryRules& rules) {
  StoriesRead out = look_for_stories(archive, policies, rules);
  if (!out.none.empty()) throw NoStories(out.none);
  return std::move(out.stories);
}

}  // namespace graze
