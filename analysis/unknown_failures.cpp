#include "analysis/unknown_failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "analysis/failures.h"
#include "analysis/quantiles.h"
#include "analysis/trace_features.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr std::size_t kMostTraces = 1000;  // of each outcome; distances are kept of all pairs
constexpr std::size_t kMostKindsFound = 6;
constexpr double kDivided = 0.25;  // mean silhouette from which on there are several kinds (weak structure: Rousseeuw)
constexpr double kFar = 5;         // robust standard deviations: farther is as far

using RowNumbers = std::vector<std::size_t>;

/// 1.4826 times the median deviation from the median: the standard deviation, of a normal distribution; where half of
/// the values are equal, the standard deviation.
double robust_deviation(const std::vector<double>& x, double middle) {
  std::vector<double> away;
  double squares = 0;
  for (const double one : x) {
    away.push_back(std::abs(one - middle));
    squares += (one - middle) * (one - middle);
  }
  const double robust = 1.4826 * median(std::move(away));
  return robust > 0 ? robust : std::sqrt(squares / std::max<double>(1, static_cast<double>(x.size())));
}

/// Q_n of Rousseeuw and Croux (Journal of the American Statistical Association 88 (1993) 1273-1283): 2.2219 times the
/// first quartile of the distances of all pairs; the standard deviation, of a normal distribution. Where there are two
/// heaps it is that of one heap, which the median deviation is not. Where it is 0, the standard deviation.
double deviation_of_pairs(const std::vector<double>& x) {
  std::vector<double> away;
  away.reserve(x.size() * x.size() / 2);
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) away.push_back(std::abs(x[i] - x[k]));
  }
  if (away.empty()) return 0;
  const std::size_t half = x.size() / 2 + 1, place = std::min(away.size(), half * (half - 1) / 2) - 1;
  std::nth_element(away.begin(), away.begin() + static_cast<std::ptrdiff_t>(place), away.end());
  const double robust = 2.2219 * away[place];
  return robust > 0 ? robust : robust_deviation(x, median(x));
}

std::vector<double> column_of(const TraceFeatures& features, const RowNumbers& rows, std::size_t column) {
  std::vector<double> out;
  for (const std::size_t row : rows) out.push_back(features(row, column));
  return out;
}

/// Distances of all pairs of some rows, over standardised columns.
class Distances {
 public:
  Distances(const TraceFeatures& features, const RowNumbers& rows) : n_(rows.size()), all_(n_ * n_) {
    for (std::size_t c = 0; c < features.columns.size(); ++c) {
      const std::vector<double> x = column_of(features, rows, c);
      const double scale = deviation_of_pairs(x);
      if (!(scale > 0)) continue;
      for (std::size_t i = 0; i < n_; ++i) {
        for (std::size_t k = 0; k < i; ++k) {
          const double away = std::min(kFar, std::abs(x[i] - x[k]) / scale);
          all_[i * n_ + k] += away * away;
        }
      }
    }
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t k = 0; k < i; ++k) all_[k * n_ + i] = all_[i * n_ + k] = std::sqrt(all_[i * n_ + k]);
    }
  }
  std::size_t size() const { return n_; }
  double operator()(std::size_t i, std::size_t k) const { return all_[i * n_ + k]; }

 private:
  std::size_t n_;
  std::vector<double> all_;
};

struct Division {
  std::vector<std::size_t> kind, medoids;  // kind: of each row
};

std::size_t medoid_of(const Distances& d, const Division& division, std::size_t kind) {
  double least = std::numeric_limits<double>::infinity();
  std::size_t out = division.medoids[kind];
  for (std::size_t i = 0; i < d.size(); ++i) {
    if (division.kind[i] != kind) continue;
    double sum = 0;
    for (std::size_t k = 0; k < d.size(); ++k) sum += division.kind[k] == kind ? d(i, k) : 0.0;
    if (sum < least) least = sum, out = i;
  }
  return out;
}

/// k-medoids: begins with the medoid of all and the rows that are farthest from those so far, then alternates.
Division divide(const Distances& d, std::size_t kinds) {
  Division out;
  out.kind.assign(d.size(), 0);
  out.medoids = {0};
  out.medoids = {medoid_of(d, out, 0)};
  const auto nearest = [&](std::size_t i) {
    std::size_t best = 0;
    for (std::size_t k = 1; k < out.medoids.size(); ++k) {
      if (d(i, out.medoids[k]) < d(i, out.medoids[best])) best = k;
    }
    return best;
  };
  while (out.medoids.size() < kinds) {
    // The row by which the sum of distances to the nearest medoid falls most (BUILD of PAM).
    double most = -1;
    std::size_t next = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      double gain = 0;
      for (std::size_t k = 0; k < d.size(); ++k) gain += std::max(0.0, d(k, out.medoids[nearest(k)]) - d(k, i));
      if (gain > most) most = gain, next = i;
    }
    out.medoids.push_back(next);
  }
  for (int round = 0; round < 50; ++round) {
    for (std::size_t i = 0; i < d.size(); ++i) out.kind[i] = nearest(i);
    std::vector<std::size_t> before = out.medoids;
    for (std::size_t k = 0; k < kinds; ++k) out.medoids[k] = medoid_of(d, out, k);
    if (out.medoids == before) break;
  }
  return out;
}

double silhouette(const Distances& d, const Division& division) {
  const std::size_t kinds = division.medoids.size();
  double sum = 0;
  for (std::size_t i = 0; i < d.size(); ++i) {
    std::vector<double> total(kinds), count(kinds);
    for (std::size_t k = 0; k < d.size(); ++k) {
      if (k == i) continue;
      total[division.kind[k]] += d(i, k);
      ++count[division.kind[k]];
    }
    const std::size_t own = division.kind[i];
    if (count[own] == 0) continue;  // alone: 0
    const double inside = total[own] / count[own];
    double outside = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < kinds; ++k) {
      if (k != own && count[k] > 0) outside = std::min(outside, total[k] / count[k]);
    }
    if (std::isfinite(outside)) sum += (outside - inside) / std::max(outside, inside);
  }
  return sum / static_cast<double>(d.size());
}

/// Whether a witness of the objective judges where `link` is at the end along `axis`. `said`: its description, such as
/// "*_FOOT x > 0.45 m, y > -0.1 m and y < 0.1 m", which is all that archives keep of witnesses.
bool judges_place(const std::string& said, const std::string& link, const std::string& axis) {
  if (said.find(", from ") != std::string::npos) return false;  // in a window: elsewhere than at the end
  std::size_t bounds = std::string::npos, of_axis = std::string::npos;
  for (const char* one : {"x", "y", "z"}) {
    for (const char* side : {" > ", " < "}) {
      const std::size_t at = said.find(std::string(" ") + one + side);
      bounds = std::min(bounds, at);
      if (axis == one) of_axis = std::min(of_axis, at);
    }
  }
  return of_axis != std::string::npos && matches(said.substr(0, bounds), link);
}

/// Whether a witness of the objective judges what two parts do: `what` is "no contact between " or "impulse between ".
bool judges_pair(const std::string& said, const std::string& what, const std::string& a, const std::string& b) {
  const std::size_t begin = said.find(what), both = said.find(" and ");
  if (begin == std::string::npos || both == std::string::npos || both < begin + what.size()) return false;
  const std::string first = said.substr(begin + what.size(), both - begin - what.size());
  const std::string rest = said.substr(both + 5), second = rest.substr(0, rest.find_first_of(" ,"));
  return (matches(first, a) && matches(second, b)) || (matches(first, b) && matches(second, a));
}

/// Proposes requirements for a kind, on even particles, and tries them on odd ones.
class Proposals {
 public:
  Proposals(const TraceFeatures& features, const RowNumbers& kind, const RowNumbers& successes,
            const CampaignInfo& info)
      : features_(features), info_(info) {
    for (const std::size_t row : kind) (features.particle[row] % 2 == 0 ? kind_ : kind_odd_).push_back(row);
    for (const std::size_t row : successes) (features.particle[row] % 2 == 0 ? fine_ : fine_odd_).push_back(row);
  }

  /// Whether there are enough traces to choose a requirement on and to try it: from fewer nothing is to be learned.
  bool possible() const {
    constexpr std::size_t kFewest = 5;
    return std::min({kind_.size(), kind_odd_.size(), fine_.size(), fine_odd_.size()}) >= kFewest;
  }

  /// The three that do best on even particles, in the order of what they do on odd ones, which is what is told; those
  /// that the objective judges already only where there are no others, and last.
  std::vector<ProposedWitness> take() {
    for (std::size_t c = 0; c < features_.columns.size(); ++c) propose(c);
    // What the objective judges already parts its failures from successes best of all, and tells nothing.
    std::stable_sort(found_.begin(), found_.end(), [](const auto& x, const auto& y) {
      return x.second.in_objective != y.second.in_objective ? y.second.in_objective : x.first > y.first;
    });
    std::vector<ProposedWitness> out;
    for (auto& [score, witness] : found_) {
      if (out.size() < 3) out.push_back(std::move(witness));
    }
    const auto net = [](const ProposedWitness& one) {
      return static_cast<double>(one.caught) / static_cast<double>(one.of) -
             static_cast<double>(one.alarms) / static_cast<double>(one.successes);
    };
    std::stable_sort(out.begin(), out.end(), [&](const auto& x, const auto& y) {
      return x.in_objective != y.in_objective ? y.in_objective : net(x) > net(y);
    });
    return out;
  }

 private:
  static constexpr double kWorth = 0.5;  // caught minus alarms, as shares

  void propose(std::size_t c) {
    const TraceFeature& f = features_.columns[c];
    const auto part = [&](int i) { return info_.colliders[static_cast<std::size_t>(i)]; };
    switch (f.kind) {
      case TraceFeature::Kind::contact:
        offer(c, 0, +1, fmt::format("no_contact: [{}, {}]", part(f.a), part(f.b)));
        threshold(c, +1, [&](double t) {
          return fmt::format("contact_impulse: {{between: [{}, {}], below: {:.4g} N s}}", part(f.a), part(f.b), t);
        });
        break;
      case TraceFeature::Kind::margin:
        if (info_.requirements[f.requirement].measure) {
          offer(c, 0, -1, fmt::format("# as a requirement, the measure '{}'", info_.requirements[f.requirement].name));
        }
        break;
      case TraceFeature::Kind::position:
        if (!f.name.starts_with("base.") || info_.links.empty()) break;
        threshold(c, -1, [&](double t) { return at_end(f, "above", t); });
        threshold(c, +1, [&](double t) { return at_end(f, "below", t); });
        break;
      default:
        break;
    }
  }

  std::string at_end(const TraceFeature& f, const char* side, double t) const {
    const std::string axis = f.name.substr(5), link = info_.links.front();
    const std::string bound = fmt::format("{}: {:.4g} m", side, t);
    // The last step alone, at which the feature was taken.
    const std::string window = fmt::format("window: [{:.10g} s, {:.10g} s]", info_.end - info_.step, info_.end);
    return axis == "z" ? fmt::format("height: {{link: {}, {}}}, {}", link, bound, window)
                       : fmt::format("position: {{link: {}, {}: {{{}}}}}, {}", link, axis, bound, window);
  }

  bool restates(const TraceFeature& f, bool touching, const std::string& said) const {
    if (f.kind == TraceFeature::Kind::position) return judges_place(said, info_.links.front(), f.name.substr(5));
    if (f.kind != TraceFeature::Kind::contact) return false;
    const auto part = [&](int i) { return info_.colliders[static_cast<std::size_t>(i)]; };
    return judges_pair(said, touching ? "no contact between " : "impulse between ", part(f.a), part(f.b));
  }

  double share(const RowNumbers& rows, std::size_t c, double t, int side) const {
    if (rows.empty()) return 0;
    return static_cast<double>(beyond(rows, c, t, side)) / static_cast<double>(rows.size());
  }
  std::uint64_t beyond(const RowNumbers& rows, std::size_t c, double t, int side) const {
    return static_cast<std::uint64_t>(
        std::count_if(rows.begin(), rows.end(), [&](std::size_t row) { return side * (features_(row, c) - t) > 0; }));
  }

  /// The threshold between two values of the even traces that parts them best.
  void threshold(std::size_t c, int side, const std::function<std::string(double)>& yaml) {
    std::vector<double> values = column_of(features_, kind_, c);
    const std::vector<double> fine = column_of(features_, fine_, c);
    values.insert(values.end(), fine.begin(), fine.end());
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    double best = 0, at = 0;
    for (std::size_t i = 0; i + 1 < values.size(); ++i) {
      const double t = 0.5 * (values[i] + values[i + 1]);
      const double score = share(kind_, c, t, side) - share(fine_, c, t, side);
      if (score > best) best = score, at = t;
    }
    if (best > 0 && !(features_.columns[c].kind == TraceFeature::Kind::contact && at <= 0))
      offer(c, at, side, yaml(at));
  }

  void offer(std::size_t c, double t, int side, std::string yaml) {
    const double score = share(kind_, c, t, side) - share(fine_, c, t, side);
    if (score < kWorth || share(kind_odd_, c, t, side) - share(fine_odd_, c, t, side) < 0.5 * kWorth) return;
    const bool in_objective = std::any_of(info_.leaves.begin(), info_.leaves.end(), [&](const auto& leaf) {
      return restates(features_.columns[c], yaml.starts_with("no_contact"), leaf.description);
    });
    found_.emplace_back(score, ProposedWitness{std::move(yaml), beyond(kind_odd_, c, t, side), kind_odd_.size(),
                                               beyond(fine_odd_, c, t, side), fine_odd_.size(), in_objective});
  }

  const TraceFeatures& features_;
  const CampaignInfo& info_;
  RowNumbers kind_, kind_odd_, fine_, fine_odd_;
  std::vector<std::pair<double, ProposedWitness>> found_;
};

std::vector<Trait> traits_of(const TraceFeatures& features, const RowNumbers& kind, const RowNumbers& compared) {
  std::vector<Trait> out;
  for (std::size_t c = 0; c < features.columns.size(); ++c) {
    const std::vector<double> other = column_of(features, compared, c);
    const double middle = median(other), scale = robust_deviation(other, middle);
    const double here = median(column_of(features, kind, c));
    if (here == middle) continue;
    const double deviation = scale > 0 ? (here - middle) / scale : std::copysign(99.0, here - middle);
    out.push_back({features.columns[c].name, features.columns[c].unit, here, middle, deviation});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Trait& x, const Trait& y) { return std::abs(x.deviation) > std::abs(y.deviation); });
  if (out.size() > 5) out.resize(5);
  return out;
}

}  // namespace

UnknownFailures unknown_failures(const Archive& archive, const std::string& policy) {
  UnknownFailures out;
  out.trust = needs_trust(archive.info());
  out.policy = policy;
  const TraceFeatures features = trace_features(archive, policy, kMostTraces);
  out.traces = features.failures;
  out.successes = features.successes;
  RowNumbers failures, successes;
  for (std::size_t row = 0; row < features.rows(); ++row) {
    (features.success[row] ? successes : failures).push_back(row);
  }
  out.looked_at = failures.size();
  if (failures.empty()) return out;
  const Distances distances(features, failures);
  Division best = divide(distances, 1);
  for (std::size_t kinds = 2; kinds <= std::min(kMostKindsFound, failures.size() / 3); ++kinds) {
    Division one = divide(distances, kinds);
    const double value = silhouette(distances, one);
    if (value > std::max(kDivided, out.silhouette)) out.silhouette = value, best = std::move(one);
  }
  for (std::size_t kind = 0; kind < best.medoids.size(); ++kind) {
    FailureKind one;
    RowNumbers rows;
    for (std::size_t i = 0; i < failures.size(); ++i) {
      if (best.kind[i] != kind) continue;
      rows.push_back(failures[i]);
      one.particles.push_back(features.particle[failures[i]]);
    }
    one.traces = rows.size();
    one.typical = features.particle[failures[best.medoids[kind]]];
    one.traits = traits_of(features, rows, successes.empty() ? failures : successes);
    Proposals proposals(features, rows, successes, archive.info());
    one.tried = proposals.possible();
    if (one.tried) one.witnesses = proposals.take();
    out.kinds.push_back(std::move(one));
  }
  std::stable_sort(out.kinds.begin(), out.kinds.end(),
                   [](const FailureKind& x, const FailureKind& y) { return x.traces > y.traces; });
  return out;
}

}  // namespace graze
