// `include` and `--set`: trees put together from several sources. Every node keeps the place it was written at.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <unordered_map>

#include "engine/settings/inputs.h"
#include "engine/settings/tree.h"
#include "engine/settings/warnings.h"

namespace graze {
namespace {

std::string beside(const SettingsNode& node, const std::string& file) {
  const std::filesystem::path path(file);
  if (path.is_absolute() || node.on_command_line) return path.lexically_normal().string();
  return (std::filesystem::path(*node.place.file).parent_path() / path).lexically_normal().string();
}

/// `over` wins; maps on both sides are merged; nothing (`key: ~`) takes a key out. Keys keep the order of `under`, new
/// ones follow.
NodePtr merged(const NodePtr& under, const NodePtr& over) {
  using Kind = SettingsNode::Kind;
  if (over->kind != Kind::map || under->kind != Kind::map || over->replace) return over;
  auto out = std::make_shared<SettingsNode>(*over);
  out->map = under->map;
  std::unordered_map<std::string_view, std::size_t> index;
  for (std::size_t i = 0; i < under->map.size(); ++i) index.emplace(under->map[i].key, i);
  std::vector<bool> gone(under->map.size());
  for (const SettingsNode::Entry& entry : over->map) {
    const auto same = index.find(entry.key);
    if (same == index.end()) {
      out->map.push_back(entry);
    } else if (entry.value->kind == Kind::null) {
      gone[same->second] = true;
    } else {
      SettingsNode::Entry& place = out->map[same->second];
      place = {entry.key, entry.key_place, merged(place.value, entry.value)};
    }
  }
  std::size_t i = 0;
  std::erase_if(out->map, [&](const auto&) { return i++ < gone.size() && gone[i - 1]; });
  out->measure();
  return out;
}

class Includer {
 public:
  NodePtr resolve(const NodePtr& node, int depth) {
    if (depth > kMaxDepth) throw InputError(node->place.text() + ": includes nest too deeply");
    if (node->kind == SettingsNode::Kind::list) return resolve_list(*node, depth);
    if (node->kind == SettingsNode::Kind::map) return resolve_map(*node, depth);
    return node;
  }

 private:
  NodePtr resolve_list(const SettingsNode& node, int depth) {
    auto out = std::make_shared<SettingsNode>(node);
    for (NodePtr& item : out->list) item = resolve(item, depth + 1);
    return checked(out);
  }

  NodePtr resolve_map(const SettingsNode& node, int depth) {
    auto own = std::make_shared<SettingsNode>(node);
    own->map.clear();
    NodePtr under;
    for (const SettingsNode::Entry& entry : node.map) {
      if (entry.key == "include") {
        under = included(*entry.value, depth);
      } else {
        own->map.push_back({entry.key, entry.key_place, resolve(entry.value, depth + 1)});
      }
    }
    if (!under) return checked(own);
    own->replace = false;  // the tag is about what this map itself is merged into, further out
    auto out = std::make_shared<SettingsNode>(*merged(under, own));
    out->replace = node.replace;
    return checked(out);
  }

  NodePtr checked(const std::shared_ptr<SettingsNode>& node) const {
    node->measure();
    if (node->count > kMaxNodes)
      throw InputError(fmt::format("{}: more than {} values", node->place.text(), kMaxNodes));
    if (node->depth > kMaxDepth)
      throw InputError(fmt::format("{}: nested deeper than {}", node->place.text(), kMaxDepth));
    return node;
  }

  NodePtr included(const SettingsNode& value, int depth) {
    if (value.kind == SettingsNode::Kind::scalar) return file(value, depth);
    if (value.kind != SettingsNode::Kind::list || value.list.empty()) {
      throw InputError(value.place.text() + ": include: must be a file name or a list of them");
    }
    NodePtr out;
    for (const NodePtr& item : value.list) {
      if (item->kind != SettingsNode::Kind::scalar) {
        throw InputError(item->place.text() + ": include: must be a file name");
      }
      const NodePtr next = file(*item, depth);
      out = out ? merged(out, next) : next;
    }
    return out;
  }

  NodePtr file(const SettingsNode& name, int depth) {
    const std::string where = name.place.text() + ": include: ";
    std::string path = beside(name, name.text);
    if (!input_exists(path)) path = meant_include(name.text, path).value_or(path);
    const std::string identity = input_identity(path);
    if (std::find(open_.begin(), open_.end(), identity) != open_.end()) {
      throw InputError(fmt::format("{}{}: includes itself", where, path));
    }
    if (++files_ > kMaxIncludes) throw InputError(fmt::format("{}more than {} included files", where, kMaxIncludes));
    NodePtr root = parse_yaml(read_text(path, where), path);
    if ((values_ += root->count) > kMaxNodes) {
      throw InputError(
          fmt::format("{}{}: with it, the included files hold more than {} values", where, path, kMaxNodes));
    }
    if (root->kind != SettingsNode::Kind::map) throw InputError(fmt::format("{}{}: is not a map", where, path));
    open_.push_back(identity);
    root = resolve(root, depth + 1);
    open_.pop_back();
    return root;
  }

  std::vector<std::string> open_;
  int files_ = 0;
  std::size_t values_ = 0;  // of all files, before they are merged
};

constexpr std::size_t kPathShown = 80;  // bytes of a path in a message

bool begins(std::string_view path, std::string_view key) {
  return !key.empty() && path.substr(0, key.size()) == key && (path.size() == key.size() || path[key.size()] == '.');
}

/// Maps of the scenario format whose keys are dotted paths themselves, so that a new key may hold dots.
constexpr std::string_view kPathMaps[] = {"uncertain", "over"};

bool keyed_by_paths(const SettingsNode& map, std::string_view name) {
  return std::find(std::begin(kPathMaps), std::end(kPathMaps), name) != std::end(kPathMaps) ||
         std::any_of(map.map.begin(), map.map.end(),
                     [](const auto& e) { return e.key.find_first_of(".*") != std::string::npos; });
}

NodePtr set_in(const NodePtr& node, std::string_view name, std::string_view path, const NodePtr& value,
               const std::string& where);

[[noreturn]] void fail_empty_part(const std::string& where) {
  throw InputError(where + "a part of the path is empty; single dots stand between its parts, as in time.end");
}

NodePtr with_item(const NodePtr& node, std::string_view path, const NodePtr& value, const std::string& where) {
  if (path.empty()) fail_empty_part(where);
  const std::string_view head = path.substr(0, path.find('.'));
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(head.data(), head.data() + head.size(), index);
  if (error != std::errc() || end != head.data() + head.size() || index >= node->list.size()) {
    // As parameters of `uncertain` are called.
    const std::size_t axis = head.size() == 1 ? std::string_view("xyz").find(head) : std::string_view::npos;
    throw InputError(fmt::format("{}'{}': is not one of the list's indices 0 to {}{}", where, clipped(head, kPathShown),
                                 static_cast<long>(node->list.size()) - 1,
                                 axis < node->list.size() ? fmt::format("; nearest right answer: {}", axis) : ""));
  }
  auto out = std::make_shared<SettingsNode>(*node);
  NodePtr& item = out->list[index];
  item = head.size() == path.size() ? value : set_in(item, "", path.substr(head.size() + 1), value, where);
  out->measure();
  return out;
}

/// The entry for a path of which no key of `map` is a part: its value, or maps down to it.
SettingsNode::Entry new_entry(const SettingsNode& map, std::string_view name, std::string_view path,
                              const NodePtr& value, const std::string& where) {
  const std::size_t dot = keyed_by_paths(map, name) ? std::string::npos : path.find('.');
  const std::string key(path.substr(0, dot));
  if (key.empty()) fail_empty_part(where);
  if (dot == std::string::npos) return {key, value->place, value};
  auto parent = std::make_shared<SettingsNode>();
  parent->kind = SettingsNode::Kind::map;
  parent->place = value->place;
  parent->on_command_line = value->on_command_line;
  return {key, value->place, set_in(parent, key, path.substr(dot + 1), value, where)};
}

/// That a key is not there which --set takes out: it may be misspelt.
void warn_of_nothing(const SettingsNode& node, std::string_view path, const std::string& where) {
  std::vector<std::string> keys;
  for (const SettingsNode::Entry& entry : node.map) keys.push_back(entry.key);
  const std::string near = nearest(path.substr(0, path.find('.')), keys);
  warn_as_it_stands(fmt::format("{}there is no '{}' to be taken out, so nothing happens{}", where,
                                clipped(std::string(path), kPathShown),
                                near.empty() ? "" : fmt::format("; nearest: '{}'", near)));
}

/// with_value() in the map that stands under the key `name`.
NodePtr set_in(const NodePtr& node, std::string_view name, std::string_view path, const NodePtr& value,
               const std::string& where) {
  if (node->kind == SettingsNode::Kind::list) return with_item(node, path, value, where);
  if (path.empty()) fail_empty_part(where);
  if (node->kind == SettingsNode::Kind::scalar) {
    throw InputError(fmt::format("{}'{}' leads into a value that is not a map", where, clipped(path, kPathShown)));
  }
  auto out = std::make_shared<SettingsNode>(*node);
  out->kind = SettingsNode::Kind::map;
  SettingsNode::Entry* best = nullptr;
  for (SettingsNode::Entry& entry : out->map) {
    if (begins(path, entry.key) && (!best || entry.key.size() > best->key.size())) best = &entry;
  }
  const auto placed = [&](const NodePtr& what) {
    auto copy = std::make_shared<SettingsNode>(*what);
    copy->key_place = value->place;
    return copy;
  };
  const bool removes = value->kind == SettingsNode::Kind::null;
  if (!best) {
    if (removes) {
      warn_of_nothing(*node, path, where);
      return node;
    }
    SettingsNode::Entry entry = new_entry(*node, name, path, value, where);
    entry.value = placed(entry.value);
    out->map.push_back(std::move(entry));
  } else if (best->key.size() == path.size() && removes) {
    out->map.erase(out->map.begin() + (best - out->map.data()));
  } else if (best->key.size() == path.size()) {
    best->key_place = value->place;
    best->value = placed(value);
  } else {
    best->value = set_in(best->value, best->key, path.substr(best->key.size() + 1), value, where);
  }
  out->measure();
  return out;
}

}  // namespace

NodePtr resolve_includes(const NodePtr& root) { return Includer().resolve(root, 0); }

NodePtr with_value(const NodePtr& node, const std::string& path, const NodePtr& value, const std::string& where) {
  const auto parts = static_cast<std::size_t>(std::count(path.begin(), path.end(), '.')) + 1;
  if (parts > kMaxPathParts) {
    throw InputError(fmt::format("{}a path of {} parts; at most {}", where, parts, kMaxPathParts));
  }
  NodePtr out = set_in(node, "", path, value, where);
  if (out->depth > kMaxDepth)
    throw InputError(fmt::format("{}with it, values are nested deeper than {}", where, kMaxDepth));
  return out;
}

}  // namespace graze
