// A sweep for people and scripts: tables, JSON, CSV, a picture.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/json_of.h"
#include "analysis/number_words.h"
#include "analysis/plots_text.h"
#include "analysis/sweep.h"
#include "analysis/text_table.h"
#include "archive/files/csv.h"

namespace graze {
namespace {

constexpr double kCurveLow = -0.03, kCurveHigh = 1.03;  // of a picture's axis

using Row = std::vector<std::string>;

double rate_of(const SweepCount& count) {
  return count.valid() > 0 ? static_cast<double>(count.success) / static_cast<double>(count.valid())
                           : std::numeric_limits<double>::quiet_NaN();
}

const std::string& value_text(const Sweep& sweep, const SweepPoint& point, std::size_t axis) {
  return sweep.axes[axis].texts[point.at[axis]];
}

/// "contact.friction", or of two "contact.friction and time.end".
std::string paths_text(const Sweep& sweep) {
  std::string out;
  for (const SweepAxis& axis : sweep.axes) out += (out.empty() ? "" : " and ") + axis.path;
  return out;
}

std::string rates_table(const Sweep& sweep) {
  std::vector<Row> rows(1);
  for (const SweepAxis& axis : sweep.axes) rows[0].push_back(axis.path);
  const std::size_t left = sweep.axes.size() + 1;
  for (const char* head : {"policy", "N", "S", "K", "U", "invalid", "rate", "95 % interval", "campaign"}) {
    rows[0].emplace_back(head);
  }
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    for (std::size_t i = 0; i < sweep.points.size(); ++i) {
      const SweepCount count = sweep.count(i, policy);
      Row& row = rows.emplace_back();
      for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
        row.push_back(value_text(sweep, sweep.points[i], axis));
      }
      row.push_back(sweep.policies[policy]);
      for (const std::uint64_t n : {count.valid(), count.success, count.known, count.unknown, count.invalid}) {
        row.push_back(std::to_string(n));
      }
      row.push_back(count.valid() > 0 ? fmt::format("{:.4f}", rate_of(count)) : "-");
      row.push_back(interval_text(sweep.interval(count)));
      row.push_back(sweep.points[i].campaign);
    }
  }
  return text_table(rows, left);
}

/// "0.5 -> 0.6", with what the second axis is at.
std::string step_text(const Sweep& sweep, const SweepChange& change) {
  const SweepPoint &from = sweep.points[change.from], &to = sweep.points[change.to];
  std::string out = value_text(sweep, from, 0) + " -> " + value_text(sweep, to, 0);
  if (sweep.axes.size() > 1) out += " at " + value_text(sweep, to, 1);
  return out;
}

std::string changes_table(const Sweep& sweep) {
  const std::vector<SweepChange> changes = sweep_changes(sweep);
  if (changes.empty()) return "";
  std::vector<Row> rows = {{sweep.axes[0].path, "policy", "pairs", "mended", "broke", "change", "95 % interval", "p"}};
  for (const SweepChange& one : changes) {
    rows.push_back({step_text(sweep, one), sweep.policies[one.policy], std::to_string(one.pairs.n()),
                    std::to_string(one.pairs.only_b), std::to_string(one.pairs.only_a),
                    one.pairs.n() > 0 ? fmt::format("{:+.4f}", paired_difference(one.pairs)) : "-",
                    fmt::format("{:+.4f} .. {:+.4f}", one.interval.low, one.interval.high), p_text(one.corrected, 3)});
  }
  return "\nFrom value to value, on the same particles (p: McNemar, exact, corrected by Holm)\n" + text_table(rows, 2);
}

/// Seconds: two digits behind the point, "-" for what is not known.
std::string time_text(double seconds) { return std::isfinite(seconds) ? fmt::format("{:.2f}", seconds) : "-"; }

std::string times_table(const Sweep& sweep) {
  if (!sweep.has_violations() || sweep.adaptive) return "";  // looking again and again makes its intervals wrong
  std::vector<Row> rows(1);
  for (const SweepAxis& axis : sweep.axes) rows[0].push_back(axis.path);
  for (const char* head : {"policy", "N", "violated", "mean s", "95 % interval", "median s", "seen until s"}) {
    rows[0].emplace_back(head);
  }
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    for (std::size_t i = 0; i < sweep.points.size(); ++i) {
      const Survival one = sweep.survival(i, policy);
      Row& row = rows.emplace_back();
      for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
        row.push_back(value_text(sweep, sweep.points[i], axis));
      }
      const bool known = std::isfinite(one.mean_interval.low);
      for (const std::string& cell :
           {sweep.policies[policy], std::to_string(one.traces), std::to_string(one.failed), time_text(one.mean),
            known ? interval_text(one.mean_interval, 2) : "-", time_text(one.median), time_text(one.seen_until)}) {
        row.push_back(cell);
      }
    }
  }
  return "\nTime until a requirement was violated, or the trace ended (mean: Kaplan and Meier, of no more than was "
         "seen)\n" +
         text_table(rows, sweep.axes.size() + 1);
}

std::string particles_text(const Sweep& sweep) {
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max(), most = 0;
  for (const SweepPoint& point : sweep.points) {
    least = std::min(least, point.particles);
    most = std::max(most, point.particles);
  }
  return least == most ? fmt::format("{} particles, the same at every value", most)
                       : fmt::format("{} to {} particles, the first ones the same at every value", least, most);
}

std::string without_effect_text(const Sweep& sweep) {
  std::string out;
  for (const std::size_t axis : axes_without_effect(sweep)) {
    const std::string& path = sweep.axes[axis].path;
    out +=
        fmt::format("\n{} has no effect here: between its values no trace differs in any bit, nor an outcome.", path);
    if (!path.starts_with("uncertain.")) {
      out += fmt::format("\nWhere each particle draws its own, sweep what it draws from: --over uncertain.{}=…", path);
    }
    out += "\n";
  }
  return out;
}

nlohmann::ordered_json values_json(const Sweep& sweep, const SweepPoint& point) {
  nlohmann::ordered_json out;
  for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
    out[sweep.axes[axis].path] = value_text(sweep, point, axis);
  }
  return out;
}

nlohmann::ordered_json times_json(const Survival& one) {
  return {{"violated", one.failed},
          {"mean", json_of(one.mean)},
          {"interval", json_of(one.mean_interval)},
          {"median", json_of(one.median)},
          {"seen_until", json_of(one.seen_until)}};
}

nlohmann::ordered_json rates_json(const Sweep& sweep) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    for (std::size_t i = 0; i < sweep.points.size(); ++i) {
      const SweepCount count = sweep.count(i, policy);
      nlohmann::ordered_json numbers = nlohmann::ordered_json::array();
      for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
        numbers.push_back(sweep.axes[axis].values[sweep.points[i].at[axis]]);
      }
      out.push_back({{"values", values_json(sweep, sweep.points[i])},
                     {"numbers", std::move(numbers)},
                     {"policy", sweep.policies[policy]},
                     {"n", count.valid()},
                     {"success", count.success},
                     {"known_failure", count.known},
                     {"unknown_failure", count.unknown},
                     {"invalid", count.invalid},
                     {"rate", json_of(rate_of(count))},
                     {"interval", json_of(sweep.interval(count))},
                     {"time_to_violation", times_json(sweep.survival(i, policy))},
                     {"campaign", sweep.points[i].campaign}});
    }
  }
  return out;
}

nlohmann::ordered_json changes_json(const Sweep& sweep) {
  return json_list(sweep_changes(sweep), [&](const SweepChange& one) {
    return nlohmann::ordered_json{{"from", values_json(sweep, sweep.points[one.from])},
                                  {"to", values_json(sweep, sweep.points[one.to])},
                                  {"policy", sweep.policies[one.policy]},
                                  {"pairs", one.pairs.n()},
                                  {"mended", one.pairs.only_b},
                                  {"broke", one.pairs.only_a},
                                  {"change", json_of(paired_difference(one.pairs))},
                                  {"interval", json_of(one.interval)},
                                  {"p_value", json_of(one.p_value)},
                                  {"p_corrected", json_of(one.corrected)}};
  });
}

/// What a picture shows over the values.
enum class Shown { success, times };

/// Success or times of a policy along the first axis, where the second is at `second`.
PlotSeries curve(const Sweep& sweep, std::size_t policy, std::size_t second, Shown shown) {
  PlotSeries out;
  const std::size_t values = sweep.axes[0].texts.size();
  for (std::size_t i = 0; i < values; ++i) {
    const SweepCount count = sweep.count(second * values + i, policy);
    if (count.valid() == 0) continue;
    double y = rate_of(count);
    Interval interval = sweep.interval(count);
    if (shown == Shown::times) {
      const Survival survival = sweep.survival(second * values + i, policy);
      y = survival.mean;
      const bool known = std::isfinite(survival.mean_interval.low);
      interval = known ? survival.mean_interval : Interval{y, y};
    }
    out.x.push_back(sweep.axes[0].values[i]);
    out.y.push_back(y);
    out.low.push_back(interval.low);
    out.high.push_back(interval.high);
  }
  return out;
}

constexpr std::size_t kMostBands = 2;  // of a panel: more hide each other

/// How far curves stand beside each other, so that none hides another's bars: a little of the axis, and less than a
/// third of the way to the next value for all together.
double beside(const SweepAxis& axis, std::size_t curves) {
  std::vector<double> values = axis.values;
  std::sort(values.begin(), values.end());
  double gap = values.back() - values.front();
  for (std::size_t i = 1; i < values.size(); ++i) gap = std::min(gap, values[i] - values[i - 1]);
  const double all = std::min(0.06 * (values.back() - values.front()), gap / 3);
  return std::min(0.008 * (values.back() - values.front()), all / static_cast<double>(curves));
}

/// The i-th of so many curves; bands are drawn as long as they can be told apart. Behind the eighth colours come again,
/// with dashes and other marks.
void add_curve(PlotSeries line, std::size_t i, std::size_t curves, const SweepAxis& axis, PlotPanel& panel) {
  constexpr std::size_t kMarks = 5;
  const double middle = 0.5 * static_cast<double>(curves - 1);
  for (double& x : line.x) x += (static_cast<double>(i) - middle) * beside(axis, curves);
  line.color = policy_color(i);
  line.dashed = i >= kPolicyColors;
  line.mark = static_cast<PlotMark>(i / kPolicyColors % kMarks);
  line.width = 2;
  PlotSeries marks = line;
  marks.kind = PlotSeries::Kind::tall;
  marks.dashed = false;
  marks.width = 7;
  if (curves > kMostBands) line.low.clear(), line.high.clear();
  if (axis.numeric) panel.series.push_back(std::move(line));
  panel.series.push_back(std::move(marks));
}

/// "azimuth" of "uncertain.disturbances.shove.azimuth".
std::string last_key(const SweepAxis& axis) { return axis.path.substr(axis.path.rfind('.') + 1); }

/// The latest time at which a trace was seen, s.
double longest(const Sweep& sweep) {
  double out = 0;
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    for (std::size_t i = 0; i < sweep.points.size(); ++i) out = std::max(out, sweep.survival(i, policy).seen_until);
  }
  return out;
}

PlotPanel empty_panel(const Sweep& sweep, Shown shown) {
  constexpr std::size_t kMostLabels = 10;
  const SweepAxis& axis = sweep.axes[0];
  PlotPanel out;
  out.x.title = plot_titled(axis.path, axis.unit);
  out.y = {"Success rate", kCurveLow, kCurveHigh};
  if (shown == Shown::times) {
    const double most = longest(sweep);
    out.y = {plot_titled("Mean time to a violation, of the trace's", "s"), kCurveLow * most, kCurveHigh * most};
  }
  if (axis.texts.size() > kMostLabels && axis.numeric) return out;
  for (std::size_t i = 0; i < axis.values.size(); ++i) {
    out.x.labels.emplace_back(axis.values[i], axis.numeric ? plot_number(axis.values[i]) : axis.texts[i]);
  }
  out.x.grid = false;
  return out;
}

}  // namespace

std::string format_sweep(const Sweep& sweep) {
  std::string out = fmt::format("{}: success against {}, {}{}\n\n", sweep.scenario, paths_text(sweep),
                                particles_text(sweep), sweep.complete ? "" : "; not complete");
  out += rates_table(sweep);
  if (sweep.adaptive) {
    out += fmt::format(
        "\nIntervals: 95 % confidence sequence at each value, which allows for having looked after every turn. More "
        "particles went\nwhere it was wider than {:g} and held {:g}, or allowed a change of more than {:g} from a "
        "neighbour.\n",
        sweep.rule.width, sweep.rule.level, kSteepWidths * sweep.rule.width);
  }
  return out + without_effect_text(sweep) + times_table(sweep) + changes_table(sweep);
}

std::string sweep_json(const Sweep& sweep) {
  nlohmann::ordered_json out = {{"scenario", sweep.scenario}, {"complete", sweep.complete}};
  out["axes"] = json_list(sweep.axes, [](const SweepAxis& axis) {
    return nlohmann::ordered_json{{"path", axis.path},
                                  {"unit", axis.unit},
                                  {"numeric", axis.numeric},
                                  {"texts", axis.texts},
                                  {"values", axis.values}};
  });
  for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) out["axes"][axis]["has_effect"] = true;
  for (const std::size_t axis : axes_without_effect(sweep)) out["axes"][axis]["has_effect"] = false;
  out["policies"] = sweep.policies;
  out["interval"] = sweep.adaptive ? "95 % confidence sequence" : "95 % Clopper-Pearson";
  out["adaptive"] = nullptr;
  if (sweep.adaptive) out["adaptive"] = {{"width", sweep.rule.width}, {"level", sweep.rule.level}};
  out["rates"] = rates_json(sweep);
  out["changes"] = changes_json(sweep);
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string sweep_csv(const Sweep& sweep) {
  std::string out;
  for (const SweepAxis& axis : sweep.axes) out += csv_cell(plot_titled(axis.path, axis.unit)) + ",";
  out += "policy,n,success,known_failure,unknown_failure,invalid,rate,low,high,campaign\n";
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    for (std::size_t i = 0; i < sweep.points.size(); ++i) {
      const SweepPoint& point = sweep.points[i];
      const SweepCount count = sweep.count(i, policy);
      const Interval interval = sweep.interval(count);
      for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
        const SweepAxis& own = sweep.axes[axis];
        out += (own.numeric ? csv_number(own.values[point.at[axis]]) : csv_cell(own.texts[point.at[axis]])) + ",";
      }
      out += fmt::format("{},{},{},{},{},{},{},{},{},{}\n", csv_cell(sweep.policies[policy]), count.valid(),
                         count.success, count.known, count.unknown, count.invalid, csv_number(rate_of(count)),
                         csv_number(interval.low), csv_number(interval.high), point.campaign);
    }
  }
  return out;
}

namespace {

/// "Success against contact.friction", with the last keys alone where the paths are long.
std::string figure_title(const Sweep& sweep, bool times) {
  constexpr std::size_t kLongTitle = 60;  // characters, that fit
  const std::string what = times ? "Time against " : "Success against ", title = what + paths_text(sweep);
  if (title.size() <= kLongTitle) return title;
  return what + last_key(sweep.axes[0]) + (sweep.axes.size() > 1 ? " and " + last_key(sweep.axes[1]) : "");
}

Figure figure_of(const Sweep& sweep, Shown shown) {
  const bool times = shown == Shown::times;
  Figure out{times ? "sweep_times" : "sweep", figure_title(sweep, times)};
  const bool grid = sweep.axes.size() > 1;
  const std::size_t seconds = grid ? sweep.axes[1].texts.size() : 1;
  const std::size_t curves = grid ? seconds : sweep.policies.size();  // of a panel
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    if (grid || policy == 0) out.panels.push_back(empty_panel(sweep, shown));
    PlotPanel& panel = out.panels.back();
    if (grid && sweep.policies.size() > 1) panel.title = sweep.policies[policy];
    for (std::size_t second = 0; second < seconds; ++second) {
      const std::size_t color = grid ? second : policy;
      add_curve(curve(sweep, policy, second, shown), color, curves, sweep.axes[0], panel);
      if (grid ? policy > 0 : sweep.policies.size() == 1) continue;
      out.legend.push_back(
          {grid ? last_key(sweep.axes[1]) + ": " + sweep.axes[1].texts[second] : sweep.policies[policy],
           policy_color(color), color >= kPolicyColors ? PlotLegend::Kind::dashed : PlotLegend::Kind::line});
    }
  }
  out.subtitle = fmt::format("{}, {}{}", sweep.scenario, particles_text(sweep), sweep.complete ? "" : "; not complete");
  const char* const drawn = curves > kMostBands ? "Bars" : "Bars and bands";
  out.notes.push_back(times ? fmt::format("{}: 95 % intervals (Greenwood); none where nothing was violated.", drawn)
                            : fmt::format("{}: 95 % {}.", drawn,
                                          sweep.adaptive ? "confidence sequence" : "intervals (Clopper and Pearson)"));
  if (curves > 1)
    out.notes.push_back("Curves are moved a little along the axis, so that their bars can be told apart.");
  return out;
}

}  // namespace

Figure sweep_figure(const Sweep& sweep) { return figure_of(sweep, Shown::success); }

Figure sweep_times_figure(const Sweep& sweep) { return figure_of(sweep, Shown::times); }

}  // namespace graze
