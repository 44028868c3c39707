// Particles over their true parameters, by outcome.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "analysis/plots.h"
#include "analysis/plots_text.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr std::size_t kMostPanels = 12;

struct OutcomeMark {
  char letter;
  const char* title;
  PlotColor color;
  PlotMark mark;
};
constexpr std::array<OutcomeMark, 3> kOutcomeMarks = {
    {{'S', "Success", PlotColor::success, PlotMark::circle},
     {'K', "Known failure", PlotColor::known, PlotMark::cross},
     {'U', "Unknown failure", PlotColor::unknown, PlotMark::triangle}}};

/// Difference of the means of successes and failures, in standard deviations of all, as the report ranks parameters.
double separation(const std::vector<double>& values, const std::string& outcome) {
  std::array<double, 2> sums{}, counts{};
  double squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool success = outcome[i] == 'S';
    if (!(success || outcome[i] == 'K' || outcome[i] == 'U') || !std::isfinite(values[i])) continue;
    sums[success] += values[i];
    counts[success] += 1;
    squares += values[i] * values[i];
  }
  const double n = counts[0] + counts[1], sum = sums[0] + sums[1];
  const double variance = n > 1 ? (squares - sum * sum / n) / (n - 1) : 0;
  if (!(variance > 0) || counts[0] == 0 || counts[1] == 0) return 0;
  return (sums[1] / counts[1] - sums[0] / counts[0]) / std::sqrt(variance);
}

/// The policy whose rate of success is nearest to one half tells most.
std::size_t telling_policy(const ReportSample& sample) {
  std::size_t best = 0;
  double least = 2;
  for (std::size_t p = 0; p < sample.policies.size(); ++p) {
    const std::string& outcome = sample.policies[p].outcome;
    const auto count = [&](char letter) {
      return static_cast<double>(std::count(outcome.begin(), outcome.end(), letter));
    };
    const double n = count('S') + count('K') + count('U');
    const double far = n > 0 ? std::abs(count('S') / n - 0.5) : 1;
    if (far < least) {
      least = far;
      best = p;
    }
  }
  return best;
}

/// One axis: a parameter or a margin.
struct PlottedColumn {
  PlotAxis axis;
  std::size_t index = 0;
  bool margin = false;
  bool choice = false;
};

const std::vector<double>& column_of(const PlottedColumn& one, const ReportSample& sample,
                                     const SampledTraces& traces) {
  if (!one.margin) return sample.values[one.index];
  return one.index < traces.margins.size() ? traces.margins[one.index] : traces.objective;
}

PlottedColumn parameter_column(const CampaignInfo& info, std::size_t k) {
  const CampaignInfo::ParameterRow& row = info.parameters[k];
  PlottedColumn out{{plot_titled(row.name, row.unit)}, k};
  out.choice = !row.labels.empty();
  for (std::size_t i = 0; i < row.labels.size(); ++i) out.axis.labels.emplace_back(i, row.labels[i]);
  if (!out.choice) return out;
  out.axis.low = -0.6;
  out.axis.high = static_cast<double>(row.labels.size()) - 0.4;
  out.axis.grid = false;
  return out;
}

PlottedColumn margin_column(const CampaignInfo& info, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& one : info.requirements) names.push_back(one.name);
  names.emplace_back("objective");
  check_plotted_name("--requirement", name, names);
  const auto k = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  std::string unit = info.leaves.size() == 1 ? info.leaves[0].unit : "";
  if (k < info.requirements.size()) unit = info.requirements[k].unit;
  PlottedColumn out{{plot_titled("Margin of " + name, unit)}, k, true};
  out.axis.zero = true;
  return out;
}

std::vector<PlottedColumn> plotted_columns(const CampaignInfo& info, const ReportSample& sample,
                                           const ParametersRequest& request) {
  std::vector<std::string> names;
  for (const auto& one : info.parameters) names.push_back(one.name);
  std::vector<std::size_t> chosen;
  for (const std::string& name : request.parameters) {
    check_plotted_name("--parameter", name, names);
    chosen.push_back(static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin()));
  }
  const std::size_t needed = request.requirement.empty() ? 2 : 1;
  if (chosen.size() > needed) {
    throw InputError(
        fmt::format("--parameter: {} were given; a picture has two axes: two parameters, or one and "
                    "--requirement",
                    chosen.size() + (needed == 1 ? 1 : 0)));
  }
  const std::string& outcome = sample.policies[telling_policy(sample)].outcome;
  std::vector<std::size_t> order(info.parameters.size());
  std::iota(order.begin(), order.end(), 0);
  std::vector<double> parted;
  for (const std::vector<double>& values : sample.values) parted.push_back(std::abs(separation(values, outcome)));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return parted[a] > parted[b]; });
  for (const std::size_t k : order) {
    if (chosen.size() < needed && std::find(chosen.begin(), chosen.end(), k) == chosen.end()) chosen.push_back(k);
  }
  std::vector<PlottedColumn> out;
  for (const std::size_t k : chosen) out.push_back(parameter_column(info, k));
  if (!request.requirement.empty() || out.size() < 2) {
    out.push_back(margin_column(info, request.requirement.empty() ? "objective" : request.requirement));
  }
  return out;
}

/// Choices are drawn beside each other, not on top of each other: by particle, the same everywhere.
double beside(double x, std::size_t i, bool choice, double turn) {
  constexpr double kHalf = 0.3;
  return choice ? x + kHalf * (2 * std::fmod(static_cast<double>(i) * turn, 1.0) - 1) : x;
}

PlotPanel scatter_panel(const std::vector<PlottedColumn>& axes, const ReportSample& sample,
                        const SampledTraces& traces) {
  PlotPanel out{traces.policy, axes[0].axis, axes[1].axis};
  out.height = 320;
  const std::vector<double>&x = column_of(axes[0], sample, traces), &y = column_of(axes[1], sample, traces);
  for (const OutcomeMark& of : kOutcomeMarks) {
    PlotSeries one;
    one.kind = PlotSeries::Kind::marks;
    one.color = of.color;
    one.mark = of.mark;
    one.faint = true;
    for (std::size_t i = 0; i < traces.outcome.size(); ++i) {
      if (traces.outcome[i] != of.letter || !std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
      one.x.push_back(beside(x[i], i, axes[0].choice, 0.618034));
      one.y.push_back(beside(y[i], i, axes[1].choice, 0.754878));
    }
    constexpr std::size_t kMany = 1500;
    one.width = traces.outcome.size() > kMany ? 3 : 5;
    if (!one.x.empty()) out.series.push_back(std::move(one));
  }
  // What is rare is drawn last.
  std::stable_sort(out.series.begin(), out.series.end(),
                   [](const PlotSeries& a, const PlotSeries& b) { return a.x.size() > b.x.size(); });
  if (out.series.empty()) out.instead = "No valid trace has these two numbers.";
  return out;
}

}  // namespace

Figure parameters_figure(const CampaignInfo& info, const ReportSample& sample, const ParametersRequest& request) {
  if (info.parameters.empty()) throw InputError("parameters: the scenario has no uncertain parameters");
  if (sample.values.empty()) throw InputError("parameters: the archive does not keep the particles' values");
  const std::vector<PlottedColumn> axes = plotted_columns(info, sample, request);
  Figure out{"parameters", fmt::format("{} and {}", axes[0].axis.title, axes[1].axis.title)};
  for (const OutcomeMark& one : kOutcomeMarks) {
    out.legend.push_back({one.title, one.color, PlotLegend::Kind::mark, one.mark});
  }
  const std::size_t telling = telling_policy(sample);
  for (std::size_t p = 0; p < sample.policies.size(); ++p) {
    if (request.every_policy || p == telling) out.panels.push_back(scatter_panel(axes, sample, sample.policies[p]));
  }
  if (out.panels.size() > kMostPanels) {
    throw InputError(fmt::format("parameters: a picture has room for {} policies, and --policy chooses {}", kMostPanels,
                                 out.panels.size()));
  }
  out.columns = out.panels.size() > 1 ? 2 : 1;
  if (out.columns > 1) {
    for (PlotPanel& one : out.panels) one.height = 240;
  }
  out.notes.push_back(
      fmt::format("The first {} particles{}.", sample.count,
                  axes[0].choice || axes[1].choice ? "; those of one choice lie beside each other" : ""));
  if (!request.every_policy && sample.policies.size() > 1) {
    out.notes.push_back("Of the policy whose success rate is nearest to one half; --policy shows others.");
  }
  return out;
}

}  // namespace graze
