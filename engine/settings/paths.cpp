#include "engine/settings/paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_in(const fs::path& folder) {
  constexpr std::size_t kMost = 10'000;  // a suggestion is worth no more
  std::error_code error;
  std::vector<std::string> names;
  for (fs::directory_iterator at(folder.empty() ? "." : folder, error), end; !error && at != end; at.increment(error)) {
    names.push_back(at->path().filename().string());
    if (names.size() == kMost) break;
  }
  std::sort(names.begin(), names.end());  // the same suggestion for any order of the folder
  return names;
}

/// What two names have in common because they are of one kind (".yaml") makes them no more alike.
std::string nearest_name(const std::string& name, const std::vector<std::string>& names) {
  const fs::path path(name);
  std::vector<std::string> stems, others;
  for (const std::string& one : names) {
    const fs::path candidate(one);
    if (candidate.extension() == path.extension()) {
      stems.push_back(candidate.stem().string());
    } else {
      others.push_back(one);
    }
  }
  const std::string stem = nearest(path.stem().string(), stems);
  return stem.empty() ? nearest(name, others) : stem + path.extension().string();
}

}  // namespace

std::string path_suggestion(const std::string& path) {
  std::error_code error;
  const fs::path whole(path);
  fs::path there;
  for (auto part = whole.begin(); part != whole.end(); ++part) {
    const fs::path next = there / *part;
    if (part->empty() || fs::exists(next, error)) {
      there = next;
      continue;
    }
    const std::string near = nearest_name(part->string(), names_in(there));
    if (near.empty()) {
      const bool last = std::next(part) == whole.end() || std::next(part)->empty();
      return last ? "" : fmt::format("; there is no folder '{}'", next.string());
    }
    fs::path right = there / near;
    for (auto rest = std::next(part); rest != whole.end(); ++rest) right /= *rest;
    return fmt::format("; did you mean '{}'?", right.string());
  }
  return "";
}

}  // namespace graze
