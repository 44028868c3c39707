#include "tests/fuzz/yaml_mutator.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>
#include <utility>
#include <vector>

#include "engine/settings/tree.h"

namespace graze::fuzz {
namespace {

namespace fs = std::filesystem;
using Kind = SettingsNode::Kind;

struct Entry;

/// A settings tree that can be changed.
struct Value {
  Kind kind = Kind::null;
  std::string text;
  bool quoted = false;
  std::vector<Entry> map;
  std::vector<Value> list;
};

struct Entry {
  std::string key;
  Value value;
};

Value thawed(const SettingsNode& node) {
  Value out{node.kind, node.text, node.quoted, {}, {}};
  for (const auto& entry : node.map) out.map.push_back({entry.key, thawed(*entry.value)});
  for (const NodePtr& item : node.list) out.list.push_back(thawed(*item));
  return out;
}

NodePtr frozen(const Value& value) {
  auto out = std::make_shared<SettingsNode>();
  out->kind = value.kind;
  out->text = value.text;
  out->quoted = value.quoted;
  for (const auto& [key, child] : value.map) out->map.push_back({key, {}, frozen(child)});
  for (const Value& item : value.list) out->list.push_back(frozen(item));
  return out;
}

Value scalar(const std::string& text) { return {Kind::scalar, text, false, {}, {}}; }

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void collect(Value& value, std::vector<Value*>& all) {
  all.push_back(&value);
  for (auto& [key, child] : value.map) collect(child, all);
  for (Value& item : value.list) collect(item, all);
}

/// What other scenarios say: values by their keys, so that a key can get a value that was written for it.
struct Donors {
  std::map<std::string, std::vector<Value>> by_key;
  std::vector<std::string> keys;
  std::vector<Value> scalars;

  Donors() {
    for (const char* folder : {"/data/scenarios", "/tests/scenarios", "/tests/fuzz/corpus/scenario"}) {
      std::vector<fs::path> files;
      for (const auto& entry : fs::directory_iterator(GRAZE_SOURCE_DIR + std::string(folder))) {
        if (entry.path().extension() == ".yaml") files.push_back(entry.path());
      }
      std::sort(files.begin(), files.end());
      for (const fs::path& file : files) add_file(file);
    }
    for (const auto& [key, values] : by_key) keys.push_back(key);
  }

 private:
  void add_file(const fs::path& file) {
    try {
      add(thawed(*parse_yaml(content_of(file), file.string())));
    } catch (const InputError&) {
      // Some seeds are there to be refused.
    }
  }

  void add(const Value& value) {
    if (value.kind == Kind::scalar) scalars.push_back(value);
    for (const auto& [key, child] : value.map) {
      by_key[key].push_back(child);
      add(child);
    }
    for (const Value& item : value.list) add(item);
  }
};

const Donors& donors() {
  static const Donors all;
  return all;
}

const std::vector<std::string>& odd_scalars() {
  static const std::vector<std::string> all = {"0",          "-1",
                                               "1",          "2",
                                               "1e-9",       "1e9",
                                               "1e308",      "-1e308",
                                               "1e-320",     "nan",
                                               ".inf",       "-.inf",
                                               "0.5 %",      "100 %",
                                               "1 mm",       "90 deg",
                                               "1 rad",      "1 s",
                                               "1 ms",       "1 kg",
                                               "1 N",        "1 m/s",
                                               "true",       "no",
                                               "*",          "?",
                                               "{a,b}",      "",
                                               "~",          "x",
                                               "z",          "[1, 2] %",
                                               "4294967296", "9007199254740993"};
  return all;
}

class Mutator {
 public:
  Mutator(Value& root, Dice& dice) : dice_(dice) { collect(root, all_); }

  void run() {
    Value& place = *all_[dice_.below(all_.size())];
    switch (dice_.below(8)) {
      case 0:
        return change_scalar();
      case 1:
        return take_from_donor(place);
      case 2:
        return add_key(place);
      case 3:
        return drop(place);
      case 4:
        return rename(place);
      case 5:
        return swap();
      case 6:
        return repeat(place);
      default:
        return put_in_place(place);
    }
  }

 private:
  Value* some(Kind kind) {
    std::vector<Value*> fitting;
    for (Value* value : all_) {
      if (value->kind == kind) fitting.push_back(value);
    }
    return fitting.empty() ? nullptr : fitting[dice_.below(fitting.size())];
  }

  void change_scalar() {
    Value* const value = some(Kind::scalar);
    if (!value) return;
    const std::size_t space = value->text.find(' ');
    switch (dice_.below(5)) {
      case 0:
        *value = scalar(dice_.of(odd_scalars()));
        break;
      case 1:
        value->text = "-" + value->text;
        break;
      case 2:  // the unit of another
        value->text = value->text.substr(0, space) + " " + dice_.of(donors().scalars).text;
        break;
      case 3:
        value->text = value->text.substr(0, space) + "e" + std::to_string(static_cast<int>(dice_.below(13)) - 6);
        break;
      default:
        *value = dice_.of(donors().scalars);
    }
  }

  /// Some key of a map gets a value that another scenario gives to this key.
  void take_from_donor(Value& map) {
    if (map.map.empty()) return;
    auto& [key, value] = map.map[dice_.below(map.map.size())];
    const auto found = donors().by_key.find(key);
    if (found != donors().by_key.end()) value = dice_.of(found->second);
  }

  static bool has(const Value& map, const std::string& key) {
    return std::any_of(map.map.begin(), map.map.end(), [&](const auto& entry) { return entry.key == key; });
  }

  void add_key(Value& map) {
    const std::string& key = dice_.of(donors().keys);
    if (map.kind != Kind::map || has(map, key)) return;
    map.map.push_back({key, dice_.of(donors().by_key.at(key))});
  }

  void drop(Value& value) {
    if (!value.map.empty())
      value.map.erase(value.map.begin() + static_cast<std::ptrdiff_t>(dice_.below(value.map.size())));
    if (!value.list.empty()) {
      value.list.erase(value.list.begin() + static_cast<std::ptrdiff_t>(dice_.below(value.list.size())));
    }
  }

  void rename(Value& map) {
    if (map.map.empty()) return;
    std::string& key = map.map[dice_.below(map.map.size())].key;
    const std::string& other = dice_.of(donors().keys);
    if (dice_.one_in(3) && !key.empty()) {  // misspelt
      std::string misspelt = key;
      misspelt[dice_.below(key.size())] = static_cast<char>('a' + dice_.below(26));
      if (!has(map, misspelt)) key = misspelt;
    } else if (!has(map, other)) {
      key = other;
    }
  }

  /// Values of two keys of one map, or two items of one list, change places.
  void swap() {
    Value* const value = some(dice_.one_in(2) ? Kind::map : Kind::list);
    if (!value) return;
    if (!value->map.empty()) {
      std::swap(value->map[dice_.below(value->map.size())].value, value->map[dice_.below(value->map.size())].value);
    }
    if (!value->list.empty()) {
      std::swap(value->list[dice_.below(value->list.size())], value->list[dice_.below(value->list.size())]);
    }
  }

  void repeat(Value& value) {
    if (!value.list.empty()) {
      const Value item = value.list[dice_.below(value.list.size())];
      value.list.insert(value.list.end(), 1 + dice_.below(4), item);
    } else if (!value.map.empty()) {
      const auto [key, child] = value.map[dice_.below(value.map.size())];
      const std::string other = key + static_cast<char>('a' + dice_.below(26));
      if (!has(value, other)) value.map.push_back({other, child});
    }
  }

  /// Another value of the tree, or one of another kind around it, stands here.
  void put_in_place(Value& value) {
    const Value other = *all_[dice_.below(all_.size())];
    switch (dice_.below(3)) {
      case 0:
        value = other;
        break;
      case 1:
        value = Value{Kind::list, "", false, {}, {value, other}};
        break;
      default:
        value = Value{Kind::map, "", false, {{dice_.of(donors().keys), value}}, {}};
    }
  }

  Dice& dice_;
  std::vector<Value*> all_;
};

}  // namespace

std::string mutated_yaml(const std::string& text, Dice& dice) {
  try {
    Value root = thawed(*parse_yaml(text, "mutant"));
    for (std::size_t i = 1 + dice.below(3); i > 0; --i) Mutator(root, dice).run();
    return to_yaml(*frozen(root));
  } catch (const InputError&) {
    return text;
  }
}

}  // namespace graze::fuzz
