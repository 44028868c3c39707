#include "jobs/cli/improve_dialogue.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>
#include <numeric>
#include <sstream>

#include "analysis/text_table.h"
#include "archive/files/files.h"
#include "engine/settings/inputs.h"
#include "engine/settings/unit_quantity.h"
#include "jobs/campaign/improvement_words.h"

namespace graze {
namespace {

constexpr std::size_t kMostAnswers = std::size_t{1} << 20;  // bytes
constexpr std::size_t kMostAlone = 1'000'000;               // steps of one answer

struct AnswerForm {
  const char* word;
  const char* arguments;
  const char* help;
};
constexpr AnswerForm kForms[] = {
    {"accept", "", "make the step as it stands"},
    {"scale", "FACTOR", "change all of it by a factor"},
    {"zero", "VARIABLE…", "leave these variables (globs) as they are"},
    {"only", "VARIABLE…", "leave all others as they are"},
    {"same", "VARIABLE…", "change these by the same part of their ways, the mean of what is suggested"},
    {"set", "VARIABLE VALUE", "bring a variable to a value"},
    {"reset", "", "begin with the suggestion again"},
    {"back", "[STEPS]", "take back the last step, or so many"},
    {"auto", "[STEPS]", "go on without questions, to the end or for so many steps"},
    {"quit", "", "end here; the same command goes on"},
};

std::vector<std::string> words_of(std::string line) {
  line.resize(std::min(line.size(), line.find('#')));
  std::istringstream stream(line);
  return {std::istream_iterator<std::string>(stream), {}};
}

double number_of(const std::string& what, const std::string& text, Quantity quantity = Quantity::dimensionless) {
  try {
    return Settings::parse(what + ": " + text, what).at(what).number(quantity);
  } catch (const InputError& error) {
    const std::string told = error.what();  // "scale:1:8: scale: …": of a file that is not there
    const std::size_t place = told.find(": ");
    throw InputError(place == std::string::npos ? told : told.substr(place + 2));
  }
}

/// One question: the change that is suggested, as answers make of it.
class StepQuestion {
 public:
  StepQuestion(const Improvement& session, const Scenario& scenario, const Suggestion& at)
      : session_(session), scenario_(scenario), at_(at), change(at.change) {}

  std::string text() const {
    const DesignBlock& block = *scenario_.redesign;
    const DesignValues& here = session_.state().design;
    const DesignValues next = session_.changed(change);
    std::vector<std::vector<std::string>> variables = {{"variable", "unit", "now", "next", "from", "to"}};
    for (std::size_t i = 0; i < block.variables.size(); ++i) {
      const DesignVariable& one = block.variables[i];
      const auto shown = [&](double x) { return fmt::format("{:.4g}", x / one.scale); };
      variables.push_back({one.name, one.unit, shown(here[i]), next[i] == here[i] ? "-" : shown(next[i]),
                           shown(one.lower), shown(one.upper)});
    }
    const std::vector<std::string> names = limit_names(scenario_), units = limit_units(scenario_);
    const std::vector<double> predicted = session_.predict(at_, change);
    std::vector<std::vector<std::string>> limits = {{"limit", "unit", "now", "predicted", ""}};
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto shown = [](double x) { return std::isnan(x) ? "-" : fmt::format("{:.3g}", x); };
      limits.push_back({names[k], units[k], shown(at_.now.margins[k]), shown(predicted[k]), kinks_of(k)});
    }
    const ImproveState& state = session_.state();
    const std::string task = block.task_path.empty()
                                 ? ""
                                 : fmt::format(" of task {} of {} ({} = {})", state.level + 1, block.task_values.size(),
                                               block.task_path, block.task_values[state.level]);
    const std::string lost = lost_words(at_.now.lost);
    return fmt::format("\nStep {}{}: without violation for {:.0f} % of the trace{}\n{}{}", state.steps.size() + 1, task,
                       100 * at_.now.progress, lost.empty() ? "" : "; " + lost, text_table(variables, 2),
                       text_table(limits, 2));
  }

  /// An answer that changes the change. Throws InputError.
  void adjust(const std::vector<std::string>& words) {
    const std::vector<std::string> rest(words.begin() + 1, words.end());
    if (words.front() == "scale") {
      need(words, rest.size() == 1);
      const double by = number_of("scale", rest.front());
      if (!(std::abs(by) <= 1e6)) throw InputError(fmt::format("scale {}: must be a number of at most 1e6", by));
      change *= by;
    } else if (words.front() == "set") {
      need(words, rest.size() >= 2);
      set(rest.front(), fmt::format("{}", fmt::join(rest.begin() + 1, rest.end(), " ")));
    } else if (words.front() == "reset") {
      need(words, rest.empty());
      change = at_.change;
    } else {
      need(words, !rest.empty());
      const std::vector<Eigen::Index> named = variables_of(rest);
      if (words.front() == "zero") {
        change(named).setZero();
      } else if (words.front() == "same") {
        change(named).setConstant(change(named).mean());
      } else {
        const Eigen::VectorXd kept = change(named);
        change.setZero();
        change(named) = kept;
      }
    }
  }

  static void need(const std::vector<std::string>& words, bool well_formed) {
    if (well_formed) return;
    const auto* form = std::find_if(std::begin(kForms), std::end(kForms),
                                    [&](const AnswerForm& one) { return one.word == words.front(); });
    throw InputError(fmt::format("'{}': is written '{}{}{}'", fmt::join(words, " "), form->word,
                                 *form->arguments ? " " : "", form->arguments));
  }

 private:
  std::vector<Eigen::Index> variables_of(const std::vector<std::string>& globs) const {
    const std::vector<DesignVariable>& all = scenario_.redesign->variables;
    std::vector<std::string> names;
    for (const DesignVariable& one : all) names.push_back(one.name);
    std::vector<Eigen::Index> out;
    for (const std::string& glob : globs) {
      bool any = false;
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (!matches(glob, all[i].name)) continue;
        any = true;
        const auto index = static_cast<Eigen::Index>(i);
        if (std::find(out.begin(), out.end(), index) == out.end()) out.push_back(index);
      }
      if (!any) throw InputError(fmt::format("'{}': no variable of that name; {}", glob, nearest_or_all(glob, names)));
    }
    return out;
  }

  void set(const std::string& name, const std::string& value) {
    const std::vector<Eigen::Index> found = variables_of({name});
    if (found.size() != 1) throw InputError(fmt::format("set {}: sets one variable, and this names several", name));
    const auto i = static_cast<std::size_t>(found.front());
    const DesignVariable& one = scenario_.redesign->variables[i];
    const auto written = split_number(value);
    const bool bare = written && written->unit.empty();  // in the unit that is shown
    const Quantity quantity = quantity_of_unit(one.unit).value_or(Quantity::dimensionless);
    const double to = bare ? number_of("value", value) * one.scale : number_of("value", value, quantity);
    if (!(to >= one.lower && to <= one.upper)) {
      const std::string unit = unit_behind(one.unit);
      throw InputError(fmt::format("set {} {}: must lie from {:.6g} to {:.6g}{}; nearest right answer: {:.6g}{}", name,
                                   value, one.lower / one.scale, one.upper / one.scale, unit,
                                   (to < one.lower ? one.lower : one.upper) / one.scale, unit));
    }
    if (!one.choices.empty() && to != std::floor(to)) {
      throw InputError(fmt::format("set {} {}: is a choice by its number, a whole one from 1 to {}", name, value,
                                   one.choices.size()));
    }
    change[found.front()] = session_.share(i, to);
  }

  std::string kinks_of(std::size_t limit) const {
    std::vector<std::string> names;
    for (const Kink& one : at_.slopes.kinks) {
      if (one.limit != static_cast<int>(limit)) continue;
      names.push_back(scenario_.redesign->variables[static_cast<std::size_t>(one.variable)].name);
    }
    return names.empty() ? "" : fmt::format("no slope in {}", fmt::join(names, ", "));
  }

  const Improvement& session_;
  const Scenario& scenario_;
  const Suggestion& at_;

 public:
  Eigen::VectorXd change;  // [variable], shares of the way from bound to bound
};

/// Of "back 3" and "auto 3".
std::size_t count_of(const std::vector<std::string>& words, std::size_t most) {
  const double count = number_of(words[0], words[1]);
  if (count >= 1 && count <= static_cast<double>(most) && count == std::floor(count)) {
    return static_cast<std::size_t>(count);
  }
  throw InputError(fmt::format("{} {:g}: must be a whole number from 1 to {}", words[0], count, most));
}

std::size_t steps_back(const std::vector<std::string>& words, std::size_t made) {
  StepQuestion::need(words, words.size() <= 2);
  if (made == 0) throw InputError("back: no step was made yet");
  return words.size() == 1 ? 1 : count_of(words, made);
}

/// One answer to a question. True: it decided something (the state has changed, or `end` is set).
bool answer(Improvement& session, const Suggestion& at, StepQuestion& question, const std::vector<std::string>& words,
            std::optional<DialogueEnd>& end, std::ostream& out) {
  const std::string& word = words.front();
  if (word == "accept") {
    StepQuestion::need(words, words.size() == 1);
    std::string why;
    if (question.change.isZero(0)) throw InputError("accept: the step changes nothing; 'reset' has the suggestion");
    if (session.take(at, question.change, why)) return true;
    throw InputError("accept: this design cannot be: " + why);
  }
  if (word == "back") {
    session.roll_back(steps_back(words, session.state().steps.size()));
    out << fmt::format("back after {} steps\n", session.state().steps.size());
    return true;
  }
  if (word == kAuto || word == "quit") {
    StepQuestion::need(words, words.size() == 1 || (word == kAuto && words.size() == 2));
    if (words.size() == 1) {
      end = word == kAuto ? DialogueEnd::go_on : DialogueEnd::quit;
    } else {
      count_of(words, kMostAlone);
    }
    return true;
  }
  if (word == "help") {
    out << answers_help();
    return false;
  }
  std::vector<std::string> forms;
  for (const AnswerForm& one : kForms) forms.emplace_back(one.word);
  if (std::find(forms.begin(), forms.end(), word) == forms.end()) {
    throw InputError(fmt::format("'{}': no answer; {}", word, nearest_or_all(word, forms)));
  }
  question.adjust(words);
  out << question.text();
  return false;
}

/// Asks until something is decided. None: the answers ended.
std::optional<DialogueEnd> decide(Improvement& session, const Scenario& scenario, const Suggestion& at,
                                  const DialogueRequest& request) {
  StepQuestion question(session, scenario, at);
  std::ostream& out = *request.out;
  out << question.text();
  std::vector<std::string> said;
  while (true) {
    out << "accept, scale, zero, only, same, set, reset, back, auto, quit or help? " << std::flush;
    const auto words = request.answers->next();
    const bool seen = request.answers->place().empty() && isatty(STDIN_FILENO) != 0;  // where it was typed
    if (words && !seen) out << fmt::format("{}\n", fmt::join(*words, " "));
    if (!words) {
      out << "\n";
      return DialogueEnd::quit;
    }
    std::optional<DialogueEnd> end;
    try {
      const bool decided = answer(session, at, question, *words, end, out);
      if (words->front() != "help" && end != DialogueEnd::quit) {
        said.push_back(fmt::format("{}", fmt::join(*words, " ")));
      }
      if (!decided) continue;
      if (end == DialogueEnd::quit) return end;
      if (words->front() != kAuto) {
        session.note_answers(said);
        return end;
      }
      said.back() = kAuto;
      session.note_answers(said);
      request.keep();
      if (!end && !go_on_alone(session, count_of(*words, kMostAlone), request)) end = DialogueEnd::done;
      if (end != DialogueEnd::go_on) session.stop_going_alone();
      return end;
    } catch (const InputError& error) {
      if (!request.answers->place().empty()) {
        throw InputError(fmt::format("{}: {}", request.answers->place(), error.what()));
      }
      out << error.what() << "\n";
    }
  }
}

}  // namespace

AnswerSource::AnswerSource(const std::string& file, bool also_terminal) : terminal_(also_terminal) {
  if (file.empty()) return;
  std::istringstream stream(read_input(file, "--answers ", kMostAnswers));
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    std::vector<std::string> words = words_of(line);
    if (!words.empty()) lines_.push_back({fmt::format("{}:{}", file, number), std::move(words)});
  }
}

std::optional<std::vector<std::string>> AnswerSource::next() {
  if (!lines_.empty()) {
    Line line = std::move(lines_.front());
    lines_.pop_front();
    place_ = std::move(line.place);
    return std::move(line.words);
  }
  place_.clear();
  for (std::string line; terminal_ && std::getline(std::cin, line);) {
    std::vector<std::string> words = words_of(line);
    if (!words.empty()) return words;
  }
  return std::nullopt;
}

std::optional<std::size_t> AnswerSource::skip(const std::vector<SessionAnswer>& told, std::size_t steps) {
  const auto counted = [](const std::vector<std::string>& words) {
    return words.size() == 2 && words.front() == kAuto;
  };
  for (std::size_t k = 0; k < told.size(); ++k) {
    while (!lines_.empty() && lines_.front().words.front() == "help") lines_.pop_front();
    if (lines_.empty()) return std::nullopt;  // the rest was typed
    const Line line = std::move(lines_.front());
    lines_.pop_front();
    const std::string text = fmt::format("{}", fmt::join(line.words, " "));
    const std::vector<std::string> before = words_of(told[k].text);
    if (k + 1 == told.size() && counted(line.words) && (counted(before) || told[k].text == kAuto)) {
      const std::size_t asked = count_of(line.words, kMostAlone);
      const std::size_t made = counted(before) ? count_of(before, kMostAlone) : steps - told[k].steps;
      if (made <= asked) return asked - made;
    }
    if (text == told[k].text) continue;
    throw InputError(fmt::format(
        "{}: '{}' is not what the session was told there, '{}'; choose another --output, or --force to begin anew",
        line.place, text, told[k].text));
  }
  return std::nullopt;
}

bool go_on_alone(Improvement& session, std::size_t count, const DialogueRequest& request) {
  const std::size_t target = session.state().steps.size() + count;
  bool more = true;
  while (more && session.state().steps.size() < std::min(target, request.most_steps)) {
    more = session.advance();
    request.keep();
  }
  return more;
}

DialogueEnd supervise(Improvement& session, const Scenario& scenario, const DialogueRequest& request) {
  while (session.state().steps.size() < request.most_steps) {
    const std::optional<Suggestion> at = session.suggest();
    if (!at) {
      request.keep();
      if (session.state().end != ImproveEnd::none) return DialogueEnd::done;
      continue;
    }
    const std::optional<DialogueEnd> end = decide(session, scenario, *at, request);
    if (end) return *end;
    request.keep();
  }
  return DialogueEnd::done;
}

std::string answers_help() {
  std::string out;
  for (const AnswerForm& one : kForms) {
    out += fmt::format("  {:<22} {}\n", fmt::format("{} {}", one.word, one.arguments), one.help);
  }
  return out;
}

}  // namespace graze
