#include "jobs/cli/completion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "analysis/plots.h"
#include "archive/archive.h"
#include "jobs/cli/help_topics.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shipped.h"
#include "jobs/workers/first_folder.h"
#include "scenarios/scenario.h"

namespace graze {
namespace {

constexpr const char* kScenarios = "files .yaml .yml";
constexpr const char* kArchives = "files .h5 .graze";  // campaign directories are folders

/// What a value is, by the name of its option or place.
enum class Value {
  nothing,
  file,
  commands,  // a recorded command file
  folder,
  scenario,
  robot,
  archive,
  policy,
  path,
  shipped,
  robot_or_name,
  link,
  requirement,
  parameter
};

Value value_kind(const std::string& name, const std::string& type) {
  if (type == "FILE.csv") return Value::commands;
  if (type.starts_with("FILE")) return Value::file;
  if (type == "FOLDER" || type == "DIR") return Value::folder;
  if (type.starts_with("ARCHIVE")) return Value::archive;
  const std::pair<const char*, Value> names[] = {{"--policy", Value::policy},
                                                 {"--with", Value::policy},
                                                 {"--under", Value::policy},
                                                 {"--candidates", Value::policy},
                                                 {"--set", Value::path},
                                                 {"--over", Value::path},
                                                 {"--output", Value::file},
                                                 {"--link", Value::link},
                                                 {"--requirement", Value::requirement},
                                                 {"--parameter", Value::parameter},
                                                 {"scenario", Value::scenario},
                                                 {"archive", Value::archive},
                                                 {"archives", Value::archive},
                                                 {"directory", Value::archive},
                                                 {"a", Value::archive},
                                                 {"b", Value::archive},
                                                 {"robot", Value::robot},
                                                 {"name", Value::shipped}};
  for (const auto& [known, kind] : names) {
    if (name == known) return kind;
  }
  return Value::nothing;
}

/// The words of a type like "svg|png"; none of "ARCHIVE|nominal", whose first is a name for something.
std::vector<std::string> choices_of(const std::string& type) {
  std::vector<std::string> out;
  if (type.find('|') == std::string::npos) return out;
  for (std::size_t at = 0; at <= type.size();) {
    const std::size_t end = std::min(type.find('|', at), type.size());
    const std::string word = type.substr(at, end - at);
    if (std::none_of(word.begin(), word.end(), [](unsigned char c) { return std::isupper(c); })) out.push_back(word);
    at = end + 1;
  }
  return out;
}

std::string name_of(const CLI::Option& option) {
  if (option.get_positional()) return option.get_name(true, false);
  return option.get_lnames().empty() ? "-" + option.get_snames().front() : "--" + option.get_lnames().front();
}

class Words {
 public:
  Words(const CLI::App& app, const std::vector<std::string>& words) : app_(app), words_(words), typed_(words.back()) {}

  Offer offer() {
    if (words_.size() == 1) {
      verbs();
    } else if (words_[0] == "help") {
      topics();
    } else {
      const CLI::App* const verb = app_.get_subcommand(words_[0]);  // throws if there is none
      apps_ = {verb};
      if (verb->get_allow_extras()) apps_.push_back(app_.get_subcommand("run"));
      within_verb();
    }
    std::stable_sort(out_.words.begin(), out_.words.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    out_.words.erase(std::unique(out_.words.begin(), out_.words.end(),
                                 [](const auto& a, const auto& b) { return a.first == b.first; }),
                     out_.words.end());
    return out_;
  }

 private:
  void add(const std::string& word, const std::string& what = "") {
    if (word.starts_with(typed_)) out_.words.emplace_back(before_ + word, what);
  }
  void add_all(const std::vector<std::string>& words) {
    for (const std::string& word : words) add(word);
  }

  void verbs() {
    if (typed_.starts_with("-")) return options_of(app_);
    for (const CLI::App* verb : app_.get_subcommands({})) add(verb->get_name(), verb->get_description());
    add("help", "what a verb, a policy, a key of a scenario is");
  }

  void topics() {
    for (const CLI::App* verb : app_.get_subcommands({})) add(verb->get_name());
    add_all(help_topics());
    if (!typed_.empty()) add_all(component_topics());  // hundreds
  }

  const CLI::Option* find(const std::string& name) const {
    for (const CLI::App* app : apps_) {
      if (const CLI::Option* option = app->get_option_no_throw(name)) return option;
    }
    return nullptr;
  }

  /// Walks over the words before the one that is typed: which places are taken, and what the scenario or archive is.
  void within_verb() {
    const CLI::Option* open = nullptr;  // its value comes next
    bool options_end = false;
    for (std::size_t i = 1; i + 1 < words_.size(); ++i) {
      const std::string& word = words_[i];
      if (open != nullptr) {
        open = nullptr;
      } else if (!options_end && word == "--") {
        options_end = true;
      } else if (!options_end && word.size() > 1 && word[0] == '-') {
        const CLI::Option* option = word.find('=') == std::string::npos ? find(word) : nullptr;
        if (option != nullptr && option->get_items_expected_max() > 0) open = option;
      } else {
        places_.push_back(word);
      }
    }
    const std::size_t equals = typed_.find('=');
    if (open != nullptr) {
      value_of(*open);
    } else if (!options_end && typed_.starts_with("--") && equals != std::string::npos) {
      before_ = typed_.substr(0, equals + 1);
      const CLI::Option* option = find(typed_.substr(0, equals));
      typed_.erase(0, equals + 1);
      if (option != nullptr) value_of(*option);
    } else if (!options_end && typed_.starts_with("-")) {
      for (const CLI::App* app : apps_) options_of(*app);
    } else {
      place();
    }
  }

  void options_of(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options()) {
      if (option->get_positional() || option->get_group().empty()) continue;
      const std::string name = name_of(*option);
      const bool once = option->get_items_expected_max() <= 1;
      if (once && std::find(words_.begin(), words_.end() - 1, name) != words_.end() - 1) continue;
      add(name, option->get_description());
    }
  }

  /// The argument whose turn it is; the last one that takes several takes all others.
  void place() {
    std::size_t k = 0;
    for (const CLI::App* app : apps_) {
      for (const CLI::Option* option : app->get_options()) {
        if (!option->get_positional()) continue;
        const bool many = option->get_items_expected_max() > 1;
        if (k++ == places_.size() || (many && k <= places_.size())) return value_of(*option);
      }
    }
  }

  void value_of(const CLI::Option& option) {
    const std::string name = name_of(option), type = option.get_type_name();
    const std::vector<std::string> choices = choices_of(type);
    add_all(choices);
    if (type == "PICTURE") {
      for (const Picture& one : pictures()) add(one.name, one.what);
      add("all");
      return;
    }
    if (choices.empty() || type.starts_with("ARCHIVE")) fill(value_kind(name, type));
  }

  void fill(Value kind) {
    const std::string verb = words_[0];
    if (kind == Value::file) out_.files = "files";
    if (kind == Value::commands) out_.files = "files .csv";
    if (kind == Value::folder) out_.files = "folders";
    if (kind == Value::robot) out_.files = "files .urdf .xacro";
    if (kind == Value::archive) out_.files = kArchives;
    if (kind == Value::scenario) {
      out_.files = kScenarios;
      add_all(verb == "new" ? first_folders() : shipped_scenarios());
    }
    if (kind == Value::shipped) add_all(shipped_scenarios());
    if (kind == Value::policy || kind == Value::link || kind == Value::requirement || kind == Value::parameter)
      names(kind);
    if (kind == Value::path && !places_.empty()) paths(Settings::load(scenario_file(places_[0])));
  }

  /// Of what the line's scenario or archive has.
  void names(Value kind) {
    if (places_.empty()) return;
    const bool archive = places_takes(Value::archive);
    if (archive) return names_of_archive(kind);
    const Scenario scenario = load_scenario(scenario_file(places_[0]));
    if (kind == Value::policy) {
      for (const PolicySpec& policy : scenario.policies) add(policy.name);
    } else if (kind == Value::link) {
      for (const auto& link : scenario.world->robot.links) add(link.name);
    }
  }

  bool places_takes(Value kind) const {
    for (const CLI::Option* option : apps_.front()->get_options()) {
      if (option->get_positional()) return value_kind(name_of(*option), option->get_type_name()) == kind;
    }
    return false;
  }

  void names_of_archive(Value kind) {
    const Archive archive(
        places_[kind == Value::policy && words_[words_.size() - 2] == "--with" ? places_.size() - 1 : 0]);
    const CampaignInfo& info = archive.info();
    if (kind == Value::policy) add_all(info.policies);
    if (kind == Value::requirement) {
      for (const auto& requirement : info.requirements) add(requirement.name);
    }
    if (kind == Value::parameter) {
      for (const auto& parameter : info.parameters) add(parameter.name);
    }
  }

  /// The maps and values that `--set` reaches, a level at a time: "time.", then "time.end=".
  void paths(const Settings& at) {
    if (!at.is_map() || typed_.find('=') != std::string::npos) return;
    for (const auto& [key, value] : at.entries()) {
      const std::string path = value.path();
      if (path.find_first_of("*?{[ ") != std::string::npos) continue;  // globs, which a shell would take for its own
      const std::string folder = path + ".";
      if (value.is_map() && typed_.starts_with(folder)) {
        paths(value);
      } else {
        add(value.is_map() ? folder : path + "=");
      }
    }
  }

  const CLI::App& app_;
  const std::vector<std::string>& words_;
  std::string typed_, before_;  // "--policy=st" is "st" with "--policy=" before it
  std::vector<const CLI::App*> apps_;
  std::vector<std::string> places_;  // arguments that are no options
  Offer out_;
};

}  // namespace

Offer offer(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return {};
  try {
    return Words(app, words).offer();
  } catch (const std::exception&) {
    return {};  // a scenario or an archive that cannot be read; the verb itself says why
  }
}

std::string offer_lines(const Offer& offer) {
  std::string out = offer.files + "\n";
  for (const auto& [word, what] : offer.words) {
    if (word.find_first_of("\n\t") != std::string::npos) continue;
    out += word + (what.empty() ? "" : "\t" + what.substr(0, what.find_first_of("\n\t"))) + "\n";
  }
  return out;
}

}  // namespace graze
