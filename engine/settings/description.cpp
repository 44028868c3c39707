#include "engine/settings/description.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>

#include "engine/settings/units.h"

namespace graze {

Form::Form() = default;
Form::Form(const Form&) = default;
Form::Form(Form&&) noexcept = default;
Form& Form::operator=(const Form&) = default;
Form& Form::operator=(Form&&) noexcept = default;
Form::~Form() = default;

Default::Default() = default;
Default::Default(const Default&) = default;
Default::Default(Default&&) noexcept = default;
Default& Default::operator=(const Default&) = default;
Default& Default::operator=(Default&&) noexcept = default;
Default::~Default() = default;

Key::Key(std::string key, std::vector<Form> ways, Default fallback, std::string line, std::string partner)
    : name(std::move(key)),
      forms(std::move(ways)),
      otherwise(std::move(fallback)),
      help(std::move(line)),
      with(std::move(partner)) {}
Key::Key(const Key&) = default;
Key::Key(Key&&) noexcept = default;
Key& Key::operator=(const Key&) = default;
Key& Key::operator=(Key&&) noexcept = default;
Key::~Key() = default;

Description::Description(std::string line, std::vector<Key> all, std::vector<std::vector<std::string>> groups,
                         std::vector<Form> others, std::string paragraph)
    : help(std::move(line)),
      keys(std::move(all)),
      one_of(std::move(groups)),
      instead(std::move(others)),
      more(std::move(paragraph)) {}
Description::Description(const Description&) = default;
Description::Description(Description&&) noexcept = default;
Description& Description::operator=(const Description&) = default;
Description& Description::operator=(Description&&) noexcept = default;
Description::~Description() = default;

Default Default::required() {
  Default out;
  out.kind = Kind::required;
  return out;
}

Default Default::value(std::string text) {
  Default out;
  out.kind = Kind::value;
  out.text = std::move(text);
  return out;
}

Default Default::words(std::string text) {
  Default out = value(std::move(text));
  out.kind = Kind::words;
  return out;
}

Form Form::of(Kind kind) {
  Form out;
  out.kind = kind;
  return out;
}

Form Form::number(Quantity quantity, Bound bound) {
  Form out = of(Kind::number);
  out.quantity = quantity;
  out.bound = bound;
  return out;
}

Form Form::numbers(int count, Quantity quantity, Bound bound) {
  Form out = number(quantity, bound);
  out.kind = Kind::numbers;
  out.count = count;
  return out;
}

Form Form::mixed_numbers(int count, Quantity one, Quantity other) {
  Form out = numbers(count, one);
  out.other = other;
  return out;
}

Form Form::rows(int count, Quantity quantity) {
  Form out = numbers(count, quantity);
  out.kind = Kind::rows;
  return out;
}

Form Form::joint_numbers(Quantity quantity, Bound bound) {
  Form out = number(quantity, bound);
  out.kind = Kind::joint_numbers;
  return out;
}

Form Form::drawn_list(int count) {
  Form out = of(Kind::drawn_list);
  out.count = count;
  return out;
}

Form Form::whole(Bound bound) {
  Form out = of(Kind::whole);
  out.bound = bound;
  return out;
}

Form Form::word(std::vector<std::string> words) {
  Form out = of(Kind::word);
  out.words = std::move(words);
  return out;
}

Form Form::text(std::string what) {
  Form out = of(Kind::text);
  out.what = std::move(what);
  return out;
}

Form Form::texts(int count, std::string what) {
  Form out = text(std::move(what));
  out.kind = Kind::texts;
  out.count = count;
  return out;
}

Form Form::text_rows(int count, std::string what) {
  Form out = texts(count, std::move(what));
  out.kind = Kind::text_rows;
  return out;
}

Form Form::named_numbers(std::string what) {
  Form out = text(std::move(what));
  out.kind = Kind::named_numbers;
  return out;
}

Form Form::named_values(std::string what) {
  Form out = text(std::move(what));
  out.kind = Kind::named_values;
  return out;
}

Form Form::section(std::string name, std::string told) {
  Form out = word({std::move(told)});
  out.kind = Kind::section;
  out.what = std::move(name);
  return out;
}

Form Form::sections(int count, std::string name, std::string told) {
  Form out = section(std::move(name), std::move(told));
  out.kind = Kind::sections;
  out.count = count;
  return out;
}

Form Form::map(Description inner) {
  Form out = of(Kind::map);
  out.inner = std::make_shared<const Description>(std::move(inner));
  return out;
}

Form Form::maps(Description inner) {
  Form out = map(std::move(inner));
  out.kind = Kind::maps;
  return out;
}

std::vector<std::string> Description::names() const {
  std::vector<std::string> out;
  for (const Key& key : keys) out.push_back(key.name);
  return out;
}

const Key* Description::find(std::string_view name) const {
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const Key& key) { return key.name == name; });
  return found == keys.end() ? nullptr : &*found;
}

bool Description::may_be_empty() const {
  const auto required = [](const Key& key) { return key.otherwise.kind == Default::Kind::required; };
  return one_of.empty() && std::none_of(keys.begin(), keys.end(), required);
}

namespace {

std::string bound_text(Bound bound) {
  if (bound == Bound::fraction) return "0 to 1";
  if (bound == Bound::correlation) return "-1 to 1";
  return bound == Bound::positive ? "> 0" : bound == Bound::not_negative ? ">= 0" : "";
}

std::string joined(const std::vector<std::string>& parts, const char* separator) {
  std::vector<std::string> some;
  for (const std::string& part : parts) {
    if (!part.empty()) some.push_back(part);
  }
  return fmt::format("{}", fmt::join(some, separator));
}

/// "3 numbers, m"; which of mixed ones are in which unit, their key's line of help says.
std::string list_text(const Form& form, const char* rows) {
  const std::string_view unit = form.other ? "1" : unit_of(form.quantity);
  const std::string many = form.count < 0 ? "numbers" : fmt::format("{} numbers", form.count);
  return joined({rows + many, unit == "1" ? "" : std::string(unit), bound_text(form.bound)}, ", ");
}

std::string texts_text(const Form& form) {
  return form.count == 2 ? fmt::format("[{0}, {0}]", form.what) : fmt::format("[{}, …]", form.what);
}

}  // namespace

std::string value_text(const Form& form) {
  const std::string_view unit = unit_of(form.quantity);
  const std::string number = unit == "1" ? "number" : std::string(unit);
  switch (form.kind) {
    case Form::Kind::number:
      if (form.bound == Bound::fraction || form.bound == Bound::correlation) return bound_text(form.bound);
      return joined({number, bound_text(form.bound)}, ", ");
    case Form::Kind::numbers:
      return list_text(form, "");
    case Form::Kind::rows:
      return list_text(form, "lists of ");
    case Form::Kind::joint_numbers:
      return joined({number, bound_text(form.bound)}, ", ") + ", or by joint";
    case Form::Kind::drawn:
      return "parameter's unit";
    case Form::Kind::drawn_list:
      return form.count < 0 ? "numbers" : fmt::format("{} numbers", form.count);
    case Form::Kind::width:
      return "parameter's unit, or %";
    case Form::Kind::labels:
      return "numbers or words";
    case Form::Kind::spread:
      return "distribution";
    case Form::Kind::whole:
      return joined({"whole number", bound_text(form.bound)}, ", ");
    case Form::Kind::flag:
      return "true, false";
    case Form::Kind::named_numbers:
      return fmt::format("{{{}: number, …}}", form.what);
    case Form::Kind::named_values:
      return fmt::format("{{{}: number, true, text, list or map, …}}", form.what);
    case Form::Kind::word:
    case Form::Kind::section:
    case Form::Kind::sections:
      return joined(form.words, ", ");
    case Form::Kind::text:
      return form.what;
    case Form::Kind::texts:
      return texts_text(form);
    case Form::Kind::text_rows:
      return fmt::format("[{}, …]", texts_text(form));
    case Form::Kind::map:
      return "map";  // key_rows() tells its keys
    case Form::Kind::maps:
      return "list of maps";
    case Form::Kind::nothing:
      return "nothing";
  }
  return "";
}

std::string value_text(const Key& key) {
  const auto by_joint = [](const Form& form) { return form.kind == Form::Kind::joint_numbers; };
  if (key.forms.size() == 2 && std::all_of(key.forms.begin(), key.forms.end(), by_joint)) {
    // Of hinges and of sliders: "rad or m, or by joint".
    return fmt::format("{} or {}", unit_of(key.forms[0].quantity), value_text(key.forms[1]));
  }
  std::vector<std::string> ways;
  for (const Form& form : key.forms) ways.push_back(value_text(form));
  return joined(ways, " or ");
}

std::string default_text(const Description& description, const Key& key) {
  if (key.otherwise.kind == Default::Kind::required) return "required";
  if (key.otherwise.kind != Default::Kind::none) return key.otherwise.text;
  for (const std::vector<std::string>& group : description.one_of) {
    if (std::find(group.begin(), group.end(), key.name) == group.end()) continue;
    std::vector<std::string> others;
    for (const std::string& name : group) {
      if (name != key.name) others.push_back(name);
    }
    if (others.size() > 2) return "one of these";
    return fmt::format("this or {}", fmt::join(others, " or "));
  }
  return "";
}

std::vector<KeyRow> key_rows(const Description& description) {
  std::vector<KeyRow> out;
  for (const Key& key : description.keys) {
    out.push_back({key.name, &description, &key});
    for (const Form& form : key.forms) {
      if (!form.inner) continue;
      for (KeyRow& row : key_rows(*form.inner)) {
        out.push_back({key.name + "." + row.path, row.description, row.key});
      }
    }
  }
  return out;
}

std::string plain(std::string_view text) {
  std::string out(text);
  std::erase(out, '`');
  return out;
}

namespace {

/// Exactly one key of a group must be written.
void check_group(const Settings& settings, const std::vector<std::string>& group) {
  const std::string* first = nullptr;
  for (const std::string& name : group) {
    if (!settings.has(name)) continue;
    if (first) settings.at(name).fail_key(fmt::format("stands beside '{}'; only one of the two may", *first));
    first = &name;
  }
  if (!first) settings.fail(fmt::format("either '{}' must stand here", fmt::join(group, "' or '")));
}

}  // namespace

Described::Described(const Settings& settings, const Description& description)
    : settings_(settings), description_(&description) {
  const bool in_place = !settings.is_map() && !description.instead.empty();
  if (in_place) return;
  settings.allow(description.names());
  for (const Key& key : description.keys) {
    if (key.with.empty() || !settings.has(key.name) || settings.has(key.with)) continue;
    settings.at(key.name).fail_key(fmt::format("goes with '{}', which does not stand here", key.with));
  }
  for (const std::vector<std::string>& group : description.one_of) check_group(settings, group);
}

const Key& Described::key_of(std::string_view name) const {
  const Key* const key = description_->find(name);
  assert(key != nullptr && "a key that is not described");
  return *key;
}

std::optional<Settings> Described::find(std::string_view key) const { return settings_.find(key_of(key).name); }

Settings Described::at(std::string_view key) const { return settings_.at(key_of(key).name); }

namespace {

/// Of the alternatives, the one of this kind.
const Form& form_of(const Key& key, Form::Kind kind) {
  const auto found = std::find_if(key.forms.begin(), key.forms.end(), [&](const Form& f) { return f.kind == kind; });
  assert(found != key.forms.end() && "a key that is described as something else");
  return *found;
}

double checked(const Settings& value, const Form& form) {
  switch (form.bound) {
    case Bound::positive:
      return value.positive(form.quantity);
    case Bound::not_negative:
      return value.non_negative(form.quantity);
    case Bound::fraction:
      return value.within(0, 1, form.quantity);
    case Bound::correlation:
      return value.within(-1, 1, form.quantity);
    case Bound::none:
      break;
  }
  return value.number(form.quantity);
}

}  // namespace

std::optional<double> Described::find_number(std::string_view name) const {
  const Key& key = key_of(name);
  const Form& form = form_of(key, Form::Kind::number);
  if (const auto value = settings_.find(name)) return checked(*value, form);
  if (key.otherwise.kind != Default::Kind::value) return std::nullopt;
  return default_number(name);
}

double Described::default_number(std::string_view name) const {
  const Key& key = key_of(name);
  if (key.otherwise.kind == Default::Kind::required)
    static_cast<void>(settings_.at(key.name));  // says that it is missing
  const auto written = split_number(key.otherwise.text);
  const auto value = written ? to_si(key.forms.front().quantity, written->value, written->unit) : std::nullopt;
  assert(value && "a default that is no number of its quantity");
  return value.value();
}

Quantity Described::quantity(std::string_view key) const { return key_of(key).forms.front().quantity; }

double Described::number(std::string_view name) const {
  if (const auto value = find_number(name)) return *value;
  return checked(at(name), form_of(key_of(name), Form::Kind::number));  // which says that it is missing
}

bool Described::flag(std::string_view name) const {
  const Key& key = key_of(name);
  assert(key.otherwise.kind == Default::Kind::value);
  return settings_.flag_or(name, key.otherwise.text == "true");
}

std::string Described::word(std::string_view name) const {
  const Key& key = key_of(name);
  const auto value = settings_.find(name);
  if (!value && key.otherwise.kind == Default::Kind::value) return key.otherwise.text;
  return at(name).choice(form_of(key, Form::Kind::word).words);
}

}  // namespace graze
