#include "jobs/cli/scenario_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/settings/units.h"
#include "scenarios/components.h"
#include "scenarios/keys.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNumber = "^\\s*[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?\\s*";
/// "[25, 75, 0, 50] %", in quotes.
const Json kListText = {{"type", "string"}, {"pattern", "^\\s*\\[.*\\].*$"}};

/// A pattern of numbers with one of these units or none.
Json number_with(const std::vector<std::string>& units) {
  std::string pattern;
  for (const std::string& unit : units) {
    pattern += pattern.empty() ? "" : "|";
    for (const char c : unit) pattern += c == '^' ? "\\^" : std::string(1, c);
  }
  return {{"anyOf",
           {{{"type", "number"}}, {{"type", "string"}, {"pattern", fmt::format("{}({})?\\s*$", kNumber, pattern)}}}}};
}

Json one_or_any(std::vector<Json> ways) { return ways.size() == 1 ? ways.front() : Json{{"anyOf", std::move(ways)}}; }

Json reference(const std::string& name) { return {{"$ref", "#/$defs/" + name}}; }

class SchemaWriter {
 public:
  Json write() {
    Json out = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "Graze scenario"}};
    out.update(map(section_of("scenario"), false));
    out["description"] =
        "One robot, its world, what is uncertain about them, policies and a task. docs/scenario.md explains every key. "
        "Checks that need the robot or other files are left to `graze check`.";
    out["properties"]["graze"] = {{"description", "Version of the format"}, {"const", 1}};
    out["if"] = {{"not", {{"required", {"include"}}}}};
    out["then"] = {{"required", {"graze", "robot", "policies"}}};
    add_numbers();
    add_groups();
    add_sections();
    Json sorted = Json::object();
    std::vector<std::string> names;
    for (const auto& [name, value] : defs_.items()) names.push_back(name);
    std::sort(names.begin(), names.end());
    for (const std::string& name : names) sorted[name] = defs_[name];
    out["$defs"] = sorted;
    return out;
  }

 private:
  // ---- values

  Json quantity(Quantity quantity, Bound bound) {
    const std::string name = std::string("quantity.") + quantity_names()[static_cast<std::size_t>(quantity)];
    if (!defs_.contains(name)) defs_[name] = number_with(unit_names(quantity));
    Json out = reference(name);
    if (bound == Bound::positive) out["exclusiveMinimum"] = 0;
    if (bound == Bound::not_negative || bound == Bound::fraction) out["minimum"] = 0;
    if (bound == Bound::correlation) out["minimum"] = -1;
    if (bound == Bound::fraction || bound == Bound::correlation) out["maximum"] = 1;
    return out;
  }

  /// A list of numbers, whose last item may be the unit of all.
  Json list(int count, const Json& item, const std::vector<std::string>& units) {
    Json array = {{"type", "array"}, {"items", one_or_any({item, {{"type", "string"}, {"enum", units}}})}};
    if (count >= 0) array["minItems"] = count, array["maxItems"] = count + 1;
    return one_or_any({array, kListText});
  }

  Json numbers(const Form& form) {
    constexpr const char* kBounds[] = {"", ".positive", ".not_negative", ".fraction", ".correlation"};
    const auto name_of = [](Quantity one) { return quantity_names()[static_cast<std::size_t>(one)]; };
    const std::string name = fmt::format(
        "list.{}{}{}{}", name_of(form.quantity), form.other ? "." + name_of(*form.other) : std::string(),
        form.count < 0 ? "" : fmt::format(".{}", form.count), kBounds[static_cast<std::size_t>(form.bound)]);
    if (defs_.contains(name)) return reference(name);
    const Json one = quantity(form.quantity, form.bound);
    if (form.other) {  // no unit is that of all
      const Json item = one_or_any({one, quantity(*form.other, form.bound)});
      defs_[name] = one_or_any({array_of(item, form.count), kListText});
    } else {
      defs_[name] = list(form.count, one, unit_names(form.quantity));
    }
    return reference(name);
  }

  static Json array_of(const Json& item, int count = -1) {
    Json out = {{"type", "array"}, {"items", item}, {"minItems", std::max(count, 1)}};
    if (count >= 0) out["maxItems"] = count;
    return out;
  }

  Json value(const Form& form) {
    const Json text = {{"type", "string"}};
    const auto by_glob = [](const Json& item) { return Json{{"type", "object"}, {"additionalProperties", item}}; };
    switch (form.kind) {
      case Form::Kind::number:
        return quantity(form.quantity, form.bound);
      case Form::Kind::numbers:
        return numbers(form);
      case Form::Kind::rows:
        return array_of(numbers(form));
      case Form::Kind::joint_numbers: {
        const Json one = quantity(form.quantity, form.bound);
        return one_or_any({one, by_glob(one)});
      }
      case Form::Kind::drawn:
        return reference("number");
      case Form::Kind::drawn_list: {
        Json out = array_of(reference("number"));
        if (form.count >= 0) out["minItems"] = form.count, out["maxItems"] = form.count + 1;
        return one_or_any({out, kListText});
      }
      case Form::Kind::width:
        return reference("spread_width");
      case Form::Kind::labels:
        return array_of({{"type", {"number", "string"}}});
      case Form::Kind::spread:
        return reference("spread");
      case Form::Kind::whole: {
        Json out = {{"type", "integer"}};
        if (form.bound != Bound::none) out["minimum"] = form.bound == Bound::positive ? 1 : 0;
        return out;
      }
      case Form::Kind::flag:
        return {{"type", "boolean"}};
      case Form::Kind::word:
        return {{"enum", form.words}};
      case Form::Kind::text:
        return text;
      case Form::Kind::texts:
        return array_of(text, form.count);
      case Form::Kind::text_rows:
        return {{"type", "array"}, {"items", array_of(text, form.count)}};
      case Form::Kind::named_numbers:
        return by_glob(reference("number"));
      case Form::Kind::named_values:
        return {{"type", "object"}};  // a stranger's, who alone knows what they are
      case Form::Kind::section:
        return reference(form.what);
      case Form::Kind::sections:
        return one_or_any({reference(form.what), array_of(reference(form.what), form.count)});
      case Form::Kind::map:
        return component(*form.inner, true);
      case Form::Kind::maps:
        return {{"type", "array"},
                {"items", form.inner->instead.empty() ? map(*form.inner, true) : component(*form.inner, true)}};
      case Form::Kind::nothing:
        return {{"type", "null"}};
    }
    return {};
  }

  /// A default as it would be written, if it is no list.
  static void add_default(const Key& key, Json& out) {
    if (key.otherwise.kind != Default::Kind::value || key.otherwise.text.starts_with("[")) return;
    const Form::Kind kind = key.forms.front().kind;
    const auto written = split_number(key.otherwise.text);
    if (kind == Form::Kind::flag) {
      out["default"] = key.otherwise.text == "true";
    } else if (kind == Form::Kind::whole) {
      out["default"] = static_cast<long long>(written->value);
    } else if (written && written->unit.empty()) {
      out["default"] = written->value;
    } else {
      out["default"] = key.otherwise.text;
    }
  }

  /// Numbers by joint of several quantities: one map may name joints that turn and joints that slide.
  std::vector<Json> joint_ways(const Key& key) {
    std::vector<Json> out;
    for (const Form& form : key.forms) out.push_back(quantity(form.quantity, form.bound));
    const Json one = one_or_any(out);
    out.push_back({{"type", "object"}, {"additionalProperties", one}});
    return out;
  }

  Json property(const Key& key) {
    std::vector<Json> ways;
    for (const Form& form : key.forms) ways.push_back(value(form));
    const auto by_joint = [](const Form& form) { return form.kind == Form::Kind::joint_numbers; };
    if (key.forms.size() > 1 && std::all_of(key.forms.begin(), key.forms.end(), by_joint)) ways = joint_ways(key);
    Json out = one_or_any(std::move(ways));
    const bool words = key.otherwise.kind == Default::Kind::words;
    const std::string help = key.help + (words ? "; default: " + key.otherwise.text : "");
    if (!help.empty()) out["description"] = plain(help);
    add_default(key, out);
    return out;
  }

  // ---- maps

  /// `whole`: keys that are required must be there; else the map may be a part that overrides one of an include.
  Json map(const Description& text, bool whole) {
    Json out = {{"type", "object"}, {"description", plain(text.help)}, {"properties", Json::object()}};
    Json required = Json::array(), partners = Json::object();
    for (const Key& key : text.keys) {
      out["properties"][key.name] = property(key);
      if (key.otherwise.kind == Default::Kind::required) required.push_back(key.name);
      if (!key.with.empty() && whole) partners[key.name] = Json::array({key.with});
    }
    out["properties"]["include"] = reference("include");
    out["additionalProperties"] = false;
    if (whole && !required.empty()) out["required"] = required;
    if (!partners.empty()) out["dependentRequired"] = partners;
    if (whole && text.one_of.size() == 1) {
      for (const std::string& name : text.one_of.front()) out["oneOf"].push_back({{"required", {name}}});
    }
    return out;
  }

  /// What stands behind the name of a component.
  Json component(const Description& text, bool whole) {
    std::vector<Json> ways;
    for (const Form& form : text.instead) {
      // In the place of a map, true says that it is there; false would say nothing.
      ways.push_back(form.kind == Form::Kind::flag ? Json{{"const", true}} : value(form));
    }
    const bool nothing = std::any_of(text.instead.begin(), text.instead.end(),
                                     [](const Form& form) { return form.kind == Form::Kind::nothing; });
    if (!text.keys.empty() || ways.empty()) {
      if (text.may_be_empty() && !nothing) ways.push_back({{"type", "null"}});
      ways.push_back(map(text, whole));
    }
    if (ways.size() == 1) {
      ways.front()["description"] = plain(text.help);
      return ways.front();
    }
    return {{"description", plain(text.help)}, {"anyOf", std::move(ways)}};
  }

  // ---- definitions

  void add_numbers() {
    std::vector<std::string> units;
    for (std::size_t i = 0; i < quantity_names().size(); ++i) {
      for (const std::string& unit : unit_names(static_cast<Quantity>(i))) {
        if (std::find(units.begin(), units.end(), unit) == units.end()) units.push_back(unit);
      }
    }
    defs_["number"] = number_with(units);
    defs_["number"]["description"] = "A number of any quantity; the reader checks the unit";
    Json width = number_with(units);
    width["description"] = "In the unit of the parameter, or % of its nominal value";
    width["anyOf"][0]["minimum"] = 0;
    std::string pattern = width["anyOf"][1]["pattern"];
    width["anyOf"][1]["pattern"] = pattern.replace(pattern.find("[+-]?"), 5, "\\+?");
    defs_["spread_width"] = width;
    defs_["include"] = {{"description", "Files whose maps are merged under this one; keys here win"},
                        {"anyOf", {{{"type", "string"}}, array_of({{"type", "string"}})}}};
  }

  void add_groups() {
    for (const ComponentGroup& group : component_groups()) {
      if (group.topic == "sections" || group.topic == "objectives" || group.topic == "sensors") continue;
      if (group.topic == "physics" || group.topic == "contact_models") continue;  // values, no keys
      // Scenarios often override a part of an included policy, and seldom one of the others, which are small.
      const bool whole = group.topic != "policies" && group.topic != "trackers";
      for (const Component& one : group.all) {
        defs_[group.one + "." + one.name] = component(one.text, whole);
        named_[group.one].push_back(one.name);
      }
    }
  }

  /// A map whose keys are the components of a kind and others.
  Json choice(const std::string& kind, const Description& text, const std::vector<std::string>& names) {
    Json out = map(text, false), properties = Json::object();
    for (const std::string& name : names) properties[name] = reference(kind + "." + name);
    for (const auto& [key, value] : out["properties"].items()) {
      if (!properties.contains(key)) properties[key] = value;
    }
    out["properties"] = properties;
    return out;
  }

  static Json by_name(const std::string& help, const Json& item, const std::string& one) {
    return {{"description", help},
            {"type", "object"},
            {"properties", {{"include", reference("include")}}},
            {"additionalProperties",
             one_or_any({item, {{"type", "null"}, {"description", "Takes an included " + one + " out"}}})}};
  }

  void add_sections() {
    for (const auto& [name, text] : scenario_sections()) {
      if (name == "scenario") continue;
      const bool whole = name == "pair" || name == "axis" || name == "correlated";
      defs_[name] = map(text, whole);
    }
    add_world();
    add_spreads();
    add_policies();
    add_task();
  }

  void add_world() {
    defs_["design_variables"] = by_name("Numbers of the design by name", reference("design_variable"), "variable");
    defs_["object"] = choice("shape", section_of("object"), named_["shape"]);
    defs_["environment"] = by_name("Objects by name", reference("object"), "object");
    defs_["disturbances"] = by_name("Pushes and payloads by name", reference("disturbance"), "disturbance");
  }

  void add_spreads() {
    Json& spread = defs_["spread"] = choice("distribution", section_of("spread"), distribution_names());
    spread["minProperties"] = 1;
    spread["if"] = {{"required", {"jitter"}}};
    spread["then"] = {{"maxProperties", 2}};
    spread["else"] = {{"maxProperties", 1}};
    std::vector<std::string> names = section_of("jitter").names();
    Json& jitter = defs_["jitter"] = choice("distribution", section_of("jitter"), names);
    jitter["minProperties"] = jitter["maxProperties"] = 1;
    Json any = one_or_any(
        {reference("number"), reference("spread"), {{"type", "null"}, {"description", "Takes an included entry out"}}});
    defs_["uncertain"] = {{"description", "Distributions by glob of parameter paths; later entries win"},
                          {"type", "object"},
                          {"properties",
                           {{"include", reference("include")},
                            {"correlated", {{"type", "array"}, {"items", reference("correlated")}}},
                            {"contact.model", one_or_any({{{"type", "string"}}, reference("spread")})}}},
                          {"patternProperties", {{"\\.axis$", reference("axis")}}},
                          {"additionalProperties", any}};
  }

  void add_policies() {
    defs_["tracker"] = choice("tracker", Description("how the joints get there: one tracker"), named_["tracker"]);
    defs_["tracker"]["maxProperties"] = 1;
    Json policy = choice("policy", Description("one policy, and the tracker that follows it"), named_["policy"]);
    policy["properties"]["control"] = reference("tracker");
    policy["properties"]["over"] = {
        {"description", "One policy for each value of a setting (several settings: for each combination)"},
        {"type", "object"},
        {"additionalProperties", {{"type", "array"}, {"minItems", 1}}}};
    defs_["policy"] = policy;
    defs_["policies"] = by_name("Policies by name", reference("policy"), "policy");
    defs_["policies"]["minProperties"] = 1;
  }

  void add_task() {
    Json requirement = choice("witness", section_of("requirement"), named_["witness"]);
    requirement["minProperties"] = 1, requirement["maxProperties"] = 2;
    defs_["requirement"] = requirement;
    Json predicate = choice("witness", section_of("predicate"), named_["witness"]);
    predicate["minProperties"] = 1;
    defs_["predicate"] = predicate;
    defs_["requirements"] = by_name("Witnesses that must stay >= 0, by name", reference("requirement"), "requirement");
    defs_["measures"] = by_name("Witnesses that are watched in the same way and decide nothing, by name",
                                reference("requirement"), "measure");
    std::vector<std::string> taken = named_["witness"];
    for (const std::string& key : section_of("predicate").names()) taken.push_back(key);
    const Json named = {{"type", "object"},
                        {"minProperties", 1},
                        {"maxProperties", 1},
                        {"propertyNames", {{"not", {{"enum", taken}}}}},
                        {"additionalProperties", reference("predicate")}};
    defs_["objective"] = {{"description", "A predicate, or a map that gives it a name"},
                          {"anyOf", {reference("predicate"), named}}};
  }

  Json defs_ = Json::object();
  std::map<std::string, std::vector<std::string>> named_;  // components by kind
};

/// What fits into a line stands in one.
std::string text_of(const Json& json, std::size_t indent, std::size_t before) {
  constexpr std::size_t kColumns = 120;
  std::string line;
  const bool list = json.is_array();
  if (!json.is_structured() || json.empty()) return json.dump();
  for (const auto& [key, value] : json.items()) {
    line += (line.empty() ? "" : ", ") + (list ? "" : Json(key).dump() + ": ") + text_of(value, 0, kColumns * 100);
  }
  line = (list ? "[" : "{") + line + (list ? "]" : "}");
  if (before > kColumns * 10 || before + line.size() < kColumns) return line;
  std::string out(list ? "[" : "{");
  const std::string space(indent + 2, ' ');
  for (const auto& [key, value] : json.items()) {
    const std::string head = space + (list ? "" : Json(key).dump() + ": ");
    out += (out.size() > 1 ? ",\n" : "\n") + head + text_of(value, indent + 2, head.size() + 1);
  }
  return out + "\n" + std::string(indent, ' ') + (list ? "]" : "}");
}

}  // namespace

std::string scenario_schema() { return text_of(SchemaWriter().write(), 0, 0) + "\n"; }

}  // namespace graze
