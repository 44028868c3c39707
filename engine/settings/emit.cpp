// Settings tree -> YAML text. Its hash identifies a scenario, so the text depends on the tree alone.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "engine/settings/tree.h"

namespace graze {
namespace {

bool plain_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("_./+-^% ").find(c) != std::string_view::npos;
}

/// Written bare only where no YAML rule can give it another meaning.
bool is_plain(const SettingsNode& node) {
  const std::string& text = node.text;
  if (node.quoted || text.empty() || text.back() == ' ') return false;
  if (!std::all_of(text.begin(), text.end(), plain_character)) return false;
  const auto digit = [&](std::size_t i) {
    return i < text.size() && std::isdigit(static_cast<unsigned char>(text[i]));
  };
  if (std::isalnum(static_cast<unsigned char>(text[0]))) return true;
  return (text[0] == '-' || text[0] == '+' || text[0] == '.') && (digit(1) || (text[0] != '.' && digit(2)));
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (c == '\n') {
      out += "\\n";
    } else if (byte < 0x20 || byte == 0x7f) {
      out += fmt::format("\\x{:02x}", byte);
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string scalar(const SettingsNode& node) { return is_plain(node) ? node.text : quoted(node.text); }

std::string key_text(const std::string& key) {
  SettingsNode node;
  node.text = key;
  static constexpr std::string_view kNulls[] = {"null", "Null", "NULL"};
  node.quoted = std::find(std::begin(kNulls), std::end(kNulls), key) != std::end(kNulls);
  return scalar(node);
}

void block(const SettingsNode& node, int indent, std::string& out) {
  for (const auto& entry : node.map) {
    out += fmt::format("{:{}}{}:", "", indent, key_text(entry.key));
    const bool nested = entry.value->kind == SettingsNode::Kind::map && !entry.value->map.empty() && indent < 8;
    if (nested) {
      out += "\n";
      block(*entry.value, indent + 2, out);
    } else {
      out += fmt::format(" {}\n", to_flow(*entry.value));
    }
  }
}

}  // namespace

std::string to_flow(const SettingsNode& node) {
  std::string out;
  switch (node.kind) {
    case SettingsNode::Kind::null:
      return "~";
    case SettingsNode::Kind::scalar:
      return scalar(node);
    case SettingsNode::Kind::list:
      for (const NodePtr& item : node.list) out += (out.empty() ? "" : ", ") + to_flow(*item);
      return "[" + out + "]";
    case SettingsNode::Kind::map:
      for (const auto& entry : node.map) {
        out += fmt::format("{}{}: {}", out.empty() ? "" : ", ", key_text(entry.key), to_flow(*entry.value));
      }
      return "{" + out + "}";
  }
  return out;
}

std::string to_yaml(const SettingsNode& root) {
  if (root.kind != SettingsNode::Kind::map || root.map.empty()) return to_flow(root) + "\n";
  std::string out;
  block(root, 0, out);
  return out;
}

}  // namespace graze
