#include "scenarios/uncertain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "engine/model/parameters.h"
#include "engine/settings/glob_alternatives.h"
#include "engine/settings/limits.h"
#include "engine/settings/warnings.h"
#include "scenarios/doubts.h"
#include "scenarios/keys.h"
#include "scenarios/limits.h"

namespace graze {
namespace {

constexpr std::string_view kAxis = ".axis";

bool ends_with(const std::string& text, std::string_view tail) {
  return text.size() >= tail.size() && text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

class UncertainReader {
 public:
  UncertainReader(const ParameterTable& table, double control_step, const Vec3& extent,
                  const std::map<std::string, std::string>& followed)
      : table_(table),
        control_step_(control_step),
        extent_(extent),
        followed_(followed),
        spreads_(table.all().size()),
        written_(spreads_.size()) {}

  void add_in_world(const InlineSpread& spread) {
    const std::vector<int> found = table_.match(spread.path);
    if (found.empty()) spread.settings.fail(spread.path + " cannot be uncertain here; write a number");
    for (const int i : found) {
      check_bounds(spread.settings, table_.all()[i], spread.spread.persistent);
      set(i, spread.settings, spread.spread);
    }
  }

  void add(const std::string& pattern, const Settings& value) {
    if (ends_with(pattern, kAxis)) {
      add_axis(pattern, value);
      return;
    }
    const std::vector<int> found = parameters(pattern, value);
    for (const int i : found) {
      set(i, value, spread_of(value, table_.all()[i], found));
      doubt_width(value, table_.all()[i], extent_, distance(table_.all()[i]));
      if (i == found.front()) check_kept(value, found.size(), spreads_[i]->persistent.kept_numbers());
    }
  }

  /// `found`: all that the glob matches, which may be of several quantities, as of joints that turn and that slide.
  /// What fits one of another quantity and not this one is refused with the parameter.
  Spread spread_of(const Settings& value, const Parameter& parameter, const std::vector<int>& found) const {
    try {
      return read_spread(value, parameter);
    } catch (const InputError& e) {
      const auto fits_other = [&](int i) {
        return table_.all()[i].quantity != parameter.quantity && can_have(value, table_.all()[i]);
      };
      if (std::none_of(found.begin(), found.end(), fits_other)) throw;
      throw InputError(fmt::format("{} ({} is in {})", e.what(), parameter.path, unit_of(parameter.quantity)));
    }
  }

  static bool can_have(const Settings& value, const Parameter& parameter) {
    try {
      read_spread(value, parameter);
      return true;
    } catch (const InputError&) {
      return false;
    }
  }

  /// Throws InputError for what no particle can have together.
  ParameterSpace space() {
    refuse_mass_and_density();
    ParameterSpace out;
    index_.assign(spreads_.size(), -1);
    for (std::size_t i = 0; i < spreads_.size(); ++i) {
      if (!spreads_[i]) continue;
      index_[i] = out.size();
      out.parameters.push_back(parameter(table_.all()[i], *spreads_[i]));
    }
    return out;
  }

  /// `{parameters: [globs], correlation: rho or matrix}`; members must be uncertain. After space().
  CorrelationGroup group(const Settings& settings, const ParameterSpace& space) const {
    settings.allow(keys_of("correlated"));
    CorrelationGroup out;
    for (const Settings& glob : settings.at("parameters").items()) {
      const std::string pattern = glob.glob();
      const bool of_many = pattern.find_first_of("*?{") != std::string::npos;
      const std::size_t before = out.members.size();
      for (const int i : parameters(pattern, glob)) {
        const int member = index_[i];
        if (member < 0 || space.parameters[member].persistent.is_constant()) {
          if (of_many) continue;  // a glob means those that are uncertain
          glob.fail(fmt::format("{} has no spread, so it cannot be correlated", table_.all()[i].path));
        }
        out.members.push_back(member);
        if (out.members.size() > kMaxGroup) {
          settings.fail(fmt::format("more than {0} parameters in one group; at most {0}", kMaxGroup));
        }
      }
      if (out.members.size() == before) {
        glob.fail(fmt::format("{}: none of the parameters that match has a spread, so there is nothing to correlate",
                              pattern));
      }
    }
    if (out.members.size() == 1) {
      warn(settings.at("parameters"), "one parameter alone has nothing to be correlated with; this does nothing");
    }
    out.correlation = matrix(settings.at("correlation"), static_cast<int>(out.members.size()));
    return out;
  }

 private:
  /// A parameter keeps its own copy of the numbers of a distribution.
  void check_kept(const Settings& value, std::size_t parameters, std::size_t numbers) {
    kept_ += parameters * numbers;
    if (kept_ <= kMaxKeptNumbers) return;
    value.fail(fmt::format("{} numbers for each of {} parameters: with them, distributions keep {} numbers; at most {}",
                           numbers, parameters, kept_, kMaxKeptNumbers));
  }

  void set(int parameter, const Settings& settings, const Spread& spread) {
    spreads_[parameter] = spread;
    written_[parameter] = settings;
  }

  void refuse_mass_and_density() const {
    std::vector<std::string> paths;
    std::vector<int> indices;
    for (std::size_t i = 0; i < spreads_.size(); ++i) {
      if (!spreads_[i]) continue;
      paths.push_back(table_.all()[i].path);
      indices.push_back(static_cast<int>(i));
    }
    const auto both = mass_and_density(paths);
    if (!both) return;
    const auto& [mass, density] = *both;
    written_[indices[mass]]->fail_key(mass_and_density_text(paths[mass], paths[density]));
  }

  /// Of an object from the origin, m, for a parameter of its place; else 0.
  double distance(const Parameter& parameter) const {
    constexpr std::string_view kPlace = ".position.";
    const std::size_t at = parameter.path.rfind(kPlace);
    if (at == std::string::npos || !parameter.path.starts_with("environment.")) return 0;
    double squares = 0;
    for (const char* axis : {"x", "y", "z"}) {
      const Parameter* one = table_.find(parameter.path.substr(0, at + kPlace.size()) + axis);
      if (one) squares += one->nominal * one->nominal;
    }
    return std::sqrt(squares);
  }

  std::vector<int> parameters(const std::string& pattern, const Settings& value) const {
    if (const std::string problem = glob_problem(pattern); !problem.empty()) value.fail_key(problem);
    if (pattern.find_first_of("*?{") != std::string::npos) {
      comparisons_ +=
          (1 + static_cast<std::size_t>(std::count(pattern.begin(), pattern.end(), ','))) * table_.all().size();
    }
    if (comparisons_ > kMaxComparisons) {
      value.fail_key(
          fmt::format("the globs so far take more than {} comparisons with {} parameters; name fewer, or name "
                      "parameters in full",
                      kMaxComparisons, table_.all().size()));
    }
    std::vector<int> found = table_.match(pattern);
    if (!found.empty()) {
      refuse_idle(pattern, value);
      return found;
    }
    if (is_about_joints(pattern)) {
      warn(value, fmt::format("{}: the robot has no joint that moves, so this says nothing", pattern));
      return {};
    }
    refuse_nested(pattern, value);
    const std::string near =
        nearest(pattern, {"correlated"}).empty() ? table_.suggest(pattern) : std::string("correlated");
    if (const std::string why = follower(pattern); !why.empty()) value.fail_key(why);
    value.fail_key(fmt::format("{}: matches no parameter{}", pattern,
                               near.empty() ? other_thing(pattern) : fmt::format("; did you mean '{}'?", near)));
  }

  /// A misspelt name among others in braces. Those about joints are let pass where the robot has none of the kind.
  void refuse_idle(const std::string& pattern, const Settings& value) const {
    if (pattern.find('{') == std::string::npos) return;
    std::vector<std::string> names;
    for (const Parameter& one : table_.all()) names.push_back(one.path);
    const std::string idle = idle_alternative_problem(pattern, names, "parameter");
    if (!idle.empty()) value.fail_key(idle);
  }

  /// Whether a glob is right, but for the robot's having nothing of what it is about: scenarios for any robot have
  /// such.
  bool is_about_joints(const std::string& pattern) const {
    const std::string before = pattern.substr(0, pattern.find('*'));
    if (before.size() == pattern.size() || !before.ends_with('.')) return false;
    const auto begins = [&](const Parameter& one) { return one.path.starts_with(before); };
    if (std::any_of(table_.all().begin(), table_.all().end(), begins)) return false;
    World jointed;
    jointed.robot.links.resize(2);
    jointed.robot.links[0].name = "parent";
    jointed.robot.links[1].name = "child";
    Joint joint;
    joint.name = "joint";
    joint.type = JointType::revolute;
    joint.parent = "parent";
    joint.child = "child";
    jointed.robot.joints = {joint};
    return !ParameterTable(jointed).match(pattern).empty();
  }

  /// "robot.joint.jb.zero: 'jb' follows 'ja' …", of what a joint with <mimic> does not have; else empty.
  std::string follower(const std::string& pattern) const {
    for (const auto& [joint, other] : followed_) {
      const std::size_t at = pattern.find("." + joint + ".");
      if (at == std::string::npos) continue;
      const std::string others = pattern.substr(0, at + 1) + other + pattern.substr(at + 1 + joint.size());
      return fmt::format("{}: '{}' follows '{}' (<mimic> of the URDF) and has no drive, encoder or place of its own{}",
                         pattern, joint, other,
                         table_.match(others).empty() ? "" : fmt::format("; there is '{}'", others));
    }
    return "";
  }

  /// "; there is 'robot.joint.hip.zero'": the same of another joint, link or object, if it is the thing that is not
  /// there.
  std::string other_thing(const std::string& pattern) const {
    const std::size_t first = pattern.find('.'),
                      begin = pattern.find('.', first == std::string::npos ? first : first + 1);
    const std::size_t end = begin == std::string::npos ? begin : pattern.find('.', begin + 1);
    if (end == std::string::npos || pattern.find_first_of("*?{") != std::string::npos) return "";
    const std::string thing = pattern.substr(0, end + 1);
    const auto of_it = [&](const Parameter& one) { return one.path.starts_with(thing); };
    if (std::any_of(table_.all().begin(), table_.all().end(), of_it)) return "";
    const std::vector<int> others = table_.match(pattern.substr(0, begin + 1) + "*" + pattern.substr(end));
    if (others.empty()) return "";
    std::vector<std::string> paths;
    for (const int other : others) paths.push_back(table_.all()[other].path);
    const std::string near = nearest(pattern, paths);
    return fmt::format("; there is '{}'", near.empty() ? paths.front() : near);
  }

  /// `robot: {link: {foot: {mass: …}}}`: a name in parts, down the maps to the first distribution.
  void refuse_nested(const std::string& pattern, const Settings& value) const {
    const auto begins = [&](const Parameter& one) { return one.path.starts_with(pattern + "."); };
    if (!value.is_map() || std::none_of(table_.all().begin(), table_.all().end(), begins)) return;
    std::string path = pattern;
    for (Settings at = value; at.is_map() && !at.entries().empty() && table_.match(path).empty();) {
      const auto [key, inner] = at.entries().front();
      path += "." + key;
      at = inner;
    }
    const bool known = !table_.match(path).empty();
    const auto example = std::find_if(table_.all().begin(), table_.all().end(), begins);
    value.fail_key(fmt::format("{}: matches no parameter; names are whole paths with dots, as '{}: …'", pattern,
                               known ? path : example->path));
  }

  /// The two scalars of a conical error (Figure 15): tilt ~ N(0, std), heading uniform on the circle.
  void add_axis(const std::string& pattern, const Settings& value) {
    value.allow(keys_of("axis"));
    const double std = read_cone(value.at("cone"));
    doubt_cone(value.at("cone").at("std"));
    for (const int i : parameters(pattern + ".tilt", value)) set(i, value, {Distribution::normal(0, std), {}, {}, {}});
    for (const int i : parameters(pattern + ".heading", value)) {
      set(i, value, {Distribution::uniform(0, 2 * std::numbers::pi), {}, {}, {}});
    }
  }

  UncertainParameter parameter(const Parameter& from, const Spread& spread) const {
    UncertainParameter out;
    out.name = from.path;
    out.unit = unit_of(from.quantity);
    out.nominal = from.nominal;
    out.persistent = spread.persistent;
    out.jitter = spread.jitter;
    // Held for a control step, the sum over a time of noise has the same variance for every step.
    if (spread.noise_density) out.jitter = Distribution::normal(0, *spread.noise_density / std::sqrt(control_step_));
    out.labels = spread.labels;
    out.distribution_text = text_of(spread);
    return out;
  }

  static std::string text_of(const Spread& spread) {
    if (spread.labels.empty()) return spread.persistent.describe();
    if (spread.persistent.is_constant()) return spread.labels[static_cast<std::size_t>(spread.persistent.median())];
    std::string list;
    for (const std::string& label : spread.labels) list += (list.empty() ? "" : ", ") + label;
    return fmt::format("{} of [{}]", spread.persistent.describe(), list);
  }

  static Eigen::MatrixXd matrix(const Settings& settings, int n) {
    if (settings.is_scalar()) {
      const double rho = settings.within(-1, 1), least = n > 1 ? -1.0 / (n - 1) : -1;
      if (n > 1 && !(rho > least && rho < 1)) {
        settings.fail(
            fmt::format("{:g}: one coefficient for all pairs of {} parameters must lie between {:.3g} and 1, and "
                        "be neither; 0.99 lets them differ little",
                        rho, n, least));
      }
      Eigen::MatrixXd out = Eigen::MatrixXd::Constant(n, n, rho);
      out.diagonal().setOnes();
      return out;
    }
    const std::vector<Settings> rows = settings.items();
    if (static_cast<int>(rows.size()) != n) {
      settings.fail(
          fmt::format("{} rows for {} parameters; one number for all pairs, or a row for each", rows.size(), n));
    }
    Eigen::MatrixXd out(n, n);
    for (int i = 0; i < n; ++i) {
      const std::vector<double> row = rows[i].numbers(n);
      for (int j = 0; j < n; ++j) out(i, j) = row[j];
    }
    return out;
  }

  const ParameterTable& table_;
  double control_step_;                                 // s
  Vec3 extent_;                                         // of the robot, m
  const std::map<std::string, std::string>& followed_;  // joints with <mimic>, and what each follows
  std::vector<std::optional<Spread>> spreads_;          // per parameter of the table
  std::vector<std::optional<Settings>> written_;        // where each spread stands
  std::vector<int> index_;                              // per parameter of the table: in the space, or -1
  mutable std::size_t comparisons_ = 0;                 // of globs with parameters, so far
  std::size_t kept_ = 0;                                // numbers of distributions, so far
};

void add_groups(const Settings& correlated, const UncertainReader& reader, ParameterSpace& space) {
  std::size_t members = 0;
  for (const Settings& settings : correlated.items()) {
    CorrelationGroup group = reader.group(settings, space);
    members += group.members.size();
    check_count(correlated, members, kMaxCorrelated, "correlated parameters");
    space.groups.push_back(std::move(group));
    try {
      space.validate();
    } catch (const std::invalid_argument& e) {
      settings.at("correlation").fail(e.what());
    }
  }
}

}  // namespace

ParameterSpace read_uncertain(const Settings& scenario, const ParameterTable& table,
                              const std::vector<InlineSpread>& in_world, double control_step, const Vec3& extent,
                              const std::map<std::string, std::string>& followed) {
  UncertainReader reader(table, control_step, extent, followed);
  for (const InlineSpread& spread : in_world) reader.add_in_world(spread);
  const auto uncertain = scenario.find("uncertain");
  if (uncertain) {
    for (const auto& [pattern, value] : uncertain->entries()) {
      if (pattern != "correlated") reader.add(pattern, value);
    }
  }
  ParameterSpace space = reader.space();
  if (uncertain && uncertain->has("correlated")) add_groups(uncertain->at("correlated"), reader, space);
  return space;
}

}  // namespace graze
