#include "jobs/cli/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "archive/files/utf8.h"
#include "engine/settings/settings.h"
#include "graze_version.h"
#include "jobs/campaign/exit_code.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// One character of UTF-8 that begins at text[i], as \[uXXXX]; i moves behind it.
std::string special(const std::string& text, std::size_t& i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned>(static_cast<unsigned char>(text[k])); };
  const unsigned first = byte(i);
  unsigned code = first >= 0xF0 ? first & 0x07 : first >= 0xE0 ? first & 0x0F : first & 0x1F;
  for (++i; i < text.size() && continues_character(text[i]); ++i) code = code << 6 | (byte(i) & 0x3F);
  --i;
  return fmt::format("\\[u{:04X}]", code);
}

/// Text as troff prints it as it is: hyphens that can be copied, no requests, letters beyond ASCII by their numbers.
std::string plain_text(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool begins = i == 0 || text[i - 1] == '\n';
    if (begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '\'') {
      out += "\\(aq";
    } else if (c == '^' || c == '~' || c == '`') {
      out += c == '^' ? "\\(ha" : c == '~' ? "\\(ti" : "\\(ga";
    } else if (static_cast<unsigned char>(c) >= 0x80) {
      out += special(text, i);
    } else {
      out += c;
    }
  }
  return out;
}

std::string bold(const std::string& text) { return "\\fB" + plain_text(text) + "\\fR"; }
std::string slanted(const std::string& text) { return "\\fI" + plain_text(text) + "\\fR"; }

std::string header(const std::string& name, const std::string& what) {
  std::string upper = name;
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
  return fmt::format(".TH {} 1 \"\" \"graze {}\" \"Graze\"\n.SH NAME\n{} \\- {}\n", plain_text(upper), GRAZE_VERSION,
                     plain_text(name), plain_text(what));
}

/// The words of a type as they stand in --help.
std::string value_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type == "TEXT" ? "VALUE" : type;
}

/// "-n, --particles 1..100", or the name of a positional.
std::string tag(const CLI::Option& option) {
  if (option.get_positional()) return slanted(option.get_name(true, false));
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back(bold("-" + name));
  for (const std::string& name : option.get_lnames()) names.push_back(bold("--" + name));
  const std::string out = fmt::format("{}", fmt::join(names, ", "));
  return option.get_items_expected_max() == 0 ? out : out + " " + slanted(value_of(option));
}

std::string options_section(const CLI::App& app, bool positional) {
  std::string out;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional() != positional || option->get_group().empty()) continue;
    std::string text = option->get_description();
    if (const std::string fallback = option->get_default_str(); !fallback.empty()) {
      text += fmt::format("{} Default: {}", text.ends_with(".") ? "" : ".", fallback);
    }
    out += fmt::format(".TP\n{}\n{}\n", tag(*option), plain_text(text));
  }
  return out.empty() ? "" : fmt::format(".SH {}\n{}", positional ? "ARGUMENTS" : "OPTIONS", out);
}

/// What stands below the options: indented lines as they are, headings, paragraphs.
std::string footer_section(const CLI::App& verb) {
  std::istringstream lines(verb.get_footer());
  std::string out;
  bool literal = false;
  for (std::string line; std::getline(lines, line);) {
    const bool indented = line.starts_with(" ");
    if (literal && !indented) out += ".fi\n.RE\n";
    if (!literal && indented) out += ".RS 2\n.nf\n";
    literal = indented;
    if (line.empty()) continue;
    if (line == "Examples:") {
      out += ".SH EXAMPLES\n";
    } else if (line.ends_with(":") && !indented) {
      out += ".SS " + plain_text(line.substr(0, line.size() - 1)) + "\n";
    } else {
      out += (indented ? "" : ".PP\n") + plain_text(indented ? line.substr(line.find_first_not_of(' ')) : line) + "\n";
    }
  }
  return literal ? out + ".fi\n.RE\n" : out;
}

/// What codes of single verbs mean, where it is not what they mean elsewhere.
const char* own_meaning(const std::string& verb, int code) {
  static const std::map<std::pair<std::string, int>, const char*> all = {
      {{"replay", kGateMissed}, "the trace is not the one of the archive"},
      {{"view", kGateMissed}, "a trace is not the one of the archive"},
      {{"improve", kGateMissed}, "no step helps any more"},
      {{"improve", kInconclusive}, "--max-steps ended it"},
      {{"predict", kInconclusive}, "no verdict: no particle was done in time, or none is valid"},
      {{"doctor", kMachineFailed}, "something that campaigns need is broken"},
      {{"check", kGateMissed}, "a controller fails in particle 0, or (--determinism) does not keep its promise"}};
  const auto found = all.find({verb, code});
  return found == all.end() ? nullptr : found->second;
}

std::string exit_section(const std::string& verb) {
  const std::pair<int, const char*> codes[] = {
      {kDone, "done, and every gate met"},
      {kGateMissed, "a gate was missed"},
      {kInvalidInput, "invalid input, or a damaged archive"},
      {kMachineFailed, "the campaign is incomplete, or the machine failed"},
      {kInconclusive, "a gate or a question is inconclusive: run more particles"}};
  std::string out = ".SH EXIT STATUS\n";
  for (const auto& [code, text] : codes) {
    const char* const own = own_meaning(verb, code);
    out += fmt::format(".TP\n{}\n{}\n", code, plain_text(own ? own : text));
  }
  return out;
}

std::string verb_page(const CLI::App& verb) {
  const std::string name = "graze-" + verb.get_name();
  std::string out = header(name, verb.get_description());
  out += ".SH SYNOPSIS\n" + bold("graze " + verb.get_name()) + " [" + slanted("OPTION") + "]...";
  for (const CLI::Option* option : verb.get_options()) {
    if (!option->get_positional()) continue;
    const std::string word =
        slanted(option->get_name(true, false)) + (option->get_items_expected_max() > 1 ? "..." : "");
    out += option->get_required() ? " " + word : " [" + word + "]";
  }
  out += "\n" + options_section(verb, true) + options_section(verb, false) + footer_section(verb) +
         exit_section(verb.get_name());
  return out + ".SH SEE ALSO\n.BR graze (1)\n";
}

std::string main_page(const CLI::App& app) {
  std::string out = header("graze", "simulation of how a robot fails");
  out += ".SH SYNOPSIS\n" + bold("graze") + " " + slanted("VERB") + " [" + slanted("OPTION") + "]... [" +
         slanted("ARGUMENT") + "]...\n.br\n" + bold("graze help") + " [" + slanted("TOPIC") + "]...\n";
  out += ".SH DESCRIPTION\n" + plain_text(app.get_description()) + "\n.SH VERBS\n";
  std::vector<std::string> also;
  for (const CLI::App* verb : app.get_subcommands({})) {
    out += fmt::format(".TP\n{}\n{}\n", bold(verb->get_name()), plain_text(verb->get_description()));
    also.push_back(fmt::format(".BR graze\\-{} (1)", plain_text(verb->get_name())));
  }
  out += options_section(app, false) + ".SH TOPICS OF HELP\n" + footer_section(app) + exit_section("");
  out +=
      ".SH ENVIRONMENT\n"
      ".TP\n.B GRAZE_ISA\navx512, avx2 or portable: which instructions the lanes use; all give the same bits\n"
      ".TP\n.B GRAZE_DATA\nthe folder of shipped scenarios and robots, if it is not beside the program\n"
      ".TP\n.B COLUMNS\nhow wide lines of help are\n";
  return out + fmt::format(".SH SEE ALSO\n{}\n", fmt::join(also, ",\n"));
}

}  // namespace

std::map<std::string, std::string> manual_pages(const CLI::App& app) {
  std::map<std::string, std::string> out = {{"graze.1", main_page(app)}};
  for (const CLI::App* verb : app.get_subcommands({})) out["graze-" + verb->get_name() + ".1"] = verb_page(*verb);
  return out;
}

void write_manual(const CLI::App& app, const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  for (const auto& [name, text] : manual_pages(app)) {
    std::ofstream out(fs::path(folder) / name, std::ios::binary);
    if (!(out << text << std::flush)) {
      throw MachineError(fmt::format("{}: cannot be written", (fs::path(folder) / name).string()));
    }
  }
}

}  // namespace graze
