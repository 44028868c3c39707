#pragma once
// Algorithm 2: a design is simulated, the first violated limits give the Jacobian, the design is changed by a part of
// -J^+ l or by a damped step, and what makes it worse is rolled back; when all limits hold the task becomes harder.
// What happened so far is plain data (ImproveState), so that a session that was killed goes on to what it would have
// come to.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/redesign.h"
#include "jobs/campaign/design_trials.h"

namespace graze {

struct ImproveOptions {
  std::string policy;
  bool damped = false;                   // damped_step(), else plain_step()
  double alpha = 0.5;                    // of the plain step
  std::vector<std::uint32_t> particles;  // that are improved on; empty: the nominal robot
  int threads = 1;                       // changes nothing but the time it takes
};

/// A variable's slope was none at this step.
struct StepKink {
  int limit = 0, variable = 0;
  bool contacts = false;  // the contact sequence changes with the variable
};

/// Smaller changes, as shares of the way from bound to bound, are not worth telling.
inline constexpr double kToldChange = 1e-4;

/// A change that undoes one of before (§5.2, Algorithmic correctness).
struct Revert {
  int variable = 0, step = 0;  // index of the step that is undone
  double share = 0;            // of that step's change
};

/// A proposal that made it no better, and was rolled back.
struct RefusedStep {
  double size = 0;      // alpha or radius
  double progress = 0;  // share of the trace before a limit is violated; NaN: it could not be simulated to its end
  double lack = 0;      // as ImproveStep::lack_after; NaN as well
};

struct ImproveStep {
  std::size_t level = 0;
  double from = 0, to = 0;                                       // s: the window; to: infinite for whole traces
  DesignValues before, after;                                    // SI
  std::vector<double> margins_before, predicted, margins_after;  // per limit, within the window
  double lack_before = 0, lack_after = 0;                        // up to the window's end (lack())
  double progress_before = 0, progress_after = 0, success_before = 0, success_after = 0;
  double size = 0;  // alpha or radius of the step that was taken
  LostTraces lost_before, lost_after;
  int rolled_back = 0;               // larger steps that had made it worse
  std::vector<RefusedStep> refused;  // these; histories of older programs lack them
  std::vector<StepKink> kinks;
  std::vector<Revert> reverts;
};

/// A task that the design of this time does without a violation.
struct ReachedLevel {
  std::size_t level = 0;
  std::size_t steps = 0;  // that were made until then
  DesignValues design;
  std::vector<double> margins;
  double success = 0;
};

/// What a supervised session was told, and how many steps there were then. "auto": went on by itself from there on,
/// as far as the steps that have been made since; "auto 3": three steps.
struct SessionAnswer {
  std::string text;
  std::size_t steps = 0;
};
inline constexpr const char* kAuto = "auto";

enum class ImproveEnd { none, reached_all, stuck };

struct ImproveState {
  DesignValues design;
  std::size_t level = 0;
  std::vector<double> scales;  // of the limits; empty: not begun
  double radius = 0.1;         // of the damped step, share of the way from bound to bound
  std::vector<ImproveStep> steps;
  std::vector<ReachedLevel> reached;
  LostTraces lost;        // of the present design
  std::vector<int> idle;  // variables that no limit heeded when the first Jacobian was made
  ImproveEnd end = ImproveEnd::none;
  std::string why;                   // of stuck
  std::vector<RefusedStep> refused;  // by which it got stuck
  std::vector<SessionAnswer> answers;
};

/// The best design that a session knows: of the hardest task that was done, else the one that it has come to.
std::pair<std::size_t, DesignValues> best_design(const ImproveState& state);  // level, values

/// What the present design lacks, and the step that its slopes suggest.
struct Suggestion {
  DesignMargins now;
  LimitSlopes slopes;
  double from = 0, to = 0;  // s: the window; to: infinite for whole traces
  double size = 0;          // alpha or radius of the change
  Eigen::VectorXd change;   // [variable], shares of the way from bound to bound
};

class Improvement {
 public:
  /// `robots` outlives this.
  Improvement(const DesignRobots& robots, ImproveOptions options, std::optional<ImproveState> begun = {});

  const ImproveState& state() const { return state_; }
  /// One step, or one level that is done; false: there is nothing left to do (ImproveState::end). Throws InputError:
  /// the robot cannot begin, or no variable moves a violated limit.
  bool advance();

  // The same in parts, for who decides on each step (§5.2, supervised).

  /// None: a level was reached, or there is nothing left to do (ImproveState::end). Throws as advance() does.
  std::optional<Suggestion> suggest();
  /// Margins of all limits after a change, by the slopes; NaN where they are not known.
  std::vector<double> predict(const Suggestion& at, const Eigen::VectorXd& change) const;
  /// Makes a change, within the bounds, whether it helps or not. False: that design cannot be simulated, or it changes
  /// a fixed total, for which `why` has the reason, and nothing is changed.
  bool take(const Suggestion& at, const Eigen::VectorXd& change, std::string& why);
  // What it is told is part of the state, so that steps and answers are on the disk together.
  void note_answers(const std::vector<std::string>& lines);
  /// Steps that follow are made without questions; nothing in a session that was never told anything.
  void go_alone();
  /// Questions begin (again): steps that were made without become "auto COUNT".
  void stop_going_alone();
  /// Undoes the last `count` steps, and the levels that were reached with them. Throws std::out_of_range.
  void roll_back(std::size_t count);
  /// Values of a change from the present design, within the bounds; and the change to a variable's value.
  DesignValues changed(const Eigen::VectorXd& change) const;
  double share(std::size_t variable, double value) const;

 private:
  DesignMargins here(double from, double to) const;
  void begin(const DesignMargins& first);
  bool reach(const DesignMargins& now);
  void choose_window(Suggestion& out) const;
  LimitSlopes slopes_of(const Suggestion& at) const;
  LimitSlopes slopes_at(const DesignMargins& now, const TrialQuestion& question) const;
  std::vector<Beside> beside(const TrialQuestion& question, const std::vector<std::size_t>& variables, double part,
                             const DesignMargins& now) const;
  void check_moved(const DesignMargins& now, const LimitSlopes& slopes);
  DesignPoint point(const Suggestion& at) const;
  Eigen::VectorXd change_of(const DesignPoint& at, double size) const;
  bool try_steps(const Suggestion& at);
  bool try_choices(const Suggestion& at, std::vector<RefusedStep>& refused);
  void note(const Suggestion& at, const DesignMargins& after, const DesignValues& next, double size,
            std::vector<RefusedStep> refused);
  std::string broken_total(const DesignValues& next) const;
  std::string kinks_of(const DesignMargins& now, const LimitSlopes& slopes) const;
  bool stuck(const std::string& why);
  TrialQuestion question(double from, double to) const;
  Eigen::VectorXd shares(const DesignValues& values) const;
  DesignValues values(const Eigen::VectorXd& shares) const;

  const DesignRobots& robots_;
  ImproveOptions options_;
  ImproveState state_;
};

}  // namespace graze
