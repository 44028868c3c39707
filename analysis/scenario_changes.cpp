#include "analysis/scenario_changes.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <utility>

#include "engine/settings/settings.h"
#include "engine/settings/sha256.h"

namespace graze {
namespace {

using Values = std::vector<std::pair<std::string, std::string>>;

/// Lists of scalars are one value, as people read them: [0, 0, 1].
void flatten(const Settings& at, const std::string& path, Values& out) {
  const auto below = [&](const std::string& key) { return path.empty() ? key : path + "." + key; };
  if (at.is_map()) {
    for (const auto& [key, value] : at.entries()) flatten(value, below(key), out);
  } else if (at.is_list()) {
    const std::vector<Settings> items = at.items();
    std::string line;
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (items[i].is_map() || items[i].is_list()) {
        flatten(items[i], below(std::to_string(i)), out);
      } else {
        line += (line.empty() ? "" : ", ") + (items[i].is_null() ? "~" : items[i].text());
      }
    }
    if (!line.empty() || items.empty()) out.emplace_back(path, "[" + line + "]");
  } else {
    out.emplace_back(path, at.is_null() ? "~" : at.text());
  }
}

Values values_of(const std::string& text, const char* name) {
  Values out;
  flatten(Settings::parse(text, name), "", out);
  std::erase_if(out, [](const auto& one) {
    return one.first == "name" || one.first == "description" || one.first.starts_with("sampling.");
  });
  return out;
}

}  // namespace

std::vector<ScenarioChange> scenario_changes(const std::string& a, const std::string& b) {
  if (a == b) return {};
  const Values in_a = values_of(a, "A"), in_b = values_of(b, "B");
  std::map<std::string, std::string> left(in_b.begin(), in_b.end());
  std::vector<ScenarioChange> out;
  for (const auto& [path, value] : in_a) {
    const auto found = left.find(path);
    if (found == left.end()) {
      out.push_back({path, value, ""});
    } else {
      if (found->second != value) out.push_back({path, value, found->second});
      left.erase(found);
    }
  }
  for (const auto& [path, value] : in_b) {
    if (left.contains(path)) out.push_back({path, "", value});
  }
  return out;
}

namespace {

using Files = std::map<std::string, std::string>;

std::string name_of_file(const std::string& path) { return std::filesystem::path(path).filename().string(); }

/// Whose values are compared instead.
bool is_yaml(const std::string& path) {
  const std::string kind = std::filesystem::path(path).extension().string();
  return kind == ".yaml" || kind == ".yml" || path == "-";
}

/// The file that stands for `path`, or none.
const std::string* counterpart(const std::string& path, const Files& files) {
  if (const auto found = files.find(path); found != files.end()) return &found->second;
  for (const auto& [other, content] : files) {
    if (name_of_file(other) == name_of_file(path)) return &content;
  }
  return nullptr;
}

std::string known_by(const std::string* content) {
  constexpr std::size_t kDigits = 12;
  return content ? fmt::format("{} bytes, SHA-256 {}…", content->size(), sha256_of(*content).substr(0, kDigits)) : "";
}

}  // namespace

std::vector<ScenarioChange> file_changes(const Files& a, const Files& b) {
  std::vector<ScenarioChange> out;
  if (a.empty() || b.empty()) return out;
  for (const auto& [path, content] : a) {
    const std::string* other = counterpart(path, b);
    if (is_yaml(path) || (other && *other == content)) continue;
    out.push_back({"file " + name_of_file(path), known_by(&content), known_by(other)});
  }
  for (const auto& [path, content] : b) {
    if (!is_yaml(path) && !counterpart(path, a)) out.push_back({"file " + name_of_file(path), "", known_by(&content)});
  }
  return out;
}

}  // namespace graze
