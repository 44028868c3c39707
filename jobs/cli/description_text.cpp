#include "jobs/cli/description_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

namespace graze {
namespace {

/// Characters of a text, for columns; they are not bytes.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

std::string padded(const std::string& text, std::size_t width) {
  return text + std::string(width - std::min(width, width_of(text)), ' ');
}

/// What a key is, with the key that it goes with.
std::string meaning(const Key& key) {
  return key.with.empty() ? key.help : fmt::format("{} (with `{}`)", key.help, key.with);
}

using Row = std::array<std::string, 4>;

std::vector<Row> rows_of(const Description& description) {
  std::vector<Row> out;
  for (const KeyRow& row : key_rows(description)) {
    out.push_back({row.path, value_text(*row.key), default_text(*row.description, *row.key), meaning(*row.key)});
  }
  return out;
}

/// What stands behind the name, when it is no map.
std::string instead_text(const Description& description) {
  std::vector<std::string> ways;
  for (const Form& form : description.instead) {
    // In the place of a map, true says that it is there; false would say nothing.
    ways.push_back(form.kind == Form::Kind::flag ? "true" : value_text(form));
  }
  return fmt::format("{}", fmt::join(ways, " or "));
}

std::string in_cell(std::string text) {
  for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) text.insert(at, "\\");
  return text;
}

/// "`tilt: {link, below}`"
std::string written(const Component& component) {
  const Description& text = component.text;
  const bool paths = !text.keys.empty() && text.keys.front().name.find('.') != std::string::npos;  // of channels
  if (text.keys.empty() || paths) return fmt::format("`{}`", component.name);
  constexpr std::size_t kShown = 6;
  std::vector<std::string> names = text.names();
  if (names.size() > kShown) names.resize(kShown), names.push_back("…");
  return fmt::format("`{}: {{{}}}`", component.name, fmt::join(names, ", "));
}

std::string meaning(const Description& text) {
  std::string out = text.help;
  if (text.keys.empty() && !text.instead.empty()) out += fmt::format(" ({})", instead_text(text));
  return text.more.empty() ? out : out + ". " + text.more;
}

}  // namespace

std::string list_text(const std::string& title, const std::vector<std::pair<std::string, std::string>>& rows,
                      const std::string& more) {
  std::size_t width = 0;
  for (const auto& [name, help] : rows) width = std::max(width, name.size());
  std::string out = title + "\n\n";
  for (const auto& [name, help] : rows) {
    out += help.empty() ? fmt::format("  {}\n", name) : fmt::format("  {:{}}  {}\n", name, width, help);
  }
  return out + "\n" + more + "\n";
}

std::string component_help(const ComponentGroup& group, const Component& component) {
  const Description& text = component.text;
  const bool vowel = std::string_view("aeiou").find(group.one.front()) != std::string_view::npos;
  std::string out = fmt::format("{}, {} {}: {}\n", component.name, vowel ? "an" : "a", group.one, plain(text.help));
  if (!component.unit.empty()) out += fmt::format("Unit of its margin: {}\n", component.unit);
  if (!text.instead.empty()) {
    out += fmt::format("Value: {}{}\n", instead_text(text), text.keys.empty() ? "" : ", or a map");
  }
  std::vector<Row> rows = rows_of(text);
  if (!rows.empty()) {
    rows.insert(rows.begin(), {"key", "value", "default", "meaning"});
    std::array<std::size_t, 3> width{};
    for (const Row& row : rows) {
      for (std::size_t i = 0; i < width.size(); ++i) width[i] = std::max(width[i], width_of(row[i]));
    }
    out += "\n";
    for (const Row& row : rows) {
      std::string line = " ";
      for (std::size_t i = 0; i < width.size(); ++i) line += " " + padded(plain(row[i]), width[i]) + " ";
      out += line + " " + plain(row[3]) + "\n";
    }
  }
  if (!text.more.empty()) out += "\n" + plain(text.more) + "\n";
  return out;
}

std::string group_help(const ComponentGroup& group) {
  if (group.all.size() == 1) return component_help(group, group.all.front()) + "\n" + group.more + "\n";
  std::vector<std::pair<std::string, std::string>> rows;
  for (const Component& component : group.all) rows.emplace_back(component.name, plain(component.text.help));
  const bool keys = std::any_of(group.all.begin(), group.all.end(),
                                [](const Component& component) { return !component.text.keys.empty(); });
  return list_text(group.title, rows, (keys ? "graze help NAME tells its keys. " : "") + group.more);
}

std::string group_table(const ComponentGroup& group) {
  const bool units =
      std::any_of(group.all.begin(), group.all.end(), [](const Component& c) { return !c.unit.empty(); });
  std::string out = units ? fmt::format("| {} | margin | meaning |\n|---|---|---|\n", group.one)
                          : fmt::format("| {} | meaning |\n|---|---|\n", group.one);
  for (const Component& component : group.all) {
    out += fmt::format("| {} | ", written(component));
    if (units) out += component.unit + " | ";
    out += in_cell(meaning(component.text)) + " |\n";
  }
  return out;
}

std::string key_table(const Component& component) {
  std::string out = "| key | value | default | meaning |\n|---|---|---|---|\n";
  for (const Row& row : rows_of(component.text)) {
    out += fmt::format("| `{}` | {} | {} | {} |\n", row[0], in_cell(row[1]), in_cell(row[2]), in_cell(row[3]));
  }
  return out;
}

std::optional<std::string> docs_table(const std::string& name) {
  for (const ComponentGroup& group : component_groups()) {
    if (name == group.topic) return group_table(group);
    for (const Component& component : group.all) {
      if (name == group.one + " " + component.name) return key_table(component);
    }
  }
  return std::nullopt;
}

}  // namespace graze
