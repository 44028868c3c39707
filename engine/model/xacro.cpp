#include "engine/model/xacro.h"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <string_view>

#include "engine/model/limits.h"
#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using tinyxml2::XMLElement;

/// The end of what an expanded file is called.
constexpr const char* kExpanded = " (expanded by xacro)";

bool is_expression(const char* text) { return std::strstr(text, "$(") || std::strstr(text, "${"); }

std::optional<XacroUse> use_in(const XMLElement& e, bool attributes) {
  constexpr std::string_view kPrefix = "xacro:";
  if (std::string_view(e.Name()).substr(0, kPrefix.size()) == kPrefix) {
    return XacroUse{e.GetLineNum(), fmt::format("<{}>", clipped(e.Name(), 40)), true};
  }
  for (const auto* a = e.FirstAttribute(); attributes && a; a = a->Next()) {
    if (is_expression(a->Value())) return XacroUse{e.GetLineNum(), fmt::format("'{}'", clipped(a->Value(), 80)), false};
  }
  for (const XMLElement* child = e.FirstChildElement(); child; child = child->NextSiblingElement()) {
    const std::string_view tag = child->Name();
    if (auto use = use_in(*child, attributes || tag == "link" || tag == "joint")) return use;
  }
  return std::nullopt;
}

/// Its words as part of a message: printable, each line set in.
std::string quoted_lines(const std::string& said) {
  constexpr std::size_t kMost = 2000;
  std::string out = "\n  ";
  for (const char c : clipped(said.substr(0, said.find_last_not_of(" \n\r\t") + 1), kMost)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\n') {
      out += "\n  ";
    } else if (byte >= 0x20 && byte != 0x7f) {
      out += c;
    }
  }
  return out;
}

std::optional<std::string> run_xacro(const std::string& file, const ProgramLimits& limits) {
  // An absolute name is none of its options.
  const ProgramRun run = run_program({"xacro", input_path(file)}, limits);
  if (!run.there) return std::nullopt;
  const auto blank = [](const std::string& text) { return text.find_first_not_of(" \n\r\t") == std::string::npos; };
  const bool silent = blank(run.errors);
  if (!run.problem.empty()) {
    throw InputError(
        fmt::format("{}: xacro {}{}", file, run.problem,
                    silent ? "; it wrote nothing to standard error" : "; it said:" + quoted_lines(run.errors)));
  }
  if (blank(run.output)) {
    throw InputError(
        fmt::format("{}: xacro printed nothing{}", file, silent ? "" : "; it said:" + quoted_lines(run.errors)));
  }
  return run.output;
}

}  // namespace

std::optional<XacroUse> xacro_use(const tinyxml2::XMLDocument& document) {
  const XMLElement* root = document.RootElement();
  return root ? use_in(*root, false) : std::nullopt;
}

std::string xacro_command(const std::string& file) {
  std::filesystem::path urdf = file;
  if (urdf.extension() == ".xacro") urdf.replace_extension();  // "r.urdf.xacro" -> "r.urdf"
  urdf.replace_extension(urdf == file ? ".expanded.urdf" : ".urdf");
  return fmt::format("xacro {} > {}", file, urdf.string());
}

std::string xacro_advice(const std::string& name) {
  if (!name.ends_with(kExpanded)) return "expand it first: " + xacro_command(name);
  return "the program xacro on PATH printed it so; is it that of ROS?";
}

std::string expanded_name(const std::string& file) { return file + kExpanded; }

ProgramLimits xacro_limits() { return {60, kMaxUrdfBytes}; }

std::optional<std::string> expanded_by_xacro(const std::string& file, const std::string& text,
                                             const ProgramLimits& limits) {
  return derived_input(expanded_name(file), [&]() -> std::optional<std::string> {
    static std::mutex mutex;
    static std::map<std::pair<std::string, std::string>, std::string> known;  // by absolute name and content
    const std::lock_guard lock(mutex);
    const std::pair key(input_path(file), text);
    const auto found = known.find(key);
    if (found != known.end()) return found->second;
    const auto expanded = run_xacro(file, limits);
    if (expanded) known.emplace(key, *expanded);
    return expanded;
  });
}

}  // namespace graze
