#pragma once
// Traces of a page that were simulated again (jobs/campaign/page_traces.h), as pictures take them: which there are,
// their colours, their rows.

#include <string>
#include <vector>

#include "analysis/plots.h"

namespace graze {

/// One row of a trace: a number for each of its times, NaN where there is none.
std::vector<double> played_row(const Json& trace, std::size_t channel);
std::vector<double> played_times(const Json& trace);

/// Traces that have frames, and how they look.
class PlayedTraces {
 public:
  /// Throws InputError, naming `picture`: there are none.
  PlayedTraces(const Json& page, const std::vector<std::string>& policies, PlotBy by, const std::string& picture);

  const std::vector<const Json*>& list() const { return traces_; }
  /// A faint line in the colour of the trace's outcome or policy; by policy those that failed are dashed.
  PlotSeries line(const Json& trace) const;
  std::vector<PlotLegend> legend() const;
  std::string note() const;

 private:
  std::size_t policy_index(const Json& trace) const;

  const std::vector<std::string>& policies_;
  PlotBy by_;
  std::vector<const Json*> traces_;
};

struct PlayedChannel {
  std::string group, name, unit;
  std::string whole() const { return group + ": " + name; }
};
std::vector<PlayedChannel> played_channels(const Json& page);

/// Whether the robot's base moves freely.
bool base_floats(const Json& page);

}  // namespace graze
