#include "jobs/campaign/improvement.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

namespace graze {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeastSize = 1e-3;   // of alpha or radius: a smaller step is none
constexpr double kMostRadius = 0.5;   // of the way from bound to bound
constexpr double kBetter = 1e-6;      // share of the lack by which a step must improve it
constexpr double kFiner = 0.1;        // of the differences, where the first ones met a kink
constexpr double kUndone = 0.25;      // of an earlier change: less is no revert
constexpr double kTotalStays = 1e-5;  // of a fixed total: what people type has few digits
constexpr double kFlat = 1e-9;        // of a limit's scale over the whole way: the variable does not move it

Eigen::VectorXd vector_of(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::vector<double> list_of(const Eigen::VectorXd& values) { return {values.begin(), values.end()}; }

bool any_below_zero(const std::vector<double>& margins) {
  return std::any_of(margins.begin(), margins.end(), [](double x) { return x < 0; });
}

/// Margins of traces that are invalid are not known to their ends: no design is better for having more of them.
bool loses_no_more(const DesignMargins& after, const DesignMargins& before) {
  return after.made && after.lost.count <= before.lost.count;
}

/// Earlier steps whose change of a variable this one takes back.
std::vector<Revert> reverts_of(const std::vector<ImproveStep>& steps, const ImproveStep& now,
                               const std::vector<DesignVariable>& variables) {
  std::vector<Revert> out;
  for (std::size_t i = 0; i < now.before.size(); ++i) {
    const double least = kToldChange * (variables[i].upper - variables[i].lower);
    const double change = now.after[i] - now.before[i];
    for (std::size_t s = steps.size(); s-- > 0 && std::abs(change) >= least;) {
      const double earlier = steps[s].after[i] - steps[s].before[i];
      if (std::abs(earlier) < least) continue;
      const double share = -change / earlier;
      if (share >= kUndone) out.push_back({static_cast<int>(i), static_cast<int>(s), std::min(share, 1.0)});
      break;
    }
  }
  return out;
}

}  // namespace

std::pair<std::size_t, DesignValues> best_design(const ImproveState& state) {
  if (state.reached.empty()) return {state.level, state.design};
  return {state.reached.back().level, state.reached.back().design};
}

Improvement::Improvement(const DesignRobots& robots, ImproveOptions options, std::optional<ImproveState> begun)
    : robots_(robots), options_(std::move(options)) {
  if (begun) {
    state_ = std::move(*begun);
  } else {
    state_.design = robots.initial();
  }
}

TrialQuestion Improvement::question(double from, double to) const {
  return {options_.policy, state_.level, options_.particles, from, to, options_.threads};
}

Eigen::VectorXd Improvement::shares(const DesignValues& values) const {
  Eigen::VectorXd out(static_cast<Eigen::Index>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    const DesignVariable& one = robots_.block().variables[i];
    out[static_cast<Eigen::Index>(i)] = (values[i] - one.lower) / (one.upper - one.lower);
  }
  return out;
}

DesignValues Improvement::values(const Eigen::VectorXd& shares) const {
  DesignValues out;
  for (Eigen::Index i = 0; i < shares.size(); ++i) {
    const DesignVariable& one = robots_.block().variables[static_cast<std::size_t>(i)];
    const double value = std::clamp(one.lower + shares[i] * (one.upper - one.lower), one.lower, one.upper);
    out.push_back(one.choices.empty() ? value : std::round(value));
  }
  return out;
}

DesignMargins Improvement::here(double from, double to) const {
  return std::move(try_designs(robots_, {state_.design}, question(from, to)).front());
}

void Improvement::begin(const DesignMargins& first) {
  if (!first.made || (!first.problem.empty() && !(first.progress > 0))) {
    throw InputError(
        fmt::format("{}: the initial robot cannot even begin the task: {}", robots_.scenario().file, first.problem));
  }
  for (const double margin : first.margins) state_.scales.push_back(std::abs(margin) > 1e-9 ? std::abs(margin) : 1);
}

bool Improvement::stuck(const std::string& why) {
  state_.end = ImproveEnd::stuck;
  state_.why = why;
  return false;
}

bool Improvement::reach(const DesignMargins& now) {
  state_.reached.push_back({state_.level, state_.steps.size(), state_.design, now.so_far, now.success});
  if (++state_.level < robots_.levels()) return true;
  state_.level = robots_.levels() - 1;
  state_.end = ImproveEnd::reached_all;
  return false;
}

bool Improvement::advance() {
  const std::optional<Suggestion> next = suggest();
  return next ? try_steps(*next) : state_.end == ImproveEnd::none;
}

std::optional<Suggestion> Improvement::suggest() {
  if (state_.end != ImproveEnd::none) return std::nullopt;
  Suggestion out;
  out.to = std::numeric_limits<double>::infinity();
  out.now = here(out.from, out.to);
  state_.lost = out.now.lost;
  if (state_.scales.empty()) begin(out.now);
  const bool fails = any_below_zero(out.now.so_far);
  if (!out.now.made) {
    stuck(out.now.problem);
  } else if (!fails && !out.now.problem.empty()) {
    stuck("the trace is invalid though no limit is violated: " + out.now.problem);
  } else if (!fails) {
    reach(out.now);
  }
  if (!out.now.made || !fails) return std::nullopt;
  choose_window(out);
  out.slopes = slopes_of(out);
  check_moved(out.now, out.slopes);
  out.size = options_.damped ? state_.radius : options_.alpha;
  out.change = change_of(point(out), out.size);
  return out;
}

void Improvement::choose_window(Suggestion& out) const {
  const double window = robots_.block().window, end = robots_.scenario().timing.end;
  if (!options_.particles.empty() || !std::isfinite(window)) return;
  const bool whole = !(out.now.first_violation + window < end);
  if (whole && !robots_.block().recorded) return;
  out.from = whole ? end - window : out.now.first_violation;
  if (!whole) out.to = out.from + window;
  out.now = here(out.from, out.to);
}

/// Of the window's margins. Where its traces begin in a recorded state, the design's own does, too: what contacts and
/// solvers have forgotten there is then no difference.
LimitSlopes Improvement::slopes_of(const Suggestion& at) const {
  TrialQuestion asked = question(at.from, at.to);
  if (robots_.block().recorded && asked.particles.empty()) {
    asked.begin = recorded_beginning(robots_, state_.design, asked);
  }
  if (!asked.begin) return slopes_at(at.now, asked);
  return slopes_at(try_designs(robots_, {state_.design}, asked).front(), asked);
}

std::vector<Beside> Improvement::beside(const TrialQuestion& question, const std::vector<std::size_t>& variables,
                                        double part, const DesignMargins& now) const {
  std::vector<DesignValues> designs;
  for (const std::size_t i : variables) {
    if (!robots_.block().variables[i].choices.empty()) continue;  // it has no slope
    for (const double sign : {1.0, -1.0}) {
      designs.push_back(state_.design);
      designs.back()[i] += sign * part * robots_.block().variables[i].step;
    }
  }
  std::vector<DesignMargins> tried = try_beside(robots_, state_.design, designs, question);
  std::vector<Beside> out;
  std::size_t k = 0;  // of the variables with slopes
  for (const std::size_t i : variables) {
    const DesignVariable& one = robots_.block().variables[i];
    if (!one.choices.empty()) {
      out.push_back({1, now.margins, now.margins, false});
      continue;
    }
    const auto side = [&](std::size_t s) {
      const DesignMargins& margins = tried[2 * k + s];
      const double value = designs[2 * k + s][i];
      const bool inside = value >= one.lower && value <= one.upper;  // beyond its bounds it may be no robot at all
      return margins.made && inside ? margins.margins : std::vector<double>(now.margins.size(), kUnknown);
    };
    out.push_back({part * one.step / (one.upper - one.lower), side(0), side(1),
                   tried[2 * k].contacts != now.contacts || tried[2 * k + 1].contacts != now.contacts});
    ++k;
  }
  return out;
}

/// Where differences meet a kink, finer ones may lie on one side of it; or, where contacts make the margin rough, meet
/// more of them. The finer ones count if they meet fewer.
LimitSlopes Improvement::slopes_at(const DesignMargins& now, const TrialQuestion& question) const {
  std::vector<std::size_t> all(robots_.block().variables.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<Beside> around = beside(question, all, 1, now);
  const auto kinks = [&](const LimitSlopes& found) {
    std::vector<int> out(all.size());  // of violated limits, by variable
    for (const Kink& one : found.kinks) {
      if (now.margins[static_cast<std::size_t>(one.limit)] < 0) ++out[static_cast<std::size_t>(one.variable)];
    }
    return out;
  };
  const LimitSlopes coarse = slopes(now.margins, around, state_.scales);
  const std::vector<int> before = kinks(coarse);
  std::vector<std::size_t> again;
  std::copy_if(all.begin(), all.end(), std::back_inserter(again), [&](std::size_t i) { return before[i] > 0; });
  if (again.empty()) return coarse;
  const std::vector<Beside> finer = beside(question, again, kFiner, now);
  std::vector<Beside> with_finer = around;
  for (std::size_t k = 0; k < again.size(); ++k) with_finer[again[k]] = finer[k];
  const std::vector<int> after = kinks(slopes(now.margins, with_finer, state_.scales));
  for (const std::size_t i : again) {
    if (after[i] < before[i]) around[i] = with_finer[i];
  }
  return slopes(now.margins, around, state_.scales);
}

void Improvement::check_moved(const DesignMargins& now, const LimitSlopes& slopes) {
  const bool first = state_.steps.empty();
  const std::vector<std::string> names = limit_names(robots_.scenario());
  std::vector<std::string> variables, unmoved;
  for (const DesignVariable& one : robots_.block().variables) variables.push_back(one.name);
  const auto kinked = [&](std::size_t k) {
    return std::any_of(slopes.kinks.begin(), slopes.kinks.end(),
                       [&](const Kink& one) { return one.limit == static_cast<int>(k); });
  };
  for (std::size_t k = 0; k < names.size() && first; ++k) {
    if (!(now.margins[k] < 0) || kinked(k)) continue;
    if (slopes.J.row(static_cast<Eigen::Index>(k)).cwiseAbs().maxCoeff() <= kFlat * state_.scales[k]) {
      unmoved.push_back(names[k]);
    }
  }
  const auto choice = [](const DesignVariable& one) { return !one.choices.empty(); };
  const std::vector<DesignVariable>& own = robots_.block().variables;
  if (!unmoved.empty() && std::none_of(own.begin(), own.end(), choice)) {
    throw InputError(
        fmt::format("{}: design.variables: none of them ({}) moves the violated limit '{}'; add one that "
                    "does, or leave it out of design.limits",
                    robots_.scenario().file, fmt::join(variables, ", "), unmoved.front()));
  }
  if (!first) return;
  state_.idle.clear();
  for (Eigen::Index i = 0; i < slopes.J.cols(); ++i) {
    const bool moves = (slopes.J.col(i).array().abs() > kFlat * vector_of(state_.scales).array()).any();
    const bool has_kink = std::any_of(slopes.kinks.begin(), slopes.kinks.end(),
                                      [&](const Kink& one) { return one.variable == static_cast<int>(i); });
    if (!moves && !has_kink && !choice(own[static_cast<std::size_t>(i)])) state_.idle.push_back(static_cast<int>(i));
  }
}

DesignPoint Improvement::point(const Suggestion& at) const {
  DesignPoint out{shares(state_.design), vector_of(at.now.margins), vector_of(state_.scales), &at.slopes};
  for (const FixedTotal& total : robots_.block().fixed) {
    StepTotal& added = out.totals.emplace_back();
    for (std::size_t k = 0; k < total.variables.size(); ++k) {
      const DesignVariable& one = robots_.block().variables[static_cast<std::size_t>(total.variables[k])];
      added.variables.push_back(total.variables[k]);
      added.weights.push_back(total.weights[k] * (one.upper - one.lower));
    }
  }
  return out;
}

Eigen::VectorXd Improvement::change_of(const DesignPoint& at, double size) const {
  return options_.damped ? damped_step(at, size) : plain_step(at, size);
}

bool Improvement::try_steps(const Suggestion& from_here) {
  const DesignMargins& now = from_here.now;
  const DesignPoint at = point(from_here);
  const double lacking = lack(vector_of(now.so_far), at.scales);
  double size = from_here.size;
  std::string problem;
  std::vector<RefusedStep> refused;
  while (size >= kLeastSize) {
    const Eigen::VectorXd change = refused.empty() ? from_here.change : change_of(at, size);
    const double predicted = lack(at.margins + at.slopes->J * change, at.scales);
    if (change.cwiseAbs().maxCoeff() < 1e-9) break;
    const DesignValues next = values(at.x + change);
    const DesignMargins after = std::move(try_designs(robots_, {next}, question(from_here.from, from_here.to)).front());
    const bool whole = loses_no_more(after, now);
    const double left = whole ? lack(vector_of(after.so_far), at.scales) : lacking;
    if (!whole && !after.problem.empty()) problem = after.problem;
    if (left < lacking * (1 - kBetter)) {
      const double share = (lacking - left) / std::max(lacking - predicted, 1e-300);
      if (options_.damped)
        state_.radius = share > 0.75 ? std::min(2 * size, kMostRadius) : share < 0.25 ? size / 2 : size;
      note(from_here, after, next, size, std::move(refused));
      return true;
    }
    refused.push_back({size, whole ? after.progress : kUnknown, whole ? left : kUnknown});
    size /= 2;
  }
  if (try_choices(from_here, refused)) return true;
  state_.refused = std::move(refused);
  return stuck(problem.empty()
                   ? "no step along the slopes makes the violation smaller" + kinks_of(now, from_here.slopes)
                   : problem);
}

/// Where no step along the slopes helps: all combinations of the choices beside the present one, everything else as it
/// is. The one that lacks least is taken, of equal ones the first, if it lacks less than now.
bool Improvement::try_choices(const Suggestion& from_here, std::vector<RefusedStep>& refused) {
  const std::vector<DesignVariable>& all = robots_.block().variables;
  std::vector<DesignValues> designs = {state_.design};
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].choices.empty()) continue;
    const std::vector<DesignValues> before = std::exchange(designs, {});
    for (const DesignValues& one : before) {
      for (std::size_t c = 1; c <= all[i].choices.size(); ++c) {
        designs.push_back(one);
        designs.back()[i] = static_cast<double>(c);
      }
    }
  }
  std::erase(designs, state_.design);
  if (designs.empty()) return false;
  const std::vector<DesignMargins> tried = try_designs(robots_, designs, question(from_here.from, from_here.to));
  const Eigen::VectorXd scales = vector_of(state_.scales);
  double least = lack(vector_of(from_here.now.so_far), scales) * (1 - kBetter);
  std::size_t best = designs.size();
  for (std::size_t k = 0; k < designs.size(); ++k) {
    const double left = loses_no_more(tried[k], from_here.now) ? lack(vector_of(tried[k].so_far), scales) : kUnknown;
    if (left < least) least = left, best = k;
  }
  if (best == designs.size()) return false;
  note(from_here, tried[best], designs[best], from_here.size, std::move(refused));
  refused.clear();
  return true;
}

std::vector<double> Improvement::predict(const Suggestion& at, const Eigen::VectorXd& change) const {
  return list_of(vector_of(at.now.margins) + at.slopes.J * change);
}

bool Improvement::take(const Suggestion& at, const Eigen::VectorXd& change, std::string& why) {
  const DesignValues next = changed(change);
  why = broken_total(next);
  if (!why.empty()) return false;
  const DesignMargins after = std::move(try_designs(robots_, {next}, question(at.from, at.to)).front());
  if (!after.made) {
    why = after.problem;
    return false;
  }
  note(at, after, next, at.size, {});
  return true;
}

/// "front_thigh + front_shin would change from 0.212 to 0.2 m; …", of a fixed total; empty: none is changed.
std::string Improvement::broken_total(const DesignValues& next) const {
  for (const FixedTotal& total : robots_.block().fixed) {
    const double now = total_at(total, state_.design), then = total_at(total, next);
    double size = 0;
    for (std::size_t k = 0; k < total.variables.size(); ++k) {
      size += std::abs(total.weights[k] * next[static_cast<std::size_t>(total.variables[k])]);
    }
    if (std::abs(then - now) <= kTotalStays * size) continue;
    const DesignVariable& first = robots_.block().variables[static_cast<std::size_t>(total.variables.front())];
    return fmt::format(
        "design.fixed: the sum of {} over all that they stand for would change from {:.6g} to {:.6g}{}; 'set' another "
        "of them so that it stays, or 'reset'",
        total_name(total, robots_.block().variables), now / first.scale, then / first.scale,
        first.unit.empty() ? "" : " " + first.unit);
  }
  return "";
}

void Improvement::note_answers(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) state_.answers.push_back({line, state_.steps.size()});
}

void Improvement::go_alone() {
  if (state_.answers.empty() || state_.answers.back().text == kAuto || state_.end != ImproveEnd::none) return;
  state_.answers.push_back({kAuto, state_.steps.size()});
}

void Improvement::stop_going_alone() {
  std::vector<SessionAnswer>& all = state_.answers;
  if (all.empty() && !state_.steps.empty()) all.push_back({kAuto, 0});
  if (all.empty() || all.back().text != kAuto) return;
  const std::size_t made = state_.steps.size() - all.back().steps;
  if (made == 0) {
    all.pop_back();
  } else {
    all.back().text = fmt::format("{} {}", kAuto, made);
  }
}

void Improvement::roll_back(std::size_t count) {
  const std::size_t first = state_.steps.size() - count;
  const ImproveStep& undone = state_.steps.at(first);
  state_.design = undone.before, state_.lost = undone.lost_before;
  state_.level = undone.level;
  state_.end = ImproveEnd::none;
  state_.why.clear();
  state_.refused.clear();
  std::erase_if(state_.reached, [&](const ReachedLevel& one) { return one.steps > first; });
  state_.steps.resize(first);
}

DesignValues Improvement::changed(const Eigen::VectorXd& change) const {
  return values(shares(state_.design) + change);
}

double Improvement::share(std::size_t variable, double value) const {
  const DesignVariable& one = robots_.block().variables.at(variable);
  return (value - state_.design.at(variable)) / (one.upper - one.lower);
}

/// "; kinks, where there is no slope: 'motors' in shin (contacts change)", of limits that are violated.
std::string Improvement::kinks_of(const DesignMargins& now, const LimitSlopes& slopes) const {
  const std::vector<std::string> limits = limit_names(robots_.scenario());
  std::vector<std::string> parts;
  for (const Kink& one : slopes.kinks) {
    const auto limit = static_cast<std::size_t>(one.limit);
    if (!(now.margins[limit] < 0)) continue;
    parts.push_back(fmt::format("'{}' in {}{}", limits[limit],
                                robots_.block().variables[static_cast<std::size_t>(one.variable)].name,
                                one.contacts ? " (contacts change)" : ""));
  }
  return parts.empty() ? "" : fmt::format("; kinks, where there is no slope: {}", fmt::join(parts, ", "));
}

void Improvement::note(const Suggestion& at, const DesignMargins& after, const DesignValues& next, double size,
                       std::vector<RefusedStep> refused) {
  const Eigen::VectorXd scales = vector_of(state_.scales);
  ImproveStep step;
  step.level = state_.level;
  step.from = at.from, step.to = at.to, step.size = size;
  step.rolled_back = static_cast<int>(refused.size()), step.refused = std::move(refused);
  step.before = state_.design, step.after = next;
  step.lack_before = lack(vector_of(at.now.so_far), scales), step.lack_after = lack(vector_of(after.so_far), scales);
  step.predicted = predict(at, shares(next) - shares(state_.design));
  step.margins_before = at.now.margins, step.margins_after = after.margins;
  step.progress_before = at.now.progress, step.progress_after = after.progress;
  step.success_before = at.now.success, step.success_after = after.success;
  step.lost_before = at.now.lost, step.lost_after = after.lost;
  for (const Kink& one : at.slopes.kinks) step.kinks.push_back({one.limit, one.variable, one.contacts});
  step.reverts = reverts_of(state_.steps, step, robots_.block().variables);
  state_.design = step.after, state_.lost = step.lost_after;
  state_.steps.push_back(std::move(step));
}

}  // namespace graze
