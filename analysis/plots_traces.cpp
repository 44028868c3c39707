// Pictures of traces that were simulated again: what they share, and channels against time.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "analysis/number_words.h"
#include "analysis/plots_played.h"
#include "analysis/plots_text.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

/// "success", …, in the order of the legend.
struct OutcomeColor {
  const char *name, *title;
  PlotColor color;
};
constexpr std::array<OutcomeColor, 4> kOutcomeColors = {{{"success", "Success", PlotColor::success},
                                                         {"known failure", "Known failure", PlotColor::known},
                                                         {"unknown failure", "Unknown failure", PlotColor::unknown},
                                                         {"invalid", "Invalid", PlotColor::invalid}}};

std::size_t outcome_index(const Json& trace) {
  const auto name = trace["outcome"].get<std::string>();
  const auto at = std::find_if(kOutcomeColors.begin(), kOutcomeColors.end(),
                               [&](const OutcomeColor& one) { return name == one.name; });
  return std::min<std::size_t>(static_cast<std::size_t>(at - kOutcomeColors.begin()), kOutcomeColors.size() - 1);
}

}  // namespace

std::vector<double> played_row(const Json& trace, std::size_t channel) {
  std::vector<double> out;
  for (const Json& x : trace["rows"][channel]) out.push_back(x.is_null() ? std::nan("") : x.get<double>());
  return out;
}

std::vector<double> played_times(const Json& trace) { return trace["time"].get<std::vector<double>>(); }

PlayedTraces::PlayedTraces(const Json& page, const std::vector<std::string>& policies, PlotBy by,
                           const std::string& picture)
    : policies_(policies), by_(by) {
  for (const Json& trace : page["trajectories"]) {
    if (trace.contains("rows")) traces_.push_back(&trace);
  }
  if (traces_.empty()) {
    throw InputError(fmt::format("{}: no trace could be simulated again, and archives keep no paths", picture));
  }
}

PlotSeries PlayedTraces::line(const Json& trace) const {
  PlotSeries out;
  const std::size_t outcome = outcome_index(trace);
  out.color = by_ == PlotBy::outcome ? kOutcomeColors.at(outcome).color : policy_color(policy_index(trace));
  out.width = 1.2;
  out.faint = true;
  out.dashed = by_ == PlotBy::policy && outcome > 0;
  return out;
}

std::vector<PlotLegend> PlayedTraces::legend() const {
  std::vector<PlotLegend> out;
  for (std::size_t k = 0; by_ == PlotBy::outcome && k < kOutcomeColors.size(); ++k) {
    const auto count =
        std::count_if(traces_.begin(), traces_.end(), [&](const Json* t) { return outcome_index(*t) == k; });
    if (count == 0) continue;
    out.push_back(
        {fmt::format("{} ({})", kOutcomeColors[k].title, count), kOutcomeColors[k].color, PlotLegend::Kind::line});
  }
  if (by_ == PlotBy::outcome) return out;
  bool failed = false;
  for (std::size_t k = 0; k < policies_.size(); ++k) {
    const auto count =
        std::count_if(traces_.begin(), traces_.end(), [&](const Json* t) { return policy_index(*t) == k; });
    if (count > 0) out.push_back({policies_[k], policy_color(k), PlotLegend::Kind::line});
  }
  for (const Json* trace : traces_) failed = failed || outcome_index(*trace) > 0;
  if (failed) out.push_back({"failed", PlotColor::soft, PlotLegend::Kind::dashed});
  return out;
}

std::string PlayedTraces::note() const {
  return fmt::format(
      "{}, simulated again: of each policy the success nearest to the nominal robot, a typical "
      "trace of each way to fail, the earliest violation, and the first particles.",
      counted(traces_.size(), "trace", "traces"));
}

std::size_t PlayedTraces::policy_index(const Json& trace) const {
  const auto at = std::find(policies_.begin(), policies_.end(), trace["policy"].get<std::string>());
  return static_cast<std::size_t>(at - policies_.begin());
}

std::vector<PlayedChannel> played_channels(const Json& page) {
  std::vector<PlayedChannel> out;
  for (const Json& one : page["channels"]) {
    out.push_back({one["group"].get<std::string>(), one["name"].get<std::string>(), one["unit"].get<std::string>()});
  }
  return out;
}

bool base_floats(const Json& page) { return page.contains("scene") && page["scene"].value("floating_base", false); }

namespace {

constexpr std::array<const char*, 3> kTurns = {".roll", ".pitch", ".yaw"};

/// A channel of the page, or an angle that four of them, a quaternion, tell.
struct DrawnChannel : PlayedChannel {
  std::size_t row = 0;
  int turn = -1;  // place in kTurns
};

/// R = Rz(yaw) Ry(pitch) Rx(roll) of the quaternion in rows row … row + 3; without jumps of a whole turn.
std::vector<double> angles_of(const Json& trace, std::size_t row, int turn) {
  const std::vector<double> w = played_row(trace, row), x = played_row(trace, row + 1), y = played_row(trace, row + 2),
                            z = played_row(trace, row + 3);
  std::vector<double> out;
  double before = 0;
  for (std::size_t i = 0; i < w.size(); ++i) {
    double angle = 0;
    if (turn == 0) angle = std::atan2(2 * (w[i] * x[i] + y[i] * z[i]), 1 - 2 * (x[i] * x[i] + y[i] * y[i]));
    if (turn == 1) angle = std::asin(std::clamp(2 * (w[i] * y[i] - z[i] * x[i]), -1.0, 1.0));
    if (turn == 2) angle = std::atan2(2 * (w[i] * z[i] + x[i] * y[i]), 1 - 2 * (y[i] * y[i] + z[i] * z[i]));
    if (turn != 1) angle += 2 * std::numbers::pi * std::round((before - angle) / (2 * std::numbers::pi));
    out.push_back(angle);
    if (std::isfinite(angle)) before = angle;
  }
  return out;
}

std::vector<DrawnChannel> drawable_channels(const Json& page) {
  std::vector<DrawnChannel> out, turns;
  for (const PlayedChannel& one : played_channels(page)) {
    out.push_back({one, out.size(), -1});
    if (one.group != "position" || !one.name.ends_with(".qw")) continue;
    for (int k = 0; k < 3; ++k) {
      turns.push_back({{"angle", one.name.substr(0, one.name.size() - 3) + kTurns.at(k), "rad"}, out.size() - 1, k});
    }
  }
  out.insert(out.end(), turns.begin(), turns.end());
  return out;
}

DrawnChannel chosen_channel(const Json& page, const std::string& asked) {
  const std::vector<DrawnChannel> all = drawable_channels(page);
  const auto find = [&](const auto& test) { return std::find_if(all.begin(), all.end(), test); };
  if (asked.empty()) {
    const auto height = find([](const auto& one) { return one.group == "position" && one.name.ends_with(".z"); });
    const auto first = find([](const auto& one) { return one.group == "requirement"; });
    const auto out = base_floats(page) && height != all.end() ? height : first;
    return out != all.end() ? *out : all.at(0);
  }
  const auto whole = find([&](const auto& one) { return one.whole() == asked; });
  if (whole != all.end()) return *whole;
  std::vector<std::string> names, same;
  for (const DrawnChannel& one : all) {
    const auto alike = std::count_if(all.begin(), all.end(), [&](const auto& other) { return other.name == one.name; });
    names.push_back(alike > 1 ? one.whole() : one.name);
    if (one.name == asked) same.push_back("'" + one.whole() + "'");
  }
  if (same.size() > 1) {
    throw InputError(fmt::format("--channel {}: {} channels have the name; say one of {}", asked, same.size(),
                                 fmt::join(same, ", ")));
  }
  check_plotted_name("--channel", asked, names);
  return *find([&](const auto& one) { return one.name == asked; });
}

}  // namespace

Figure channel_figure(const Json& page, const std::vector<std::string>& policies, const std::string& channel,
                      PlotBy by) {
  const PlayedTraces traces(page, policies, by, "channel");
  const DrawnChannel of = chosen_channel(page, channel);
  const bool rate = of.group == "velocity" || of.group == "torque";  // whose names joints have, too
  Figure out{"channel", (rate ? of.whole() : of.name) + " against time"};
  out.legend = traces.legend();
  PlotPanel panel{"", {"Time [s]", 0}, {plot_titled(of.name, of.unit)}};
  panel.y.zero = of.group == "requirement" || of.group == "measure" || of.group == "objective";
  panel.height = 340;
  double end = 0;
  for (const Json* trace : traces.list()) {
    PlotSeries line = traces.line(*trace);
    line.x = played_times(*trace);
    line.y = of.turn < 0 ? played_row(*trace, of.row) : angles_of(*trace, of.row, of.turn);
    if (!line.x.empty()) end = std::max(end, line.x.back());
    panel.series.push_back(std::move(line));
  }
  panel.x.high = end > 0 ? end : 1;
  out.panels.push_back(std::move(panel));
  if (out.panels[0].y.zero) out.notes.push_back("Below 0 is a violation, or an objective that is not met.");
  out.notes.push_back(traces.note());
  return out;
}

}  // namespace graze
