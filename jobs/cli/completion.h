#pragma once
// What a shell offers for a word that is being typed: verbs, options, their values, policies and paths of the scenario
// that stands on the line. From the option tables of the verbs, so that it is never behind them.

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

namespace graze {

/// What may stand in a word's place.
struct Offer {
  /// Files, too: "none", "folders", or "files" with the endings that fit ("files .yaml .yml"; "files": any). Folders on
  /// the way always fit.
  std::string files = "none";
  std::vector<std::pair<std::string, std::string>> words;  // with what each is; empty: nothing to be said
};

/// `words`: those behind "graze", the last one being the word (a beginning, or empty) that is typed. Words are offered
/// that begin so, those that end in "=" or "." to be continued. Throws nothing: what cannot be read offers nothing.
Offer offer(const CLI::App& app, const std::vector<std::string>& words);

/// As the scripts of the shells read it: `files`, then a line for each word: the word, a tab, what it is.
std::string offer_lines(const Offer& offer);

/// The script of "bash", "zsh" or "fish", which calls `graze complete -- WORDS`.
std::string completion_script(const std::string& shell);

}  // namespace graze
