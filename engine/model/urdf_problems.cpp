#include "engine/model/urdf_problems.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

namespace graze {

void UrdfProblems::refuse(int line, const std::string& what) {
  ++refused_;
  problems_.push_back({line, what, ""});
}

void UrdfProblems::repair(int line, const std::string& what, const std::string& how) {
  problems_.push_back({line, what, how});
}

void UrdfProblems::stop(int line, const std::string& what) {
  refuse(line, what);
  raise();
  throw InputError(told(problems_.back()));  // raise() has thrown it
}

void UrdfProblems::doubt(int line, const std::string& what) {
  if (++doubts_ <= kMaxWarnings) warn(fmt::format("{}:{}: {}", name_, line, what));
}

std::string UrdfProblems::told(const Problem& problem) const {
  return fmt::format("{}:{}: {}{}", name_, problem.line, problem.what,
                     problem.how.empty() ? "" : "; --repair " + problem.how);
}

void UrdfProblems::raise() const {
  std::vector<const Problem*> standing;
  for (const Problem& problem : problems_) {
    if (!repairing_ || problem.how.empty()) standing.push_back(&problem);
  }
  if (standing.empty()) return;
  if (standing.size() == 1) throw InputError(told(*standing.front()));
  std::stable_sort(standing.begin(), standing.end(), [](const auto* a, const auto* b) { return a->line < b->line; });
  const std::size_t mended = standing.size() - refused_;
  std::string text = fmt::format("{}: {} problems, ", name_, standing.size());
  if (mended == 0) {
    text += "none of which --repair can mend:";
  } else {
    text += fmt::format("{} of which --repair ('repair: true' under 'robot') mends:",
                        refused_ == 0 ? "all" : std::to_string(mended));
  }
  const char* const mark = mended == 0 ? "" : " (no repair)";
  for (std::size_t i = 0; i < std::min(standing.size(), kMaxProblems); ++i) {
    text += "\n  " + told(*standing[i]) + (standing[i]->how.empty() ? mark : "");
  }
  if (standing.size() > kMaxProblems) text += fmt::format("\n  … and {} more", standing.size() - kMaxProblems);
  throw InputError(text);
}

std::vector<std::string> UrdfProblems::repairs() const {
  std::vector<std::string> out;
  for (const Problem& problem : problems_) {
    if (problem.how.empty()) continue;
    if (out.size() == kMaxProblems) {
      out.push_back(fmt::format("{}: {} more repairs", name_, problems_.size() - refused_ - kMaxProblems));
      break;
    }
    out.push_back(fmt::format("{}:{}: {}; repaired: {}", name_, problem.line, problem.what, problem.how));
  }
  return out;
}

}  // namespace graze
