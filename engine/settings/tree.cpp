#include "engine/settings/tree.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <unordered_set>

#include "engine/settings/inputs.h"

namespace graze {

std::string SourcePlace::text() const { return line > 0 ? fmt::format("{}:{}:{}", *file, line, column) : *file; }

const NodePtr* SettingsNode::find(std::string_view key) const {
  for (const Entry& entry : map) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

void SettingsNode::measure() {
  count = 1;
  depth = 1;
  const auto add = [this](const SettingsNode& child) {
    count += child.count;
    depth = std::max(depth, child.depth + 1);
  };
  for (const Entry& entry : map) add(*entry.value);
  for (const NodePtr& item : list) add(*item);
}

namespace {

constexpr std::string_view kReplace = "!replace";
constexpr std::size_t kShownTag = 40;  // bytes of a tag in a message

/// The line of this number, from 0; empty if there is none.
std::string line_of(const std::string& text, int number) {
  std::istringstream lines(text);
  std::string line;
  for (int i = 0; i <= number && std::getline(lines, line); ++i) {
    if (i == number) return line;
  }
  return "";
}

/// Parsers notice late: the line of the mark, or the one before it.
std::string hint_near(const std::string& text, const YAML::Mark& mark) {
  const std::string hint = quoting_hint(line_of(text, mark.line));
  return hint.empty() ? quoting_hint(line_of(text, mark.line - 1)) : hint;
}

std::string hint_of(const std::string& text, const YAML::Exception& error) {
  const std::string hint = hint_near(text, error.mark);
  return hint.empty() ? layout_hint(text, error.mark.line, error.msg) : hint;
}

/// Builds the tree from the parser's events: places stay, duplicate keys and cycles cannot come in, and the size of
/// what aliases expand to is known before anything is expanded.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(const std::string& name, bool lines, const std::string& text)
      : file_(std::make_shared<std::string>(name)), lines_(lines), text_(text) {}

  NodePtr root() const { return root_; }

  void OnDocumentStart(const YAML::Mark& mark) override { last_ = mark; }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    finish(begin(SettingsNode::Kind::null, mark), anchor);
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) fail_hinting(mark, "an alias inside the value that it names");
    auto copy = std::make_shared<SettingsNode>(*found->second);
    total_ += copy->count;  // before it is copied once more: a list of aliases must not outgrow the bound
    place_in_parent(std::move(copy), mark);
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    check_tag(mark, tag);
    if (expects_key()) {
      take_key(mark, value);
      if (anchor != 0) fail(mark, "an anchor on a key");
      return;
    }
    auto node = begin(SettingsNode::Kind::scalar, mark);
    node->text = value;
    node->quoted = tag == "!";
    finish(node, anchor);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    check_tag(mark, tag);
    open(begin(SettingsNode::Kind::list, mark), anchor, mark);
  }
  void OnSequenceEnd() override { close(); }

  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    check_tag(mark, tag);
    auto node = begin(SettingsNode::Kind::map, mark);
    node->replace = tag == kReplace;
    open(node, anchor, mark);
  }
  void OnMapEnd() override { close(); }

 private:
  struct Open {
    std::shared_ptr<SettingsNode> node;
    YAML::anchor_t anchor;
    bool has_key = false;
    std::string key;
    SourcePlace key_place;
    std::unordered_set<std::string> keys;  // so far
  };

  SourcePlace place(const YAML::Mark& mark) const {
    if (!lines_) return {file_, 0, 0};
    return {file_, mark.line + 1, mark.column + 1};
  }

  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& message) const {
    throw InputError(fmt::format("{}: {}", place(mark).text(), message));
  }

  [[noreturn]] void fail_hinting(const YAML::Mark& mark, const std::string& message) const {
    fail(mark, message + quoting_hint(line_of(text_, mark.line)));
  }

  /// A tag that nobody knows would say nothing, so that a misspelt !replace would merge.
  void check_tag(const YAML::Mark& mark, const std::string& tag) const {
    constexpr std::string_view kYaml = "tag:yaml.org,2002:";
    static const std::vector<std::string> known = {"", "?", "!", std::string(kReplace)};
    static const std::vector<std::string> types = {"str", "int", "float", "bool", "null", "map", "seq"};
    if (std::find(known.begin(), known.end(), tag) != known.end()) return;
    const bool of_yaml = tag.starts_with(kYaml);
    const std::string name = of_yaml ? tag.substr(kYaml.size()) : tag;
    if (of_yaml && std::find(types.begin(), types.end(), name) != types.end()) return;
    const bool near = !nearest(of_yaml ? "!" + name : name, {std::string(kReplace)}).empty();
    fail(mark, fmt::format("{}: an unknown tag; {}", clipped((of_yaml ? "!!" : "") + name, kShownTag),
                           near ? "did you mean !replace?"
                                : "the only one is !replace, by which a map takes the place of an included one"));
  }

  bool expects_key() const {
    return !stack_.empty() && stack_.back().node->kind == SettingsNode::Kind::map && !stack_.back().has_key;
  }

  void take_key(const YAML::Mark& mark, const std::string& key) {
    Open& top = stack_.back();
    if (key.size() > kMaxKeyBytes) {
      fail(mark,
           fmt::format("a key of {} bytes; at most {}: keys are names, paths and globs", key.size(), kMaxKeyBytes));
    }
    if (!top.keys.insert(key).second) {
      const auto& map = top.node->map;
      const auto first = std::find_if(map.begin(), map.end(), [&](const auto& entry) { return entry.key == key; });
      fail(mark, fmt::format("the key '{}' stands here for the second time; the first is at {}", key,
                             first->key_place.text()));
    }
    top.has_key = true;
    top.key = key;
    top.key_place = place(mark);
  }

  std::shared_ptr<SettingsNode> begin(SettingsNode::Kind kind, const YAML::Mark& mark) {
    if (expects_key()) fail_hinting(mark, "a key must be a plain word, not a list, a map, an alias or nothing");
    last_ = mark;
    auto node = std::make_shared<SettingsNode>();
    node->kind = kind;
    node->place = place(mark);
    node->on_command_line = !lines_;
    return node;
  }

  void open(std::shared_ptr<SettingsNode> node, YAML::anchor_t anchor, const YAML::Mark& mark) {
    if (static_cast<int>(stack_.size()) >= kMaxDepth) fail(mark, fmt::format("nested deeper than {}", kMaxDepth));
    stack_.push_back({std::move(node), anchor, false, {}, {}, {}});
  }

  void close() {
    Open top = std::move(stack_.back());
    stack_.pop_back();
    top.node->measure();
    finish(top.node, top.anchor);
  }

  void finish(const std::shared_ptr<SettingsNode>& node, YAML::anchor_t anchor) {
    place_in_parent(node, last_);
    if (anchor != 0) anchors_[anchor] = node;
  }

  void place_in_parent(std::shared_ptr<SettingsNode> node, const YAML::Mark& mark) {
    if (expects_key()) fail_hinting(mark, "a key must be a plain word, not an alias");
    total_ += stack_.empty() ? 0 : 1;
    if (node->count > kMaxNodes || total_ > kMaxNodes) fail(mark, fmt::format("more than {} values", kMaxNodes));
    if (node->depth + static_cast<int>(stack_.size()) > kMaxDepth) {
      fail(mark, fmt::format("nested deeper than {}", kMaxDepth));
    }
    if (stack_.empty()) {
      node->key_place = node->place;
      root_ = std::move(node);
      return;
    }
    Open& top = stack_.back();
    if (top.node->kind == SettingsNode::Kind::list) {
      node->key_place = node->place;
      top.node->list.push_back(std::move(node));
      return;
    }
    node->key_place = top.key_place;
    top.node->map.push_back({top.key, top.key_place, std::move(node)});
    top.has_key = false;
  }

  std::shared_ptr<const std::string> file_;
  bool lines_;
  const std::string& text_;
  YAML::Mark last_;
  NodePtr root_;
  std::size_t total_ = 0;
  std::vector<Open> stack_;
  std::map<YAML::anchor_t, std::shared_ptr<SettingsNode>> anchors_;  // of finished nodes only, so that no cycle forms
};

NodePtr parse(const std::string& text, const std::string& name, bool lines) {
  if (text.size() > kMaxBytes) {
    throw InputError(fmt::format("{}: {} bytes; at most {} are read", name, text.size(), bytes_in_words(kMaxBytes)));
  }
  if (text.starts_with("\x89HDF\r\n\x1a\n")) {
    throw InputError(
        fmt::format("{}:1:1: not YAML: it is an HDF5 file, as archives are; a scenario belongs here (graze score {} "
                    "reads an archive)",
                    name, name));
  }
  if (const std::size_t zero = text.find('\0'); zero != std::string::npos) {
    const auto begin = text.begin(), end = begin + static_cast<std::ptrdiff_t>(zero);
    const std::size_t line_begin = zero == 0 ? std::string::npos : text.rfind('\n', zero - 1);
    throw InputError(fmt::format("{}:{}:{}: not YAML: a byte 0, which no text has", name,
                                 1 + std::count(begin, end, '\n'),
                                 line_begin == std::string::npos ? zero + 1 : zero - line_begin));
  }
  TreeBuilder builder(name, lines, text);
  std::istringstream stream(text);
  try {
    YAML::Parser parser(stream);
    const bool any = parser.HandleNextDocument(builder);
    NodePtr root = builder.root();
    if (!any || !root) {
      auto empty = std::make_shared<SettingsNode>();
      empty->place = empty->key_place = {std::make_shared<std::string>(name), lines ? 1 : 0, lines ? 1 : 0};
      empty->on_command_line = !lines;
      return empty;
    }
    if (parser.HandleNextDocument(builder)) throw InputError(name + ": holds more than one YAML document");
    return root;
  } catch (const YAML::Exception& e) {
    const std::string where =
        lines && !e.mark.is_null() ? fmt::format("{}:{}:{}", name, e.mark.line + 1, e.mark.column + 1) : name;
    throw InputError(fmt::format("{}: not YAML: {}{}", where, e.msg, hint_of(text, e)));
  }
}

/// What is wrong with the brackets of a list or map in one line, which the parser takes for something else: "'[' has no
/// ']'". Empty: nothing.
std::string bracket_problem(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string::npos || (text[first] != '[' && text[first] != '{')) return "";
  std::string open;  // closing brackets that are still to come
  char quote = 0, before = 0;
  for (const char c : text) {
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if ((c == '"' || c == '\'') && std::string_view("[{,:").find(before) != std::string_view::npos) {
      quote = c;
    } else if (c == '[' || c == '{') {
      open += c == '[' ? ']' : '}';
    } else if (c == ']' || c == '}') {
      if (open.empty()) return fmt::format("'{}' closes nothing", c);
      if (open.back() != c) return fmt::format("'{}' stands where '{}' should", c, open.back());
      open.pop_back();
    }
    if (c != ' ') before = c;
  }
  if (quote != 0) return fmt::format("the quote {} is not closed", quote);
  if (open.empty()) return "";
  return fmt::format("'{}' has no '{}'; nearest right answer: {}{}", open.back() == ']' ? '[' : '{', open.back(), text,
                     std::string(open.rbegin(), open.rend()));
}

}  // namespace

NodePtr parse_yaml(const std::string& text, const std::string& name) { return parse(text, name, true); }

NodePtr parse_override(const std::string& text, const std::string& name) {
  try {
    return parse(text, name, false);
  } catch (const InputError&) {
    const std::string problem = bracket_problem(text);
    if (problem.empty()) throw;
    throw InputError(fmt::format("{}: {}", name, problem));
  }
}

std::string read_text(const std::string& file, const std::string& where) { return read_input(file, where, kMaxBytes); }

}  // namespace graze
