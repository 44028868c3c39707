#include "analysis/report_margins.h"

#include <algorithm>
#include <cmath>

namespace graze {
namespace {

constexpr int kBins = 40;
constexpr double kTail = 0.005;  // of the sample, beyond the outer edges on either side

/// Edges of equal width that hold the sample but for its tails; one of them is 0 if both signs occur.
std::vector<double> edges_of(std::vector<double> values) {
  std::erase_if(values, [](double x) { return !std::isfinite(x); });
  if (values.empty()) return {-1, 0, 1};
  std::sort(values.begin(), values.end());
  const auto tail = static_cast<std::size_t>(kTail * static_cast<double>(values.size()));
  double low = values[tail], high = values[values.size() - 1 - tail];
  if (high - low < std::max(1e-9, 1e-6 * std::abs(high))) {  // all the same: something on either side is to be seen
    const double beside = high == 0 ? 1 : std::max(1e-9, 0.05 * std::abs(high));
    low -= beside;
    high += beside;
  }
  if (!std::isfinite(high - low)) return {low, 0, high};  // forged: no bins of one width span it
  const double width = (high - low) / kBins;
  const bool zero = low < 0 && high > 0;
  const double start = zero ? -std::ceil(-low / width) * width : low;
  std::vector<double> out;
  for (int i = 0; out.empty() || out.back() < high - 1e-9 * width; ++i) {
    const double edge = start + i * width;
    out.push_back(zero && std::abs(edge) < width / 2 ? 0 : edge);
  }
  return out;
}

std::vector<MarginHistogram> empty_histograms(const ReportSample& sample, const CampaignInfo& info) {
  std::vector<MarginHistogram> out;
  for (std::size_t k = 0; k <= info.requirements.size(); ++k) {
    std::vector<double> values;
    for (const SampledTraces& traces : sample.policies) {
      const std::vector<double>& more = k < traces.margins.size() ? traces.margins[k] : traces.objective;
      values.insert(values.end(), more.begin(), more.end());
    }
    MarginHistogram& one = out.emplace_back();
    const bool objective = k == info.requirements.size();
    one.name = objective ? "objective" : info.requirements[k].name;
    one.measure = !objective && info.requirements[k].measure;
    if (!objective) one.unit = info.requirements[k].unit;
    if (objective && info.leaves.size() == 1) one.unit = info.leaves[0].unit;
    one.edges = edges_of(std::move(values));
    for (const SampledTraces& traces : sample.policies) one.policies.push_back({traces.policy, {}});
    for (auto& counts : one.policies) counts.bins.resize(one.edges.size() - 1);
  }
  return out;
}

void count(const MarginHistogram& histogram, MarginHistogram::Counts& out, double margin, Outcome outcome) {
  if (!std::isfinite(margin)) {
    ++out.unjudged;
    return;
  }
  const std::vector<double>& edges = histogram.edges;
  const auto above = std::upper_bound(edges.begin() + 1, edges.end() - 1, margin);  // a bin has its lower edge
  ++out.bins[static_cast<std::size_t>(above - edges.begin() - 1)][static_cast<std::size_t>(outcome)];
}

}  // namespace

std::vector<MarginHistogram> margin_histograms(const Archive& archive, const ReportSample& sample) {
  std::vector<MarginHistogram> out = empty_histograms(sample, archive.info());
  for (std::size_t p = 0; p < sample.policies.size(); ++p) {
    archive.scan(sample.policies[p].policy, kObjectiveMargin | kMargins, [&](const TraceRows& rows) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (rows.outcome(i) == Outcome::invalid) continue;
        const std::span<const double> margins = rows.margins(i);
        for (std::size_t k = 0; k < out.size(); ++k) {
          count(out[k], out[k].policies[p], k < margins.size() ? margins[k] : rows.objective_margin(i),
                rows.outcome(i));
        }
      }
    });
  }
  return out;
}

}  // namespace graze
