#include "scenarios/task_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sampling/constants.h"

namespace graze {
namespace {

std::string bracketed(const Window& window) { return fmt::format("[{:g}, {:g}] s", window.from, window.to); }

}  // namespace

bool Window::opens(const TraceTimes& times) const {
  if (from > times.end) return false;
  if (!(times.step > 0)) return true;
  // Times are k * step as the simulation has them; one k on either side for what the quotient was rounded by.
  const double first = std::floor(from / times.step), last = std::round(times.end / times.step);
  for (double k = std::max(first - 1, 0.0); k <= std::min(first + 2, last); ++k) {
    if (contains(k * times.step)) return true;
  }
  return false;
}

WitnessRange range_of_parts(const Objective& node) {
  if (node.kind == Objective::Kind::negation) {
    WitnessRange out = node.parts.front().range;
    out.low = -std::exchange(out.high, -out.low);
    return out;
  }
  // `any` takes the greatest of each bound, `all` the least.
  const double sign = node.kind == Objective::Kind::any ? -1 : 1;
  const auto least = [&](double WitnessRange::*bound) {
    return std::min_element(node.parts.begin(), node.parts.end(),
                            [&](const Objective& a, const Objective& b) {
                              return sign * (a.range.*bound) < sign * (b.range.*bound);
                            })
        ->range;
  };
  const WitnessRange low = least(&WitnessRange::low), high = least(&WitnessRange::high);
  const WitnessRange& decides = high.high < 0 ? high : low;
  return {low.low, high.high, decides.why, decides.of_nominal};
}

WitnessRange unopened(const Window& window, bool once) {
  const double margin = once ? -kInfinity : kInfinity;
  return {margin, margin, fmt::format("no trace comes to its window {}", bracketed(window)), false};
}

bool warn_of_window(const Settings& settings, const Window& window, const TraceTimes& times, const char* then) {
  if (window.from > times.end) {
    warn(settings,
         fmt::format("{}: begins after the end of the trace at {:g} s, {}", bracketed(window), times.end, then));
    return true;
  }
  if (!window.opens(times)) {
    warn(settings, fmt::format("{}: lies between two steps of {:g} s, {}", bracketed(window), times.step, then));
    return true;
  }
  if (std::isfinite(window.to) && window.to > times.end * (1 + 1e-9)) {
    warn(settings, fmt::format("{}: goes on beyond the end of the trace at {:g} s; what would come then is not judged",
                               bracketed(window), times.end));
  }
  return false;
}

void doubt(const Settings& settings, const WitnessRange& range, const char* always, const char* never) {
  const char* const but = range.of_nominal ? " (of the nominal robot)" : "";
  if (range.always_holds()) warn(settings, fmt::format("{}: {}{}", always, range.why, but));
  if (range.never_holds()) warn(settings, fmt::format("{}: {}{}", never, range.why, but));
}

}  // namespace graze
