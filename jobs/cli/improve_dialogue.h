#pragma once
// Supervised redesign (§5.2): each suggested step is shown, with the margins that it is predicted to have, and answers
// from the terminal or a file change it, make it, or take earlier ones back.

#include <deque>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "jobs/campaign/improvement.h"

namespace graze {

/// Lines of answers: those of a file, if one is given, and then, if asked for, standard input's. Comments (# …) and
/// blank lines are none.
class AnswerSource {
 public:
  /// Throws InputError if the file cannot be read.
  AnswerSource(const std::string& file, bool also_terminal);
  /// The words of the next answer; none: there are no more.
  std::optional<std::vector<std::string>> next();
  /// Leaves out the lines that a session was told already; returns how many steps of a last "auto COUNT" are still to
  /// be made, if that is the last of them. Throws InputError if they are others.
  std::optional<std::size_t> skip(const std::vector<SessionAnswer>& told, std::size_t steps);
  /// Lines of the file that nobody has asked for.
  std::size_t left() const { return lines_.size(); }
  /// "answers.txt:3" of the last answer of a file; empty: it was typed.
  const std::string& place() const { return place_; }

 private:
  struct Line {
    std::string place;
    std::vector<std::string> words;
  };
  std::deque<Line> lines_;
  bool terminal_;
  std::string place_;
};

/// What a supervised session is told by and told with.
struct DialogueRequest {
  AnswerSource* answers = nullptr;
  std::ostream* out = nullptr;
  std::function<void()> keep;  // called when the session's state has changed
  std::size_t most_steps = 0;  // asks no more then
};

enum class DialogueEnd { done, quit, go_on };

/// Asks about each step until there is none left, or too many (done), or the answers end (quit) or hand over (go_on).
/// What a typed answer has wrong is told and asked again; in a file it throws InputError "FILE:LINE: …".
DialogueEnd supervise(Improvement& session, const Scenario& scenario, const DialogueRequest& request);

/// Makes up to `count` steps without questions; false: there is nothing left to do.
bool go_on_alone(Improvement& session, std::size_t count, const DialogueRequest& request);

/// The answers that supervise() understands, a line each.
std::string answers_help();

}  // namespace graze
