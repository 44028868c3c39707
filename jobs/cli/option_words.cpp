#include "jobs/cli/option_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "archive/files/shell_word.h"
#include "engine/settings/settings.h"
#include "engine/settings/similar.h"
#include "jobs/cli/help_topics.h"

namespace graze {
namespace {

/// A word of the command line in a message.
std::string shown(const std::string& word) {
  constexpr std::size_t kShown = 80;  // bytes
  return clipped(word, kShown);
}

std::vector<std::string> verbs_of(const CLI::App& app) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands({})) verbs.push_back(verb->get_name());
  return verbs;
}

/// "; did you mean '--policy'?", or empty.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& choices) {
  const std::string near = nearest(word, choices);
  return near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near);
}

/// The same for a topic of help, of which there are hundreds: something is near most words, so it has to be nearer.
std::string near_topic(const std::string& word, std::vector<std::string> known) {
  for (const auto& more : {help_topics(), component_topics()}) known.insert(known.end(), more.begin(), more.end());
  constexpr std::size_t kLettersPerMistake = 5;
  const std::string near = nearest(word, known);
  if (near.empty()) return "";
  const std::size_t mistakes = edit_distance(word, near);
  // A sign or a letter alone is as near to any other.
  const bool close = mistakes < word.size() && mistakes <= std::max<std::size_t>(1, word.size() / kLettersPerMistake);
  return !close ? "" : fmt::format(" (did you mean '{}'?)", near);
}

/// A word as the option parser splits it: `--name=value`, `--name`, `-nVALUE`, `-n`.
struct OptionWord {
  std::string name;       // with its dashes; empty: the word is no option
  bool assigned = false;  // a value, which may be empty, is part of the word
  std::string value;

  explicit OptionWord(const std::string& word) {
    if (word.starts_with("--") && word.size() > 2) {
      const std::size_t equals = word.find('=');
      name = word.substr(0, equals);
      assigned = equals != std::string::npos;
      if (assigned) value = word.substr(equals + 1);
    } else if (word.size() > 1 && word[0] == '-' && word[1] != '-') {
      name = word.substr(0, 2);
      assigned = word.size() > 2;
      value = word.substr(2);
    }
  }
};

/// Walks over the words behind a verb.
class WordCheck {
 public:
  WordCheck(std::string verb, const std::vector<const CLI::App*>& apps) : verb_(std::move(verb)), apps_(apps) {}

  void check(const std::vector<std::string>& words) {
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (words[i] == "--") return;  // no options behind it
      if (words[i].empty()) fail("one of the words is empty ('')");
      const OptionWord word(words[i]);
      if (word.name.empty()) continue;
      const CLI::Option* option = find(word.name);
      if (option == nullptr) refuse(words[i], word);
      const bool flag = option->get_items_expected_max() == 0;
      if (word.assigned && word.value.empty()) fail_empty(word.name);
      if (word.assigned && word.value[0] == '=' && !word.name.starts_with("--")) fail_equals(words[i], word);
      if (flag) continue;
      if (!word.assigned && ++i == words.size()) fail(fmt::format("{}: its value is missing", word.name));
      note(*option, word.name, word.assigned ? word.value : words[i]);
      if (!word.assigned) check_value(word.name, words[i]);
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(fmt::format("{}: {}", verb_, what)); }
  [[noreturn]] void fail_empty(const std::string& name) const {
    fail(fmt::format("{}: its value is empty; leave the option out, or write a value", name));
  }

  /// What stands behind the letter of an option is its value, a '=' too, which nobody means.
  [[noreturn]] void fail_equals(const std::string& whole, const OptionWord& word) const {
    const std::string value = word.value.substr(1);
    fail(fmt::format("{}: '=' goes with long options; nearest right answer: {} {}", shown(whole), word.name,
                     value.empty() ? "VALUE" : shell_word(shown(value))));
  }

  const CLI::Option* find(const std::string& name) const {
    for (const CLI::App* app : apps_) {
      if (const CLI::Option* option = app->get_option_no_throw(name)) return option;
    }
    return nullptr;
  }

  [[noreturn]] void refuse(const std::string& whole, const OptionWord& word) const {
    std::vector<std::string> names;
    for (const CLI::App* app : apps_) {
      for (const CLI::Option* option : app->get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
        for (const std::string& name : option->get_snames()) names.push_back("-" + name);
      }
    }
    const std::string written = word.name.starts_with("--") ? word.name : whole;
    std::error_code error;
    if (std::filesystem::exists(whole, error)) {
      fail(fmt::format("{}: is not one of its options; the file of that name is {}", whole, shell_path(whole)));
    }
    const std::string near = did_you_mean(written, names);
    fail(fmt::format("{}: is not one of its options{}", shown(written),
                     near.empty() ? fmt::format("; 'graze {} --help' tells them", verb_) : near));
  }

  /// Behind an option that stands alone.
  void check_value(const std::string& name, const std::string& value) const {
    if (value.empty()) fail_empty(name);
    if (value == "--")
      fail(fmt::format("{0}: its value is missing: -- ends the options (if it is meant: {0} ./--)", name));
    const OptionWord word(value);
    if (word.name.starts_with("--") && find(word.name) != nullptr) {
      fail(fmt::format("{}: its value is missing: {} is an option itself (if it is meant: {}={})", name, value, name,
                       value));
    }
  }

  void note(const CLI::Option& option, const std::string& name, const std::string& value) {
    const auto [before, first] = given_.try_emplace(&option, value);
    if (first || option.get_items_expected_max() > 1) return;
    fail(fmt::format("{}: is given twice, as {} and as {}; once is meant", name, shown(before->second), shown(value)));
  }

  const std::string verb_;
  const std::vector<const CLI::App*> apps_;
  std::map<const CLI::Option*, std::string> given_;
};

bool asks_for_help(const std::string& word) { return word == "--help" || word == "-h"; }

}  // namespace

void check_words(const CLI::App& app, const std::vector<std::string>& words) {
  const std::vector<std::string> verbs = verbs_of(app);
  const std::string all = fmt::format("verbs: {}; 'graze --help' tells more", fmt::join(verbs, ", "));
  if (words.empty()) throw InputError("what shall be done? " + all);
  const std::string& first = words.front();
  if (first.starts_with("-")) {
    if (app.get_option_no_throw(first) != nullptr) return;
    const std::string near = did_you_mean(first, {"--help", "--version"});
    throw InputError(fmt::format("{}: is no option of graze itself{}; options of a verb stand behind it; {}",
                                 shown(first), near, all));
  }
  if (std::find(verbs.begin(), verbs.end(), first) == verbs.end()) {
    if (help_on(first)) {
      throw InputError(fmt::format("'{0}' is not a verb; 'graze help {0}' tells what it is; {1}", first, all));
    }
    throw InputError(fmt::format("'{}' is not a verb{}; {}", shown(first), did_you_mean(first, verbs), all));
  }
  const CLI::App* verb = app.get_subcommand(first);
  std::vector<const CLI::App*> apps = {verb};
  if (verb->get_allow_extras()) apps.push_back(app.get_subcommand("run"));
  WordCheck(first, apps).check({words.begin() + 1, words.end()});
}

std::optional<std::string> topics_asked_for(const CLI::App& app, const std::vector<std::string>& words,
                                            std::size_t width) {
  if (words.empty() || words[0] != "help") return std::nullopt;
  const std::vector<std::string> verbs = verbs_of(app);
  std::string out;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word.starts_with("-")) continue;  // --help, or an option of the verb before it
    if (!out.empty()) out += "\n";
    if (std::find(verbs.begin(), verbs.end(), word) != verbs.end()) {
      out += app.get_subcommand(word)->help(app.get_name());
    } else if (const auto text = help_on(word, width)) {
      out += *text;
    } else {
      throw InputError(fmt::format("'{}' is not a verb, and no topic of help{}; 'graze help help' lists the topics",
                                   shown(word), near_topic(word, verbs)));
    }
  }
  if (out.empty()) return std::nullopt;
  return out;
}

std::vector<std::string> as_help(const std::vector<std::string>& words) {
  if (!words.empty() && words[0] == "help") {
    return words.size() > 1 ? std::vector<std::string>{words[1], "--help"} : std::vector<std::string>{"--help"};
  }
  const auto end = std::find(words.begin(), words.end(), "--");
  if (std::none_of(words.begin(), end, asks_for_help) || words[0].starts_with("-")) return words;
  return {words[0], "--help"};
}

std::string parse_error_text(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<CLI::App*> parsed = const_cast<CLI::App&>(app).get_subcommands();
  if (parsed.empty()) return error.what();
  const CLI::App& verb = *parsed.front();
  const std::string more = fmt::format("'graze {} --help' tells more", verb.get_name());
  const std::vector<std::string> left = verb.remaining();
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) && !left.empty()) {
    if (left[0] == "--" && left.size() > 1 && left[1].starts_with("-")) {
      return fmt::format("{}: '{}' stands behind '--', where nothing is an option; '--' and what follows it go last",
                         verb.get_name(), shown(left[1]));
    }
    const std::string& word = left[left[0] == "--" && left.size() > 1 ? 1 : 0];
    return fmt::format("{}: '{}' is one word too many (a value with blanks needs quotes); {}", verb.get_name(),
                       shown(word), more);
  }
  return fmt::format("{}: {}; {}", verb.get_name(), error.what(), more);
}

}  // namespace graze
