#include "scenarios/design_block.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "engine/model/parameters.h"
#include "engine/settings/unit_quantity.h"
#include "engine/settings/warnings.h"
#include "scenarios/keys.h"
#include "scenarios/limits.h"
#include "scenarios/names.h"

namespace graze {
namespace {

constexpr std::size_t kMaxVariables = 200;
constexpr std::size_t kMaxLevels = 1000;
constexpr std::size_t kMaxCombinations = 64;  // of choices: each is simulated where no step helps
constexpr double kSameChoice = 1e-9;          // relative: the robot's own numbers are those of a choice
/// Of the way from bound to bound: small beside what a design step changes, large beside what solvers leave (1e-6).
constexpr double kDifference = 1e-3;
constexpr double kRounding = 1e-9;  // of the way from bound to bound
constexpr const char* kPolicies = "policies.";
constexpr const char* kObjective = "objective";

/// What of a robot a designer can order, and a URDF or the scenario can say.
bool is_design(const std::string& path) {
  static const std::vector<std::string> kDesigned = {
      "robot.link.*.{density,mass,length,radius,size.x,size.y,size.z,com.x,com.y,com.z}",
      "robot.joint.*.{origin.x,origin.y,origin.z,damping,friction,effort,velocity,gear,rotor_inertia}"};
  return std::any_of(kDesigned.begin(), kDesigned.end(), [&](const std::string& one) { return matches(one, path); });
}

/// What stands at a dotted path; keys may hold dots, so the longest that fits is followed.
std::optional<Settings> at_path(const Settings& from, const std::string& path) {
  if (path.empty()) return from;
  if (!from.is_map()) return std::nullopt;
  std::string best;
  for (const auto& [key, value] : from.entries()) {
    const bool fits = path == key || path.starts_with(key + ".");
    if (fits && key.size() > best.size()) best = key;
  }
  if (best.empty()) return std::nullopt;
  return at_path(from.at(best), path.size() == best.size() ? "" : path.substr(best.size() + 1));
}

/// A value in one line of YAML.
std::string in_one_line(const Settings& value) {
  const auto joined = [](const auto& parts) { return fmt::format("{}", fmt::join(parts, ", ")); };
  if (value.is_null()) return "~";
  if (value.is_scalar()) {
    const std::string text = value.text();
    if (text.find_first_of(",[]{}:#\"'") == std::string::npos) return text;
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
    return quoted + "'";
  }
  std::vector<std::string> parts;
  if (value.is_list()) {
    for (const Settings& item : value.items()) parts.push_back(in_one_line(item));
    return "[" + joined(parts) + "]";
  }
  for (const auto& [key, item] : value.entries()) parts.push_back(key + ": " + in_one_line(item));
  return "{" + joined(parts) + "}";
}

class DesignReader {
 public:
  DesignReader(const Settings& scenario, const ParameterTable& table, const Task& task, double end)
      : root_(scenario), table_(table), task_(task), end_(end) {}

  DesignBlock read(const Settings& design) {
    const Described own(design, section_of("design"));
    const auto entries = own.at("variables").entries();
    check_count(design, entries.size(), kMaxVariables, "design variables");
    for (const auto& [name, settings] : entries) {
      if (!settings.is_null()) read_variable(name, settings);
    }
    if (out_.variables.empty())
      own.at("variables").fail("names no variable; e.g. shin: {of: robot.link.*_SHIN.length, within: [5 cm, 15 cm]}");
    refuse_mass_and_density(own.at("variables"));
    check_combinations(own.at("variables"));
    if (const auto fixed = own.find("fixed")) out_.fixed = read_totals(*fixed, out_.variables);
    read_limits(own);
    if (const auto task = own.find("task")) read_levels(*task);
    if (const auto window = own.find_number("window")) out_.window = *window;
    out_.recorded = own.word("begin") == "recorded";
    if (out_.recorded && !own.has("window")) {
      own.at("begin").fail("recorded: the traces begin with the window, and there is none; e.g. window: 0.1 s");
    }
    if (out_.window > end_) out_.window = std::numeric_limits<double>::infinity();
    out_.quantile = own.number("quantile");
    return std::move(out_);
  }

 private:
  // ---- variables

  void read_variable(const std::string& name, const Settings& settings) {
    const Described own(settings, section_of("design_variable"));
    DesignVariable variable;
    variable.name = name;
    std::vector<std::size_t> ends;  // of the paths of each glob
    if (own.at("of").is_null() || own.at("of").items().empty()) {
      own.at("of").fail_key("names nothing; write a parameter, such as robot.link.*_SHIN.length");
    }
    for (const Settings& glob : own.at("of").items()) {
      add_paths(variable, glob, own.at("of"));
      ends.push_back(variable.paths.size());
    }
    if (own.has("choose")) {
      read_choices(variable, own, ends);
      out_.variables.push_back(std::move(variable));
      return;
    }
    std::vector<double> nominal;
    Quantity quantity = Quantity::dimensionless;
    if (variable.of_policy) {
      nominal = policy_values(variable, own, quantity);
    } else {
      nominal = parameter_values(variable, own, quantity);
    }
    set_shares(variable, nominal, own.at("of"));
    read_bounds(variable, own, quantity);
    out_.variables.push_back(std::move(variable));
  }

  void add_paths(DesignVariable& variable, const Settings& glob, const Settings& of) {
    const std::string pattern = glob.glob();
    const bool of_policy = pattern.starts_with(kPolicies);
    if (!variable.paths.empty() && of_policy != variable.of_policy) {
      of.fail("a number of the robot and a setting of a policy cannot be one variable; make it two");
    }
    variable.of_policy = of_policy;
    if (of_policy) return add_path(variable, pattern, glob);
    const std::vector<int> found = table_.match(pattern);
    if (found.empty()) {
      const std::string near = table_.suggest(pattern);
      glob.fail(fmt::format("{}: matches no parameter{}", pattern,
                            near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
    }
    for (const int i : found) add_path(variable, table_.all()[i].path, glob);
  }

  void add_path(DesignVariable& variable, const std::string& path, const Settings& place) {
    if (!variable.of_policy && !is_design(path)) {
      place.fail(
          fmt::format("{}: is no matter of design; of a link there are density, mass, length, radius, size and com, "
                      "of a joint origin, damping, friction, effort, velocity, gear and rotor_inertia, and "
                      "settings of policies",
                      path));
    }
    const auto [other, fresh] = owner_.emplace(path, variable.name);
    if (!fresh) {
      place.fail(other->second == variable.name
                     ? fmt::format("{}: is named twice", path)
                     : fmt::format("{}: is moved by '{}' already; symmetries that contradict each other: a number "
                                   "belongs to one variable",
                                   path, other->second));
    }
    variable.paths.push_back(path);
  }

  std::vector<double> parameter_values(DesignVariable& variable, const Described& own, Quantity& quantity) const {
    std::vector<double> out;
    const Parameter& first = *table_.find(variable.paths.front());
    quantity = first.quantity;
    variable.unit = unit_of(quantity);
    for (const std::string& path : variable.paths) {
      const Parameter& parameter = *table_.find(path);
      if (parameter.quantity != quantity) {
        own.at("of").fail(fmt::format("{} is in {} and {} in {}: they cannot move together", first.path,
                                      unit_of(quantity), path, unit_of(parameter.quantity)));
      }
      if (!std::isfinite(parameter.nominal) || std::abs(parameter.nominal) >= 1e9) {
        own.at("of").fail(fmt::format("{}: the robot has no such limit, so that there is nothing to change", path));
      }
      out.push_back(parameter.nominal);
    }
    return out;
  }

  /// "; no 'initail' in robot; nearest: initial": the first part of a path that is not there.
  std::string nearest_part(const std::string& path) const {
    std::size_t end = path.find('.');
    for (std::string known;; known = path.substr(0, end), end = path.find('.', end + 1)) {
      const std::string next = path.substr(0, end);
      if (at_path(root_, next)) {
        if (end == std::string::npos) return "";
        continue;
      }
      const std::string part = known.empty() ? next : next.substr(known.size() + 1);
      const auto above = known.empty() ? std::optional(root_) : at_path(root_, known);
      if (!above->is_map()) return fmt::format("; {} has no parts", known);
      std::vector<std::string> names;
      for (const auto& [key, value] : above->entries()) names.push_back(key);
      return fmt::format("; no '{}' in {}; {}", part, known.empty() ? "the scenario" : known,
                         nearest_or_all(part, names));
    }
  }

  // ---- choices

  void read_choices(DesignVariable& variable, const Described& own, const std::vector<std::size_t>& ends) const {
    const Settings place = own.at("choose");
    if (variable.of_policy) place.fail("is for numbers of the robot, and these are settings of a policy");
    if (const auto step = own.find("step")) step->fail_key("is for numbers that have slopes, and a choice has none");
    const std::vector<Settings> rows = place.is_list() ? place.items() : std::vector<Settings>();
    if (rows.size() < 2) {
      place.fail(
          "must be a list of two choices or more, each with a value for each of 'of'; e.g. [[1.1 N m, 60 g], "
          "[2.6 N m, 72 g]]");
    }
    for (const Settings& row : rows) {
      variable.choices.push_back(choice_values(variable, row, ends));
      variable.choice_words.push_back(choice_text(variable, variable.choices.back(), ends));
    }
    for (std::size_t c = 1; c < rows.size(); ++c) {
      const auto begin = variable.choices.begin(), own = begin + static_cast<std::ptrdiff_t>(c);
      if (std::find(begin, own, *own) != own) warn(rows[c], "is another choice once more, and is simulated, too");
    }
    variable.share.assign(variable.paths.size(), 1);
    variable.lower = 1, variable.upper = static_cast<double>(rows.size()), variable.step = 1;
    for (std::size_t c = 0; c < rows.size() && variable.nominal == 0; ++c) {
      if (is_own(variable, variable.choices[c])) variable.nominal = static_cast<double>(c + 1);
    }
    if (variable.nominal == 0) {
      std::vector<double> own;
      for (const std::string& path : variable.paths) own.push_back(table_.find(path)->nominal);
      place.fail(fmt::format("none of the choices is the robot's own, [{}], with which it begins; name it, too",
                             choice_text(variable, own, ends)));
    }
  }

  /// "2.6 N m, 13.1 rad/s": the first value of each glob.
  std::string choice_text(const DesignVariable& variable, const std::vector<double>& values,
                          const std::vector<std::size_t>& ends) const {
    std::vector<std::string> parts;
    for (std::size_t begin = 0, k = 0; k < ends.size(); begin = ends[k++]) {
      parts.push_back(fmt::format("{:g} {}", values[begin], unit_of(table_.find(variable.paths[begin])->quantity)));
    }
    return fmt::format("{}", fmt::join(parts, ", "));
  }

  std::vector<double> choice_values(const DesignVariable& variable, const Settings& row,
                                    const std::vector<std::size_t>& ends) const {
    const std::vector<Settings> values = row.is_list() ? row.items() : std::vector<Settings>{row};
    if (values.size() != ends.size()) {
      row.fail(fmt::format("has {} value{}; 'of' names {}, each of which needs one", values.size(),
                           values.size() == 1 ? "" : "s", ends.size()));
    }
    std::vector<double> out;
    for (std::size_t k = 0; k < ends.size(); ++k) {
      while (out.size() < ends[k]) {
        const Parameter& one = *table_.find(variable.paths[out.size()]);
        const double value = values[k].number(one.quantity);
        if (value < one.lower || (one.strict && value == one.lower) || value > one.upper) {
          values[k].fail(fmt::format("{} would be {:g}; it must be {} {:g} and <= {:g}", one.path, value,
                                     one.strict ? ">" : ">=", one.lower, one.upper));
        }
        out.push_back(value);
      }
    }
    return out;
  }

  bool is_own(const DesignVariable& variable, const std::vector<double>& choice) const {
    for (std::size_t i = 0; i < choice.size(); ++i) {
      const double own = table_.find(variable.paths[i])->nominal;
      if (std::abs(choice[i] - own) > kSameChoice * std::abs(own)) return false;
    }
    return true;
  }

  void check_combinations(const Settings& place) const {
    std::size_t all = 1;
    for (const DesignVariable& one : out_.variables) {
      if (!one.choices.empty()) all *= one.choices.size();
      if (all > kMaxCombinations) {
        place.fail(fmt::format("more than {} combinations of choices, all of which would be tried; name fewer",
                               kMaxCombinations));
      }
    }
  }

  /// Each setting is one number; what it measures is told by the units that are written, there or in the bounds.
  std::vector<double> policy_values(DesignVariable& variable, const Described& own, Quantity& quantity) const {
    std::vector<double> out;
    for (const std::string& path : variable.paths) {
      const auto value = at_path(root_, path);
      if (!value) own.at("of").fail(fmt::format("{}: the scenario has no such setting{}", path, nearest_part(path)));
      const std::string text = value->is_scalar() ? value->text() : "";
      const auto written = split_number(text);
      if (!written) own.at("of").fail(fmt::format("{}: is not a number ({})", path, in_one_line(*value)));
      if (out.empty()) {
        variable.unit = std::string(written->unit);
        quantity = variable.unit.empty() ? quantity_of_bounds(own)
                                         : quantity_of_unit(variable.unit).value_or(Quantity::dimensionless);
        variable.scale = to_si(quantity, 1, variable.unit).value_or(1);
      }
      out.push_back(value->number(quantity));
    }
    return out;
  }

  static Quantity quantity_of_bounds(const Described& own) {
    const auto within = own.find("within");
    if (!within || !within->is_list()) return Quantity::dimensionless;
    for (const Settings& item : within->items()) {
      const std::string text = item.is_scalar() ? item.text() : "";
      const auto written = split_number(text);
      if (written && !written->unit.empty() && is_unit(written->unit)) return *quantity_of_unit(written->unit);
    }
    return Quantity::dimensionless;
  }

  /// Equal numbers stay equal, others keep their ratio.
  static void set_shares(DesignVariable& variable, const std::vector<double>& nominal, const Settings& of) {
    variable.nominal = nominal.front();
    for (std::size_t i = 0; i < nominal.size(); ++i) {
      if (nominal[i] == nominal.front()) {
        variable.share.push_back(1);
      } else if (nominal.front() == 0) {
        of.fail(fmt::format("{} is 0 and {} is {:g}: numbers that move together keep their ratio, and these have none",
                            variable.paths.front(), variable.paths[i], nominal[i]));
      } else {
        variable.share.push_back(nominal[i] / nominal.front());
      }
    }
  }

  void read_bounds(DesignVariable& variable, const Described& own, Quantity quantity) const {
    const bool factor = own.has("factor");
    const Settings place = own.at(factor ? "factor" : "within");
    const std::vector<double> bounds = place.numbers(2, factor ? Quantity::dimensionless : quantity);
    const double by = factor ? variable.nominal : 1;
    variable.lower = std::min(bounds[0] * by, bounds[1] * by),
    variable.upper = std::max(bounds[0] * by, bounds[1] * by);
    if (bounds[0] >= bounds[1])
      place.fail(fmt::format("{:g} … {:g}: the first bound must be the smaller", bounds[0], bounds[1]));
    if (variable.lower == variable.upper)
      place.fail("the robot's own value is 0, of which factors make nothing; use 'within'");
    const double range = variable.upper - variable.lower;
    if (!std::isfinite(range)) place.fail("the way from bound to bound is no finite number");
    // A design at its bound comes back from its URDF up to rounding.
    if (variable.nominal < variable.lower - kRounding * range ||
        variable.nominal > variable.upper + kRounding * range) {
      fail_outside(variable, own, place);
    }
    variable.nominal = std::clamp(variable.nominal, variable.lower, variable.upper);
    check_possible(variable, place);
    variable.step = kDifference * range;
    const auto step = own.find("step");
    if (!step) return;
    variable.step = step->positive(quantity);
    if (variable.step > range / 4) {
      step->fail(fmt::format("{:g}: more than a quarter of the way from bound to bound, {:g}", variable.step, range));
    }
  }

  /// Numbers are told in the unit in which the variable is written.
  [[noreturn]] static void fail_outside(const DesignVariable& variable, const Described& own, const Settings& place) {
    const auto shown = [&](double x) { return x / variable.scale; };
    const std::string bounds = fmt::format("{:g} … {:g}", shown(variable.lower), shown(variable.upper));
    const std::string unit = variable.unit.empty() ? "" : " " + variable.unit;
    const double lower = variable.lower * variable.scale, upper = variable.upper * variable.scale;
    if (!own.has("factor") && variable.scale != 1 && lower <= variable.nominal && variable.nominal <= upper) {
      place.fail(fmt::format("{1:g}{0} lies outside of {2}{0}; did you mean [{3:g}{0}, {4:g}{0}]?", unit,
                             shown(variable.nominal), bounds, shown(lower), shown(upper)));
    }
    place.fail(fmt::format("{1}{2:g}{0} lies outside of {3}{0}; nearest right answer: [{4:g}{0}, {5:g}{0}]", unit,
                           variable.of_policy ? "the policy's own " : "the robot's own ", shown(variable.nominal),
                           bounds, shown(std::min(variable.lower, variable.nominal)),
                           shown(std::max(variable.upper, variable.nominal))));
  }

  /// No value within the bounds may be one that the parameter cannot have.
  void check_possible(const DesignVariable& variable, const Settings& place) const {
    if (variable.of_policy) return;
    for (std::size_t i = 0; i < variable.paths.size(); ++i) {
      const Parameter& one = *table_.find(variable.paths[i]);
      const double a = variable.lower * variable.share[i], b = variable.upper * variable.share[i];
      const double low = std::min(a, b), high = std::max(a, b);
      if (low > one.lower || (low == one.lower && !one.strict)) {
        if (high <= one.upper) continue;
        place.fail(fmt::format("{} would be {:g}; it must be <= {:g}", one.path, high, one.upper));
      }
      place.fail(
          fmt::format("{} would be {:g}; it must be {} {:g}", one.path, low, one.strict ? ">" : ">=", one.lower));
    }
  }

  void refuse_mass_and_density(const Settings& place) const {
    std::vector<std::string> paths;
    for (const auto& [path, variable] : owner_) paths.push_back(path);
    const auto both = mass_and_density(paths);
    if (!both) return;
    place.fail(fmt::format("{} ('{}') and {} ('{}'): only one of them can be designed; mass is density times volume",
                           paths[both->first], owner_.at(paths[both->first]), paths[both->second],
                           owner_.at(paths[both->second])));
  }

  // ---- limits and levels

  void read_limits(const Described& own) {
    const auto limits = own.find("limits");
    std::vector<std::string> names;
    for (std::size_t i = 0; i < task_.requirements.size(); ++i) {
      names.push_back(task_.requirements[i].name);
      if (!limits && !task_.requirements[i].measure) out_.limits.push_back(static_cast<int>(i));
    }
    const auto task = root_.find("task");
    out_.objective = !limits && task && task->has("objective");
    if (limits) {
      std::vector<char> chosen(names.size());
      for (const Settings& glob : limits->items()) choose_limits(glob, names, chosen);
      for (std::size_t i = 0; i < chosen.size(); ++i) {
        if (chosen[i]) out_.limits.push_back(static_cast<int>(i));
      }
    }
    if (!out_.limits.empty() || out_.objective) return;
    if (limits) limits->fail("names none; without 'limits' they are all requirements and the objective");
    own.settings().fail("the task has neither a requirement nor an objective, so there is no limit to keep");
  }

  void choose_limits(const Settings& glob, const std::vector<std::string>& names, std::vector<char>& chosen) {
    const std::string pattern = glob.glob();
    bool any = matches(pattern, kObjective);
    out_.objective = out_.objective || any;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!matches(pattern, names[i])) continue;
      chosen[i] = any = true;
    }
    if (any) return;
    std::vector<std::string> all = names;
    all.emplace_back(kObjective);
    glob.fail(fmt::format("{}: no requirement or measure of that name; {}", pattern, nearest_or_all(pattern, all)));
  }

  void read_levels(const Settings& task) {
    const Described own(task, section_of("design_task"));
    out_.task_path = own.at("path").text();
    if (out_.task_path.empty()) own.at("path").fail("names no setting; e.g. policies.trot.gait.velocity");
    const std::string top = out_.task_path.substr(0, out_.task_path.find('.'));
    for (const char* none : {"graze", "include", "name", "description", "design", "sampling", "record"}) {
      if (top != none) continue;
      own.at("path").fail(
          fmt::format("{}: '{}' makes no task harder; name a setting of the robot, the world, the policy "
                      "or the task, e.g. policies.trot.gait.velocity",
                      out_.task_path, top));
    }
    if (!at_path(root_, out_.task_path)) {
      own.at("path").fail(fmt::format("{}: the scenario has no such setting, whose value could make the task harder{}",
                                      out_.task_path, nearest_part(out_.task_path)));
    }
    for (const auto& [path, variable] : owner_) {
      const bool within = (path + ".").starts_with(out_.task_path + "."),
                 above = (out_.task_path + ".").starts_with(path + ".");
      if (!within && !above) continue;
      own.at("path").fail(
          fmt::format("{}: is what the variable '{}' changes ({}), so that the task would never become harder",
                      out_.task_path, variable, path));
    }
    const Settings values = own.at("values");
    if (!values.is_list() || values.items().empty()) values.fail("must be a list of values, the easiest first");
    check_count(values, values.items().size(), kMaxLevels, "values");
    for (const Settings& value : values.items()) {
      out_.task_values.push_back(in_one_line(value));
      out_.task_places.push_back(value.place());
    }
  }

  const Settings& root_;
  const ParameterTable& table_;
  const Task& task_;
  double end_;  // s, of a trace
  DesignBlock out_;
  std::map<std::string, std::string> owner_;  // variable by path
};

}  // namespace

double DesignVariable::at(std::size_t path, double value) const {
  if (choices.empty()) return share[path] * value;
  return choices[static_cast<std::size_t>(std::clamp(std::round(value), lower, upper)) - 1][path];
}

std::shared_ptr<const DesignBlock> read_design(const Settings& scenario, const ParameterTable& table, const Task& task,
                                               double end) {
  const auto design = scenario.find("design");
  if (!design || design->is_null()) return nullptr;
  return std::make_shared<const DesignBlock>(DesignReader(scenario, table, task, end).read(*design));
}

}  // namespace graze
