#include "jobs/cli/description_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "jobs/cli/wrapped_text.h"

namespace graze {
namespace {

/// What a key is, with the key that it goes with.
std::string meaning(const Key& key) {
  return key.with.empty() ? key.help : fmt::format("{} (with `{}`)", key.help, key.with);
}

using Row = std::array<std::string, 4>;

Row cells_of(const KeyRow& row) {
  return {row.path, value_text(*row.key), default_text(*row.description, *row.key), meaning(*row.key)};
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
                      const std::string& more, std::size_t width) {
  std::vector<std::vector<std::string>> cells;
  for (const auto& [name, help] : rows) cells.push_back({name, help});
  return wrapped(title, width) + "\n\n" + columns_text(cells, width) + "\n" + wrapped(more, width) + "\n";
}

std::string keys_text(const std::vector<KeyRow>& keys, std::size_t width) {
  std::vector<std::vector<std::string>> rows = {{"key", "value", "default", "meaning"}};
  for (const KeyRow& key : keys) {
    rows.emplace_back();
    for (const std::string& cell : cells_of(key)) rows.back().push_back(plain(cell));
  }
  return columns_text(rows, width);
}

std::string component_help(const ComponentGroup& group, const Component& component, std::size_t width) {
  const Description& text = component.text;
  const bool vowel = std::string_view("aeiou").find(group.one.front()) != std::string_view::npos;
  std::string out = fmt::format("{}, {} {}: {}\n", component.name, vowel ? "an" : "a", group.one, plain(text.help));
  if (!component.unit.empty()) out += fmt::format("Unit of its margin: {}\n", component.unit);
  if (!text.instead.empty()) {
    out += fmt::format("Value: {}{}\n", instead_text(text), text.keys.empty() ? "" : ", or a map");
  }
  out = wrapped(out, width);
  if (!text.keys.empty()) out += "\n" + keys_text(key_rows(text), width);
  if (!text.more.empty()) out += "\n" + wrapped(plain(text.more), width) + "\n";
  return out;
}

std::string group_help(const ComponentGroup& group, std::size_t width) {
  if (group.all.size() == 1) {
    return component_help(group, group.all.front(), width) + "\n" + wrapped(group.more, width) + "\n";
  }
  std::vector<std::pair<std::string, std::string>> rows;
  for (const Component& component : group.all) rows.emplace_back(component.name, plain(component.text.help));
  const bool keys = std::any_of(group.all.begin(), group.all.end(),
                                [](const Component& component) { return !component.text.keys.empty(); });
  return list_text(group.title, rows, (keys ? "graze help NAME tells its keys. " : "") + group.more, width);
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
  for (const KeyRow& key : key_rows(component.text)) {
    const Row row = cells_of(key);
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
