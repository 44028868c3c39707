#pragma once
// The tree behind Settings: what YAML says, with the place of every key and value. Nodes never change once built, so
// aliases, includes and overrides share them.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/settings/limits.h"
#include "engine/settings/settings.h"

namespace graze {

using NodePtr = std::shared_ptr<const SettingsNode>;

/// Where something is written. Line and column count from 1; line 0: a place without lines (the command line).
struct SourcePlace {
  std::shared_ptr<const std::string> file;
  int line = 0, column = 0;
  std::string text() const;  // "curb.yaml:31:7"
};

struct SettingsNode {
  enum class Kind { null, scalar, list, map };
  struct Entry {
    std::string key;
    SourcePlace key_place;
    NodePtr value;
  };

  Kind kind = Kind::null;
  std::string text;           // scalar
  bool quoted = false;        // scalar that was written in quotes or as a block
  bool replace = false;       // tagged !replace: takes the place of an included map instead of merging with it
  std::vector<Entry> map;     // in file order, keys unique
  std::vector<NodePtr> list;  // items
  SourcePlace place, key_place;
  bool on_command_line = false;  // relative file names are relative to the working directory
  std::size_t count = 1;         // nodes in the subtree, aliases expanded
  int depth = 1;                 // of the subtree

  const NodePtr* find(std::string_view key) const;
  void measure();  // count and depth from the children
};

/// Text -> tree, `include` not yet resolved. Throws InputError.
NodePtr parse_yaml(const std::string& text, const std::string& name);
/// The same for the value of an override: `name` is "--set path=value".
NodePtr parse_override(const std::string& text, const std::string& name);
/// The whole of a settings file, at most kMaxBytes. Throws InputError that begins with `where`.
std::string read_text(const std::string& file, const std::string& where);

/// The tree with every `include` replaced by what it names.
NodePtr resolve_includes(const NodePtr& root);

/// Parts of a path to a value, `a.b.c`. Far more than the levels of a tree, because keys may hold dots.
inline constexpr std::size_t kMaxPathParts = 1000;

/// Copy of the map `node` in which `path` holds `value`. At each level the longest key of the map that begins the
/// rest of the path is followed, because keys may hold dots; maps that are missing on the way are made. A null takes
/// out what is there. `where` begins the message when the path leads into something that is no map, has too many parts
/// or leads too deep.
NodePtr with_value(const NodePtr& node, const std::string& path, const NodePtr& value, const std::string& where);

/// What an unquoted *, % or { in a line of YAML may have meant: "; * begins an alias in YAML; …". Empty: nothing that
/// is known.
std::string quoting_hint(const std::string& line);

/// "; a tab stands …": what in the layout of a text may have made the parser say `problem` at a line, counted from 0.
std::string layout_hint(const std::string& text, int line, const std::string& problem);

/// The tree as YAML text that parses to the same tree.
std::string to_yaml(const SettingsNode& root);
/// The same in one line, "{kp: 100, kd: 2}": for messages.
std::string to_flow(const SettingsNode& node);

}  // namespace graze
