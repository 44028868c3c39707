#include "scenarios/policies.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>

#include "engine/control/policy.h"
#include "engine/library/library_use.h"
#include "engine/settings/warnings.h"
#include "scenarios/limits.h"

namespace graze {
namespace {

bool name_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("_-+.").find(c) != std::string_view::npos;
}

/// What stands for a value in a policy's name: "1 cm" -> "1cm".
std::string label(const Settings& value, std::size_t index) {
  if (!value.is_scalar()) return std::to_string(index + 1);
  std::string out;
  for (const char c : value.text()) {
    if (c != ' ') out += name_character(c) || c == '%' ? c : '_';
  }
  // A name is a path in the archive, where "." and ".." have a meaning of their own.
  return out.empty() || out == "." || out == ".." ? std::to_string(index + 1) : out;
}

void check_name(const Settings& place, std::size_t size) {
  if (size > kMaxPolicyName) place.fail(fmt::format("a policy's name of {} bytes; at most {}", size, kMaxPolicyName));
}

/// Refuses a path of `over` that leads past the one policy, or the one tracker, that stands there: it would put a
/// second one beside it.
void check_way(const Settings& policy, const std::string& path, const Settings& values) {
  const std::string first = path.substr(0, path.find('.'));
  const bool of_control = first == "control";
  if (!policy.is_map() || (of_control && (first == path || !policy.has(first) || !policy.at(first).is_map()))) return;
  const Settings map = of_control ? policy.at(first) : policy;
  const std::string rest = of_control ? path.substr(first.size() + 1) : path;
  const std::string wanted = rest.substr(0, rest.find('.'));
  std::vector<std::pair<std::string, Settings>> there;
  for (const auto& entry : map.entries()) {
    if (of_control || entry.first != "control") there.push_back(entry);
  }
  if (there.size() != 1 || there[0].first == wanted) return;
  const std::vector<std::string> names = of_control ? tracker_names() : policy_names();
  const auto known = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const std::string& stands = there[0].first;
  // Any other key of a policy is an unknown one, which is refused with its nearest.
  if (!of_control && !known(wanted) && nearest(wanted, {stands}).empty()) return;
  const std::string hint =
      known(wanted) == known(stands)
          ? ""
          : fmt::format("; a {} is called {}", of_control ? "tracker" : "policy", known(wanted) ? wanted : stands);
  values.fail_key(
      fmt::format("does not lead to what stands there, {} (at {}){}", stands, there[0].second.key_place(), hint));
}

/// A path of `over` into the settings of a controller from outside that names none of those that stand there.
void doubt_setting(const Settings& policy, const std::string& path, const Settings& values) {
  if (!is_from_outside(policy)) return;
  const std::string doubt = doubted_setting(policy, path);
  if (!doubt.empty()) warn(values, doubt);
}

std::vector<PolicySpec> expanded(const std::vector<PolicySpec>& policies, const std::string& path,
                                 const Settings& values) {
  const std::vector<Settings> items = values.items();
  if (!values.is_list() || items.empty()) values.fail("must be a list of values, one policy for each");
  if (policies.size() * items.size() > kMaxPolicies) values.fail(fmt::format("more than {} policies", kMaxPolicies));
  std::vector<PolicySpec> out;
  for (const PolicySpec& policy : policies) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (i == 0) {
        check_way(policy.settings, path, values);
        doubt_setting(policy.settings, path, values);
      }
      check_name(items[i], policy.name.size() + 1 + label(items[i], i).size());
      out.push_back({fmt::format("{}/{}", policy.name, label(items[i], i)), policy.settings.with(path, items[i]), 0});
    }
  }
  return out;
}

}  // namespace

std::string doubted_setting(const Settings& root, const std::string& path) {
  constexpr std::string_view kIn = ".settings.";
  const std::size_t in = path.find(kIn);
  if (in == std::string::npos) return "";
  std::optional<Settings> at = root;
  const std::string way = path.substr(0, in + kIn.size() - 1);
  for (std::size_t begin = 0; at && begin < way.size();) {
    const std::size_t end = std::min(way.find('.', begin), way.size());
    at = at->is_map() ? at->find(way.substr(begin, end - begin)) : std::nullopt;
    begin = end + 1;
  }
  if (!at || !at->is_map()) return "";
  std::string wanted = path.substr(in + kIn.size());
  wanted = wanted.substr(0, wanted.find('.'));
  std::vector<std::string> names;
  for (const auto& [name, value] : at->entries()) names.push_back(name);
  if (names.empty() || at->has(wanted)) return "";
  const std::string near = nearest(wanted, names);
  return fmt::format("{} is none of the settings that stand there ({}, at {}){}; the controller gets it beside them",
                     clipped(wanted, 80), fmt::join(names, ", "), at->key_place(),
                     near.empty() ? "" : fmt::format("; did you mean {}?", near));
}

std::vector<PolicySpec> read_policies(const Settings& policies) {
  std::vector<PolicySpec> out;
  std::set<std::string> names;
  for (const auto& [name, value] : policies.entries()) {
    if (name.empty() || !std::all_of(name.begin(), name.end(), name_character)) {
      const std::string first = name.substr(0, name.find('/'));
      const bool made = first != name && policies.has(first);
      value.fail_key("a policy's name is made of letters, digits and _ - + ." +
                     (made ? fmt::format("; {} is one that 'over' of {} makes, and its settings are policies.{}", name,
                                         first, first)
                           : ""));
    }
    if (name == "." || name == "..") value.fail_key("a policy's name must have a letter or a digit");
    check_name(value, name.size());
    std::vector<PolicySpec> one = {{name, value.without("over"), 0}};
    if (const auto over = value.find("over")) {
      check_count(*over, over->entries().size(), kMaxOver, "paths");
      for (const auto& [path, values] : over->entries()) one = expanded(one, path, values);
    }
    for (PolicySpec& policy : one) {
      if (!names.insert(policy.name).second) {
        value.fail_key(fmt::format("two policies would be named {}; the values of 'over' must differ", policy.name));
      }
      out.push_back(std::move(policy));
    }
    if (out.size() > kMaxPolicies) value.fail_key(fmt::format("more than {} policies", kMaxPolicies));
  }
  if (out.empty()) policies.fail("names no policy");
  return out;
}

void refuse_hidden(const Settings& policies, const std::vector<Override>& overrides) {
  for (const auto& [name, policy] : policies.entries()) {
    const auto over = policy.is_map() ? policy.find("over") : std::nullopt;
    if (!over || !over->is_map()) continue;
    for (const auto& [path, values] : over->entries()) {
      const std::string full = fmt::format("policies.{}.{}", name, path);
      for (const Override& one : overrides) {
        if (one.path != full && !one.path.starts_with(full + ".")) continue;
        throw InputError(
            fmt::format("--set {0}={1}: 'over' ({2}) gives each of the policies {3}/… a value of its own there; with "
                        "--set policies.{3}.over=~ there is one policy, {3}, and this is its value",
                        one.path, one.value, values.key_place(), name));
      }
    }
  }
}

}  // namespace graze
