#include "engine/settings/paths.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "engine/settings/regular_file.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_in(const fs::path& folder) {
  constexpr std::size_t kMost = 10'000;  // a suggestion may cost no more
  std::error_code error;
  std::vector<std::string> names;
  for (fs::directory_iterator at(folder.empty() ? "." : folder, error), end; !error && at != end; at.increment(error)) {
    names.push_back(at->path().filename().string());
    if (names.size() == kMost) break;
  }
  std::sort(names.begin(), names.end());  // the same suggestion for any order of the folder
  return names;
}

/// The candidate whose name without its ending is nearest; what two names have in common because they are of one kind
/// (".yaml") makes them no more alike.
std::string nearest_stem(const std::string& stem, const std::vector<fs::path>& candidates) {
  std::vector<std::string> stems;
  for (const fs::path& one : candidates) stems.push_back(one.stem().string());
  const std::string near = nearest(stem, stems);
  if (near.empty()) return "";
  return candidates[static_cast<std::size_t>(std::find(stems.begin(), stems.end(), near) - stems.begin())].string();
}

/// Of the names that end alike; else, or first if there is no ending, of those of the `kinds` that are meant; else of
/// those whose ending is nearly the same (".grze"). A file of another kind is not meant.
std::string nearest_name(const fs::path& name, const std::vector<std::string>& names,
                         const std::vector<std::string>& kinds) {
  const std::string ending = name.extension().string();
  std::vector<fs::path> same, meant;
  std::vector<std::string> alike;
  for (const std::string& one : names) {
    const fs::path candidate(one);
    const std::string its = candidate.extension().string();
    if (its == ending) {
      same.push_back(candidate);
    } else if (std::find(kinds.begin(), kinds.end(), its) != kinds.end()) {
      meant.push_back(candidate);
    } else if (!its.empty() && !nearest(ending, {its}).empty()) {
      alike.push_back(one);
    }
  }
  std::vector<std::vector<fs::path>*> order = {&same, &meant};
  if (ending.empty()) std::swap(order[0], order[1]);
  for (const auto* candidates : order) {
    if (const std::string near = nearest_stem(name.stem().string(), *candidates); !near.empty()) return near;
  }
  return nearest(name.string(), alike);
}

/// What may be meant by a path that is not there.
struct PathGuess {
  fs::path meant;   // with the rest of the path behind the name that is near; empty if none is
  fs::path folder;  // the first one that lacks, if nothing is near
};

PathGuess guess_path(const fs::path& whole, const std::vector<std::string>& kinds) {
  std::error_code error;
  fs::path there;
  for (auto part = whole.begin(); part != whole.end(); ++part) {
    const fs::path next = there / *part;
    if (part->empty() || fs::exists(next, error)) {
      there = next;
      continue;
    }
    std::vector<std::string> names = names_in(there);
    std::erase(names, part->string());  // a link that leads nowhere
    const bool last = std::next(part) == whole.end() || std::next(part)->empty();
    const std::string near = nearest_name(*part, names, last ? kinds : std::vector<std::string>());
    if (near.empty()) return {{}, last ? fs::path() : next};
    fs::path right = there / near;
    for (auto rest = std::next(part); rest != whole.end(); ++rest) right /= *rest;
    return {right, {}};
  }
  return {};
}

}  // namespace

std::string path_suggestion(const std::string& path, const std::vector<std::string>& kinds) {
  const PathGuess guess = guess_path(path, kinds);
  if (!guess.meant.empty()) return fmt::format("; did you mean '{}'?", guess.meant.string());
  return guess.folder.empty() ? "" : fmt::format("; there is no folder '{}'", guess.folder.string());
}

std::string why_no_file(const std::string& path) {
  const OpenedFile opened = open_regular(AT_FDCWD, path.c_str(), O_RDONLY, Links::followed);
  if (opened.file) return "";
  if (opened.refused == kind_of(S_IFDIR)) return "not a file, but a folder";
  if (!opened.refused.empty()) return "not a file, but " + opened.refused;
  if (opened.error == ELOOP) return "symbolic links that lead in a circle; name the file itself";
  if (opened.error != ENOENT && opened.error != ENOTDIR) {
    return fmt::format("cannot be opened: {}", std::strerror(opened.error));
  }
  std::error_code error;
  const fs::path target = fs::read_symlink(path, error);
  return error ? "" : fmt::format("is a symbolic link to '{}', where nothing is", target.string());
}

std::string near_path(const std::string& path) {
  const fs::path meant = guess_path(path, {}).meant;
  std::error_code error;
  return !meant.empty() && fs::exists(meant, error) ? meant.string() : "";
}

}  // namespace graze
