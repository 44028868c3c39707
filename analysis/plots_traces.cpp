// Pictures of traces that were simulated again: paths from above, channels against time.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/plots.h"
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

std::vector<double> row_of(const Json& trace, std::size_t channel) {
  std::vector<double> out;
  for (const Json& x : trace["rows"][channel]) out.push_back(x.is_null() ? std::nan("") : x.get<double>());
  return out;
}

std::vector<double> times_of(const Json& trace) { return trace["time"].get<std::vector<double>>(); }

/// Traces that have frames, and their colours.
class PlayedTraces {
 public:
  PlayedTraces(const Json& page, const std::vector<std::string>& policies, PlotBy by, const std::string& picture)
      : policies_(policies), by_(by) {
    for (const Json& trace : page["trajectories"]) {
      if (trace.contains("rows")) traces_.push_back(&trace);
    }
    if (traces_.empty()) {
      throw InputError(fmt::format("{}: no trace could be simulated again, and archives keep no paths", picture));
    }
  }

  const std::vector<const Json*>& list() const { return traces_; }
  PlotColor color(const Json& trace) const {
    return by_ == PlotBy::outcome ? kOutcomeColors.at(outcome(trace)).color : policy_color(policy(trace));
  }
  std::vector<PlotLegend> legend() const {
    std::vector<PlotLegend> out;
    for (std::size_t k = 0; by_ == PlotBy::outcome && k < kOutcomeColors.size(); ++k) {
      const auto count = std::count_if(traces_.begin(), traces_.end(), [&](const Json* t) { return outcome(*t) == k; });
      if (count == 0) continue;
      out.push_back(
          {fmt::format("{} ({})", kOutcomeColors[k].title, count), kOutcomeColors[k].color, PlotLegend::Kind::line});
    }
    for (std::size_t k = 0; by_ == PlotBy::policy && k < policies_.size(); ++k) {
      const auto count = std::count_if(traces_.begin(), traces_.end(), [&](const Json* t) { return policy(*t) == k; });
      if (count > 0) out.push_back({policies_[k], policy_color(k), PlotLegend::Kind::line});
    }
    return out;
  }
  std::string note() const {
    return fmt::format(
        "{} traces, simulated again: of each policy the success nearest to the nominal robot, a typical "
        "trace of each way to fail, the earliest violation, and the first particles.",
        traces_.size());
  }

 private:
  static std::size_t outcome(const Json& trace) {
    const auto name = trace["outcome"].get<std::string>();
    const auto at = std::find_if(kOutcomeColors.begin(), kOutcomeColors.end(),
                                 [&](const OutcomeColor& one) { return name == one.name; });
    return std::min<std::size_t>(static_cast<std::size_t>(at - kOutcomeColors.begin()), kOutcomeColors.size() - 1);
  }
  std::size_t policy(const Json& trace) const {
    const auto at = std::find(policies_.begin(), policies_.end(), trace["policy"].get<std::string>());
    return static_cast<std::size_t>(at - policies_.begin());
  }

  const std::vector<std::string>& policies_;
  PlotBy by_;
  std::vector<const Json*> traces_;
};

struct NamedChannel {
  std::string group, name, unit;
  std::string whole() const { return group + ": " + name; }
};

std::vector<NamedChannel> channels_of_page(const Json& page) {
  std::vector<NamedChannel> out;
  for (const Json& one : page["channels"]) {
    out.push_back({one["group"].get<std::string>(), one["name"].get<std::string>(), one["unit"].get<std::string>()});
  }
  return out;
}

bool floats(const Json& page) { return page.contains("scene") && page["scene"].value("floating_base", false); }

std::size_t chosen_channel(const Json& page, const std::string& asked) {
  const std::vector<NamedChannel> all = channels_of_page(page);
  const auto find = [&](const auto& test) {
    return static_cast<std::size_t>(std::find_if(all.begin(), all.end(), test) - all.begin());
  };
  if (asked.empty()) {
    const std::size_t height =
        find([](const NamedChannel& one) { return one.group == "position" && one.name.ends_with(".z"); });
    const std::size_t first = find([](const NamedChannel& one) { return one.group == "requirement"; });
    const std::size_t out = floats(page) && height < all.size() ? height : first;
    return out < all.size() ? out : 0;
  }
  const std::size_t whole = find([&](const NamedChannel& one) { return one.whole() == asked; });
  if (whole < all.size()) return whole;
  std::vector<std::string> names, same;
  for (const NamedChannel& one : all) {
    names.push_back(one.name);
    if (one.name == asked) same.push_back(one.whole());
  }
  if (same.size() > 1) {
    throw InputError(
        fmt::format("--channel {}: {} channels have the name; say '{}' or '{}'", asked, same.size(), same[0], same[1]));
  }
  check_plotted_name("--channel", asked, names);
  return find([&](const NamedChannel& one) { return one.name == asked; });
}

}  // namespace

Figure plan_figure(const Json& page, const std::vector<std::string>& policies, PlotBy by) {
  const PlayedTraces traces(page, policies, by, "plan");
  const std::vector<NamedChannel> channels = channels_of_page(page);
  const auto is_x = [](const NamedChannel& one) { return one.group == "position" && one.name.ends_with(".x"); };
  const auto at = std::find_if(channels.begin(), channels.end(), is_x);
  const auto x = static_cast<std::size_t>(at - channels.begin());
  if (!floats(page) || x + 1 >= channels.size()) {
    throw InputError("plan: the robot's base is fixed and has no path; channel shows its joints against time");
  }
  Figure out{"plan", "Path of the base from above"};
  out.legend = traces.legend();
  out.legend.push_back({"end", PlotColor::soft, PlotLegend::Kind::mark});
  PlotPanel panel{"", {"x [m]"}, {"y [m]"}};
  panel.one_scale = true;
  panel.height = 380;
  for (const Json* trace : traces.list()) {
    PlotSeries path;
    path.color = traces.color(*trace);
    path.width = 1.2;
    path.faint = true;
    path.x = row_of(*trace, x);
    path.y = row_of(*trace, x + 1);
    PlotSeries end = path;
    end.kind = PlotSeries::Kind::marks;
    end.faint = false;
    end.width = 6;
    if (!path.x.empty()) {
      end.x = {path.x.back()};
      end.y = {path.y.back()};
    }
    panel.series.push_back(std::move(path));
    panel.series.push_back(std::move(end));
  }
  out.panels.push_back(std::move(panel));
  out.notes.push_back(traces.note());
  return out;
}

Figure channel_figure(const Json& page, const std::vector<std::string>& policies, const std::string& channel,
                      PlotBy by) {
  const PlayedTraces traces(page, policies, by, "channel");
  const std::size_t k = chosen_channel(page, channel);
  const NamedChannel of = channels_of_page(page).at(k);
  Figure out{"channel", of.name + " against time"};
  out.legend = traces.legend();
  PlotPanel panel{"", {"Time [s]", 0}, {plot_titled(of.name, of.unit)}};
  panel.y.zero = of.group != "position" && of.group != "velocity" && of.group != "torque";
  panel.height = 340;
  double end = 0;
  for (const Json* trace : traces.list()) {
    PlotSeries line;
    line.color = traces.color(*trace);
    line.width = 1.2;
    line.faint = true;
    line.x = times_of(*trace);
    line.y = row_of(*trace, k);
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
