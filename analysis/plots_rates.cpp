// Pictures of success rates, of what failed, and of margins.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "analysis/plots.h"
#include "analysis/plots_text.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr double kRow = 30;  // px, of a policy in a list
constexpr double kRateLow = -0.03, kRateHigh = 1.03;

const PolicyScore* score_of(const Score& score, const std::string& policy) {
  const auto at = std::find_if(score.policies.begin(), score.policies.end(),
                               [&](const PolicyScore& one) { return one.policy == policy; });
  return at == score.policies.end() ? nullptr : &*at;
}

using Members = std::vector<const PolicyFamily::Member*>;

PlotSeries rate_curve(const Members& members, std::size_t axis, const Score& score) {
  PlotSeries out;
  for (const PolicyFamily::Member* member : members) {
    const PolicyScore* one = score_of(score, member->policy);
    if (one == nullptr) continue;
    out.x.push_back(member->values[axis]);
    out.y.push_back(one->rate);
    out.low.push_back(one->interval.low);
    out.high.push_back(one->interval.high);
  }
  return out;
}

/// Members that differ in the axis alone, by their labels along the others.
std::map<std::string, Members> curves_of(const PolicyFamily& family, std::size_t axis) {
  std::map<std::string, Members> out;
  for (const PolicyFamily::Member& member : family.members) {
    std::string others;
    for (std::size_t k = 0; k < member.labels.size(); ++k) {
      if (k != axis) others += (others.empty() ? "" : ", ") + member.labels[k];
    }
    out[others].push_back(&member);
  }
  for (auto& [others, members] : out) {
    std::stable_sort(members.begin(), members.end(),
                     [&](const auto* a, const auto* b) { return a->values[axis] < b->values[axis]; });
  }
  return out;
}

PlotPanel family_panel(const PolicyFamily& family, std::size_t axis, const Score& score, Figure& figure) {
  PlotPanel out;
  out.title = figure.panels.empty() ? "" : family.name;
  out.x.title = plot_titled(family.axes[axis].key, family.axes[axis].unit);
  out.y = {"Success rate", kRateLow, kRateHigh};
  const std::map<std::string, Members> curves = curves_of(family, axis);
  std::size_t color = 0;
  std::vector<double> values;
  for (const auto& [others, members] : curves) {
    PlotSeries line = rate_curve(members, axis, score);
    line.color = policy_color(color++);
    line.width = 2;
    PlotSeries marks = line;
    marks.kind = PlotSeries::Kind::tall;
    marks.width = 8;
    values.insert(values.end(), line.x.begin(), line.x.end());
    if (curves.size() > 1) {
      figure.legend.push_back({fmt::format("{}: {}", family.name, others), line.color, PlotLegend::Kind::line});
    }
    out.series.push_back(std::move(line));
    out.series.push_back(std::move(marks));
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  constexpr std::size_t kMostLabels = 10;
  for (std::size_t i = 0; values.size() <= kMostLabels && i < values.size(); ++i) {
    out.x.labels.emplace_back(values[i], plot_number(values[i]));
  }
  if (!out.x.labels.empty()) out.x.grid = false;
  return out;
}

/// A line for each policy, the first one on top.
PlotPanel list_panel(const std::vector<std::string>& policies) {
  PlotPanel out;
  const auto n = static_cast<double>(policies.size());
  for (std::size_t i = 0; i < policies.size(); ++i)
    out.y.labels.emplace_back(n - 1 - static_cast<double>(i), policies[i]);
  out.y.low = -0.6;
  out.y.high = n - 0.4;
  out.y.grid = false;
  out.height = std::max(2.0, n) * kRow;
  return out;
}

PlotPanel rates_by_policy(const std::vector<const PolicyScore*>& scores, const Score& all) {
  std::vector<std::string> names;
  for (const PolicyScore* one : scores) names.push_back(one->policy);
  PlotPanel out = list_panel(names);
  out.x = {"Success rate", kRateLow, kRateHigh};
  for (std::size_t i = 0; i < scores.size(); ++i) {
    PlotSeries one;
    one.kind = PlotSeries::Kind::wide;
    one.color = policy_color(static_cast<std::size_t>(scores[i] - all.policies.data()));
    one.width = 9;
    one.x = {scores[i]->rate};
    one.y = {out.y.labels[i].first};
    one.low = {scores[i]->interval.low};
    one.high = {scores[i]->interval.high};
    out.series.push_back(std::move(one));
  }
  return out;
}

/// One part of the bars of what failed.
struct FailedPart {
  std::string name;
  PlotColor color;
  std::vector<std::uint64_t> counts;  // [policy]
};

std::vector<FailedPart> failed_parts(const Score& score) {
  std::vector<FailedPart> out;
  // Neither the orange of unknown failures nor its like.
  const std::array colors = {PlotColor::known, policy_color(5), policy_color(0),
                             policy_color(2),  policy_color(4), policy_color(6)};
  for (std::size_t r = 0; r < score.requirements.size(); ++r) {
    out.push_back({score.requirements[r], colors[r % colors.size()], {}});
    for (const PolicyScore& one : score.policies) out.back().counts.push_back(one.by_requirement.at(r));
  }
  out.push_back({"objective not met", PlotColor::unknown, {}});
  out.push_back({"invalid", PlotColor::invalid, {}});
  for (const PolicyScore& one : score.policies) {
    out[out.size() - 2].counts.push_back(one.unknown);
    out.back().counts.push_back(one.invalid);
  }
  std::erase_if(out, [](const FailedPart& part) {
    return std::all_of(part.counts.begin(), part.counts.end(), [](std::uint64_t n) { return n == 0; });
  });
  return out;
}

void add_histogram(const MarginHistogram& histogram, std::size_t policy, double base, double peak, PlotPanel& panel) {
  constexpr double kFull = 0.86;  // of a policy's row
  constexpr PlotColor kColors[] = {PlotColor::success, PlotColor::known, PlotColor::unknown};
  const auto& bins = histogram.policies[policy].bins;
  std::vector<double> from(bins.size(), 0);
  for (std::size_t k = 0; k < 3; ++k) {
    PlotSeries one;
    one.kind = PlotSeries::Kind::boxes;
    one.color = kColors[k];
    for (std::size_t i = 0; i < bins.size(); ++i) {
      if (bins[i][k] == 0) continue;
      const double more = static_cast<double>(bins[i][k]);
      one.x.push_back(histogram.edges[i]);
      one.high.push_back(histogram.edges[i + 1]);
      one.y.push_back(base + kFull * from[i] / peak);
      one.low.push_back(base + kFull * (from[i] + more) / peak);
      from[i] += more;
    }
    if (!one.x.empty()) panel.series.push_back(std::move(one));
  }
}

double highest_bin(const MarginHistogram& histogram) {
  std::uint64_t out = 0;
  for (const MarginHistogram::Counts& counts : histogram.policies) {
    for (const auto& bin : counts.bins) out = std::max(out, bin[0] + bin[1] + bin[2]);
  }
  return static_cast<double>(out);
}

PlotPanel margin_panel(const MarginHistogram& histogram, Figure& figure) {
  PlotPanel out;
  out.title = histogram.name + (histogram.measure ? " (measure)" : "");
  out.x = {plot_titled("Margin", histogram.unit), histogram.edges.front(), histogram.edges.back()};
  out.x.zero = true;
  const std::size_t n = histogram.policies.size();
  out.y.low = 0;
  out.y.high = static_cast<double>(n);
  out.height = std::max(70.0, 36.0 * static_cast<double>(n));
  const double peak = highest_bin(histogram);
  if (peak == 0) out.instead = "No valid trace has this margin: its time never came.";
  for (std::size_t i = 0; i < n; ++i) {
    const double base = static_cast<double>(n - 1 - i);
    out.y.labels.emplace_back(base, histogram.policies[i].policy);
    if (peak > 0) add_histogram(histogram, i, base, peak, out);
    if (const std::uint64_t none = histogram.policies[i].unjudged; none > 0 && peak > 0) {
      figure.notes.push_back(fmt::format("{}, {}: {} traces have none: its time never came.", histogram.name,
                                         histogram.policies[i].policy, none));
    }
  }
  if (peak > 0) out.x.title += fmt::format("; highest bin: {} traces", peak);
  return out;
}

void outcome_boxes(Figure& out) {
  out.legend = {
      {"Success", PlotColor::success}, {"Known failure", PlotColor::known}, {"Unknown failure", PlotColor::unknown}};
}

}  // namespace

Figure success_figure(const std::vector<PolicyFamily>& families, const Score& score) {
  Figure out{"success", "Success rate"};
  std::vector<std::string> shown;
  for (const PolicyFamily& family : families) {
    const auto numeric =
        std::find_if(family.axes.rbegin(), family.axes.rend(), [](const auto& a) { return a.numeric; });
    if (numeric == family.axes.rend()) continue;
    const auto axis = static_cast<std::size_t>(std::distance(numeric, family.axes.rend()) - 1);
    out.panels.push_back(family_panel(family, axis, score, out));
    for (const PolicyFamily::Member& member : family.members) shown.push_back(member.policy);
  }
  std::vector<const PolicyScore*> rest;
  for (const PolicyScore& one : score.policies) {
    if (std::find(shown.begin(), shown.end(), one.policy) == shown.end()) rest.push_back(&one);
  }
  if (!rest.empty()) out.panels.push_back(rates_by_policy(rest, score));
  out.notes.push_back(score.stopped_by_question ? "Bars and bands: 95 % confidence sequence."
                                                : "Bars and bands: 95 % intervals (Clopper and Pearson).");
  std::string none;
  for (const PolicyScore& one : score.policies) {
    if (one.n == 0) none += (none.empty() ? "" : ", ") + one.policy;
  }
  if (!none.empty()) out.notes.push_back("Without a valid trace: " + none + ".");
  return out;
}

Figure failures_figure(const Score& score) {
  Figure out{"failures", "What failed"};
  std::vector<std::string> names;
  for (const PolicyScore& one : score.policies) names.push_back(one.policy);
  PlotPanel panel = list_panel(names);
  panel.x = {"Share of all traces [%]", 0};
  std::vector<double> from(names.size(), 0);
  double longest = 0;
  for (const FailedPart& part : failed_parts(score)) {
    out.legend.push_back({part.name, part.color});
    PlotSeries bar;
    bar.kind = PlotSeries::Kind::boxes;
    bar.color = part.color;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const double all = static_cast<double>(score.policies[i].n + score.policies[i].invalid);
      const double share = all > 0 ? 100 * static_cast<double>(part.counts[i]) / all : 0;
      if (share == 0) continue;
      constexpr double kHalf = 0.3;
      const double y = panel.y.labels[i].first;
      bar.x.push_back(from[i]);
      bar.high.push_back(from[i] + share);
      bar.y.push_back(y - kHalf);
      bar.low.push_back(y + kHalf);
      from[i] += share;
      longest = std::max(longest, from[i]);
    }
    panel.series.push_back(std::move(bar));
  }
  panel.x.high = longest > 0 ? longest * 1.3 : 100;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const PolicyScore& one = score.policies[i];
    const std::uint64_t failed = one.known + one.unknown + one.invalid;
    panel.words.push_back({from[i] + panel.x.high * 0.01, panel.y.labels[i].first,
                           fmt::format("{} of {} failed", failed, one.n + one.invalid)});
  }
  if (longest > 0) {  // no shares beyond all
    for (auto& [at, text] : plot_ticks(0, std::min(100.0, panel.x.high), 6)) panel.x.labels.emplace_back(at, text);
  }
  out.panels.push_back(std::move(panel));
  out.notes.push_back(longest > 0 ? "Known failures by the requirement that was violated first."
                                  : "No trace violated a requirement.");
  return out;
}

Figure margins_figure(const std::vector<MarginHistogram>& histograms, const std::string& requirement) {
  Figure out{"margins", "Margins"};
  std::vector<std::string> names;
  for (const MarginHistogram& one : histograms) names.push_back(one.name);
  if (!requirement.empty()) check_plotted_name("--requirement", requirement, names);
  outcome_boxes(out);
  for (const MarginHistogram& one : histograms) {
    if (requirement.empty() || one.name == requirement) out.panels.push_back(margin_panel(one, out));
  }
  out.columns = out.panels.size() > 1 ? 2 : 1;
  out.notes.insert(out.notes.begin(),
                   "All valid traces; below 0 is a violation. The outer bins hold what lies beyond, too.");
  return out;
}

void check_plotted_name(const std::string& option, const std::string& name, const std::vector<std::string>& names) {
  if (std::find(names.begin(), names.end(), name) != names.end()) return;
  throw InputError(fmt::format("{} {}: there is none of that name; {}", option, name, nearest_or_all(name, names)));
}

}  // namespace graze
