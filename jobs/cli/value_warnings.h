#pragma once
// Warnings of a scenario at one of several values of a setting: each is told once, without those of the scenario
// itself.

#include <spdlog/spdlog.h>

#include <set>
#include <string>
#include <vector>

namespace graze {

class ValueWarnings {
 public:
  explicit ValueWarnings(const std::vector<std::string>& base) : told_(base.begin(), base.end()) {}

  /// `at`: the value, "contact.friction=0.3".
  void tell(const std::vector<std::string>& warnings, const std::string& at) {
    for (const std::string& text : warnings) {
      if (!told_.insert(text).second) continue;
      if (++count_ <= kMost) spdlog::warn("{}: {}", at, text);
    }
  }
  void end() const {
    if (count_ > kMost) spdlog::warn("and {} more of other values", count_ - kMost);
  }

 private:
  static constexpr std::size_t kMost = 8;
  std::set<std::string> told_;
  std::size_t count_ = 0;
};

}  // namespace graze
