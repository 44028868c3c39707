#include "engine/settings/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "engine/settings/inputs.h"
#include "engine/settings/tree.h"
#include "engine/settings/units.h"

namespace graze {
namespace {

using Kind = SettingsNode::Kind;

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

/// "; did you mean 'time'?" or the list of what would be right.
std::string suggestion(std::string_view word, const std::vector<std::string>& choices) {
  const std::string near = nearest(word, choices);
  if (!near.empty()) return fmt::format("; did you mean '{}'?", near);
  if (choices.empty()) return "; there are no keys here";
  return "; one of: " + joined(choices);
}

constexpr std::size_t kShown = 80;  // bytes of a value in a message

}  // namespace

Settings Settings::parse(const std::string& text, const std::string& name) {
  return Settings(resolve_includes(parse_yaml(text, name)), "");
}

Settings Settings::load(const std::string& file, const std::vector<Override>& overrides) {
  const bool piped = file == kStandardInput;
  const std::string text = piped ? read_standard_input() : read_text(file, "");
  const NodePtr root = resolve_includes(parse_yaml(text, piped ? "standard input" : file));
  return Settings(root, "").overridden(overrides);
}

Settings Settings::overridden(const std::vector<Override>& overrides) const {
  NodePtr root = node_;
  for (const Override& override : overrides) {
    const std::string name =
        fmt::format("--set {}={}", clipped(override.path, kShown), clipped(override.value, kShown));
    const NodePtr value = resolve_includes(parse_override(override.value, name));
    root = with_value(root, override.path, value, name + ": ");
  }
  return Settings(std::move(root), path_);
}

std::string Settings::resolved_text() const { return to_yaml(*node_); }

bool Settings::is_map() const { return node_->kind == Kind::map; }
bool Settings::is_list() const { return node_->kind == Kind::list; }
bool Settings::is_scalar() const { return node_->kind == Kind::scalar; }
bool Settings::is_quoted() const { return is_scalar() && node_->quoted; }
bool Settings::is_null() const { return node_->kind == Kind::null; }

Settings Settings::child(const std::string& key, std::shared_ptr<const SettingsNode> node) const {
  return Settings(std::move(node), path_.empty() ? key : path_ + "." + key);
}

void Settings::need_map() const {
  if (!is_map() && !is_null()) fail(shown() + ": must be a map (key: value)");
}

bool Settings::has(std::string_view key) const { return is_map() && node_->find(key) != nullptr; }

std::optional<Settings> Settings::find(std::string_view key) const {
  need_map();
  const NodePtr* found = node_->find(key);
  if (!found) return std::nullopt;
  return child(std::string(key), *found);
}

Settings Settings::at(std::string_view key) const {
  std::optional<Settings> found = find(key);
  if (!found) fail(fmt::format("the key '{}' is missing", key));
  return *found;
}

std::vector<std::pair<std::string, Settings>> Settings::entries() const {
  need_map();
  std::vector<std::pair<std::string, Settings>> out;
  for (const SettingsNode::Entry& entry : node_->map) out.emplace_back(entry.key, child(entry.key, entry.value));
  return out;
}

void Settings::allow(const std::vector<std::string>& keys) const {
  for (const auto& [key, value] : entries()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    value.fail_key("unknown key" + suggestion(key, keys));
  }
}

std::pair<std::string, Settings> Settings::single(const std::vector<std::string>& choices) const {
  if (!is_map() || node_->map.size() != 1) {
    fail(shown() + ": must be a map with exactly one key; one of: " + joined(choices));
  }
  auto entry = entries().front();
  if (std::find(choices.begin(), choices.end(), entry.first) == choices.end()) {
    entry.second.fail_key("unknown key" + suggestion(entry.first, choices));
  }
  return entry;
}

std::vector<Settings> Settings::items() const {
  std::vector<Settings> out;
  if (is_null()) return out;
  if (!is_list()) return {*this};
  for (std::size_t i = 0; i < node_->list.size(); ++i) {
    out.push_back(Settings(node_->list[i], fmt::format("{}[{}]", path_, i)));
  }
  return out;
}

Settings Settings::with(const std::string& path, const Settings& value) const {
  return Settings(with_value(node_, path, value.node_, value.place() + ": " + value.path() + ": "), path_);
}

Settings Settings::without(std::string_view key) const {
  auto out = std::make_shared<SettingsNode>(*node_);
  std::erase_if(out->map, [&](const SettingsNode::Entry& entry) { return entry.key == key; });
  out->measure();
  return Settings(std::move(out), path_);
}

std::string Settings::path() const { return path_; }
std::string Settings::place() const { return node_->place.text(); }
std::string Settings::key_place() const { return node_->key_place.text(); }
std::string Settings::file() const { return *node_->place.file; }

std::string Settings::resolve_file(const std::string& value) const {
  if (has_nul(value)) fail(clipped(value, kShown) + ": the name of a file has no NUL character (\\0)");
  const std::filesystem::path path(value);
  if (path.is_absolute() || node_->on_command_line) return path.lexically_normal().string();
  return (std::filesystem::path(file()).parent_path() / path).lexically_normal().string();
}

void Settings::fail(const std::string& message) const {
  throw InputError(fmt::format("{}: {}{}{}", place(), path_, path_.empty() ? "" : ": ", message));
}

void Settings::fail_key(const std::string& message) const {
  throw InputError(fmt::format("{}: {}{}{}", key_place(), path_, path_.empty() ? "" : ": ", message));
}

std::string Settings::shown() const {
  if (is_null()) return "nothing";
  return clipped(is_scalar() ? node_->text : to_flow(*node_), kShown);
}

}  // namespace graze
