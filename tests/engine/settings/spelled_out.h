#pragma once
// Settings with every default value that their description tells written out: they must mean what they meant before.

#include <algorithm>
#include <string>

#include "engine/settings/description.h"

namespace graze {

/// The default as YAML: in quotes, as lists with a unit and globs need them.
inline std::string as_yaml(const std::string& text) {
  return text.starts_with("[") || text == "*" ? "\"" + text + "\"" : text;
}

/// `whole` with the defaults of the map at `path`, which is described by `text`. Keys stay out that go with one that is
/// not there. `count`: how many were written.
inline Settings spelled_out(Settings whole, const std::string& path, const Description& text, int& count) {
  Settings at = whole;
  for (std::size_t from = 0; from < path.size();) {
    const std::size_t dot = std::min(path.find('.', from), path.size());
    at = at.at(path.substr(from, dot - from));
    from = dot + 1;
  }
  if (!at.is_map() && !at.is_null()) return whole;
  for (const Key& key : text.keys) {
    const std::string here = path.empty() ? key.name : path + "." + key.name;
    if (at.has(key.name)) {
      for (const Form& form : key.forms) {
        if (form.kind == Form::Kind::map) whole = spelled_out(whole, here, *form.inner, count);
      }
    } else if (key.otherwise.kind == Default::Kind::value && (key.with.empty() || at.has(key.with))) {
      whole = whole.overridden({{here, as_yaml(key.otherwise.text)}});
      ++count;
    }
  }
  return whole;
}

}  // namespace graze
