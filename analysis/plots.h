#pragma once
// The pictures of `graze plot` (docs/plot.md). Each is made from what the report, `graze events` and `graze explain`
// tell: the same functions, so the same numbers. Nothing here draws or reads files (plots_script.h,
// jobs/cli/gnuplot.h).

#include <array>
#include <span>
#include <string>
#include <vector>

#include "analysis/events.h"
#include "analysis/explanation.h"
#include "analysis/plots_figure.h"
#include "analysis/report_families.h"
#include "analysis/report_margins.h"
#include "analysis/report_numbers.h"
#include "analysis/report_sample.h"
#include "analysis/score.h"

namespace graze {

struct Picture {
  std::string name, what;  // "success", "success rate with intervals, …"
};
/// In the order in which they are listed.
const std::vector<Picture>& pictures();

/// Success rates with their intervals: over the parameter in which policies of a family differ, else by policy.
Figure success_figure(const std::vector<PolicyFamily>& families, const Score& score);

/// Of each policy the shares of traces by what failed: the requirement that was violated first, the objective; invalid
/// traces.
Figure failures_figure(const Score& score);

/// How margins are distributed, of each requirement and the objective, by policy and outcome. `requirement`: of this
/// one only; empty: of all.
Figure margins_figure(const std::vector<MarginHistogram>& histograms, const std::string& requirement);

/// What traces are coloured by.
enum class PlotBy { outcome, policy };
/// m, world axes.
using PlotPoint = std::array<double, 3>;
/// What stands around paths.
struct PathScene {
  std::vector<std::vector<PlotPoint>> outlines = {};  // lines: edges of fixed objects
  std::vector<std::vector<PlotPoint>> terrain = {};   // lines: nets over heightfields that all robots have in common
  bool own_grounds = false;                           // each robot has a heightfield of its own
  std::vector<PlotPoint> waypoints = {};
  std::vector<std::string> movable = {};  // objects that are not drawn
};
enum class PathView { above, side, isometric };
struct PathRequest {
  PathView view = PathView::above;
  PlotBy by = PlotBy::outcome;
  double every = 0;  // s, from mark to mark along a path; 0: none
};
/// Paths of the base: the pictures plan, side and isometric. `page`: "channels", "scene" and "trajectories" as
/// add_traces() leaves them, with plain numbers; `policies`: all that may occur, for their colours. Throws InputError:
/// the robot's base is fixed, or there are no trajectories.
Figure path_figure(const Json& page, const std::vector<std::string>& policies, const PathScene& scene,
                   const PathRequest& request);
/// Robots as they stood every so many seconds, obliquely, a panel for each policy. `page`: trajectories with bodies.
Figure lapse_figure(const Json& page, const std::vector<std::string>& policies, const PathScene& scene, double every);
/// A channel against time: "base.z", an angle of what floats ("base.roll", "base.pitch", "base.yaw"), or "velocity:
/// LF_X_1" where several groups have the name; empty: the height of the base, else the first requirement. Throws
/// InputError: there is none of that name.
Figure channel_figure(const Json& page, const std::vector<std::string>& policies, const std::string& channel,
                      PlotBy by);

struct ParametersRequest {
  std::vector<std::string> parameters;  // two, or one and a requirement; those missing: that part outcomes best
  std::string requirement;              // whose margin stands upright; empty: a second parameter does
  bool every_policy = false;            // else the one whose rate is nearest to one half
};
/// Particles over two of their parameters, or over one and a margin, by outcome. Throws InputError: no such parameter
/// or requirement, or the archive does not keep values.
Figure parameters_figure(const CampaignInfo& info, const ReportSample& sample, const ParametersRequest& request);

/// One policy's estimate (explained_traces.h).
struct PolicySurvival {
  std::string policy;
  Survival survival;
};
/// Kaplan and Meier's curves until `end`, s. `what`: the requirement; "any requirement".
Figure survival_figure(const std::vector<PolicySurvival>& all, const std::string& what, double end);

/// Where behaviour divides: a tree for each policy.
Figure tree_figure(const CampaignEvents& events);

/// How strongly the parameters with the smallest p-values go with success, or with the failure by a requirement.
Figure causes_figure(const Explanation& explanation, const std::string& requirement);

/// Throws InputError with the nearest name if `name` is none of them.
void check_plotted_name(const std::string& option, const std::string& name, const std::vector<std::string>& names);

}  // namespace graze
