#include "engine/library/python_use.h"

#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <map>
#include <mutex>

#include "engine/settings/inputs.h"
#include "engine/settings/program.h"

namespace graze {

namespace {

std::atomic<bool> interpreters_allowed{false};

constexpr double kLongestAnswer = 60;  // s, for an interpreter to start and to import NumPy

struct Environment {
  std::string text;     // "Python 3.11.2, NumPy 1.24.2"; empty: not known
  bool silent = false;  // it did not answer in time
};

// NumPy's version without NumPy, which takes twice as long to import as the interpreter to start: its package is one
// that imports nothing. Whether NumPy can be imported, an interpreter that runs a controller finds out.
constexpr const char* kVersion = R"(import sys, importlib.util
where = importlib.util.find_spec('numpy')
package = type(sys)('numpy')
package.__path__ = where.submodule_search_locations
sys.modules['numpy'] = package
import numpy.version
print(f'Python {sys.version.split()[0]}, NumPy {numpy.version.version}'))";

constexpr const char* kVersionOnceImported =
    "import sys, numpy; print(f'Python {sys.version.split()[0]}, NumPy {numpy.__version__}')";

Environment asked_environment(const std::string& interpreter, const char* question) {
  const ProgramRun run = run_program({interpreter, "-c", std::string(kNotFromHere) + question},
                                     {.seconds = kLongestAnswer, .output = 1000});
  if (!run.there || !run.problem.empty()) return {"", run.problem.starts_with("did not end")};
  return {run.output.substr(0, run.output.find('\n'))};
}

/// Asked once: an interpreter takes a tenth of a second to start.
const Environment& environment_of(const std::string& interpreter) {
  static std::mutex mutex;
  static std::map<std::string, Environment> known;
  const std::lock_guard lock(mutex);
  const auto [place, fresh] = known.try_emplace(interpreter);
  if (fresh) place->second = asked_environment(interpreter, kVersion);
  return place->second;
}

}  // namespace

void allow_interpreters() { interpreters_allowed = true; }

std::string python_environment(const std::string& interpreter) { return environment_of(interpreter).text; }

std::string working_python(const std::string& interpreter) {
  return asked_environment(interpreter, kVersionOnceImported).text;
}

std::string no_numpy_text(const std::string& interpreter) {
  const ProgramRun run =
      run_program({interpreter, "-c", std::string(kNotFromHere) + "import sys; print(sys.executable)"},
                  {.seconds = 60, .output = 5000});
  const std::string path = run.there && run.problem.empty() ? run.output.substr(0, run.output.find('\n')) : "";
  const std::string found = path.empty() || path == interpreter ? "" : " (" + path + ")";
  const std::string program = path.empty() ? interpreter : path;
  std::string out =
      fmt::format("the interpreter {}{} has no NumPy, which controllers in Python need", interpreter, found);
  if (program != kSystemInterpreter) {
    const std::string other = working_python(kSystemInterpreter);
    if (!other.empty()) return out + fmt::format("; {0} has it ({1}): interpreter: {0}", kSystemInterpreter, other);
    return out + fmt::format(": {} -m pip install numpy, or name another one under `interpreter`", program);
  }
  return out + ": apt-get install python3-numpy, or name another one under `interpreter`";
}

const Description& python_description() {
  static const Description text = {
      "asks a controller of your own in Python, a class with the method act(observation, targets)",
      {{"file", {Form::text("FILE")}, Default::required(), "the Python file, relative to the scenario"},
       {"class", {Form::text("CLASS")}, Default::value("Controller"), "the class in it"},
       {"settings",
        {Form::named_values("SETTING")},
        {},
        "whatever the controller takes: it gets the map as a dictionary, numbers without units"},
       {"interpreter",
        {Form::text("PROGRAM")},
        Default::value(kDefaultInterpreter),
        "a program on PATH, or, with a / in it, a file relative to the scenario: .venv/bin/python"},
       {"files",
        {Form::texts(-1, "FILE")},
        {},
        "what else the controller reads or imports (weights, modules): `resume` and `replay` refuse others"},
       isolation_key(),
       timeout_key(
           "longest time on the clock that reset() or act() may take (imports and __init__() 60 s more); then its "
           "particle is left unfinished")},
      {},
      {},
      "It sees and fills NumPy arrays `[quantity, lane]`, eight robots per call. `control` says what becomes of joint "
      "positions, velocities and torques. It runs with your rights, so none is run without --trust. "
      "docs/controllers.md tells more."};
  return text;
}

namespace {

/// Python would say of them that they have null bytes, or a syntax error in their first line.
void refuse_other_controllers(const Described& own, const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (ending == ".so" || ending == ".c" || ending == ".cpp") {
    own.at("file").fail(fmt::format("{}: is no Python file; {}", file,
                                    ending == ".so" ? "a shared object is policy `library: {file: …}`"
                                                    : "build it, and name the .so under `library: {file: …}`"));
  }
  if (ending == ".onnx") {
    own.at("file").fail(fmt::format("{}: is no Python file; a network is policy `network: {{file: …}}`", file));
  }
}

}  // namespace

LibraryUse read_python_use(const Described& own) {
  LibraryUse out = read_outside_use(own, ".py");
  refuse_other_controllers(own, out.file);
  out.class_name = own.has("class") ? own.at("class").text() : "Controller";
  if (out.class_name.empty()) own.at("class").fail("is empty; name the class, or leave it out for Controller");
  out.interpreter = kDefaultInterpreter;
  if (const auto typed = own.find("interpreter")) {
    const std::string text = typed->text();
    out.interpreter = text.find('/') == std::string::npos ? text : input_path(typed->resolve_file(text));
  }
  if (const auto files = own.find("files")) {
    for (const Settings& one : files->items()) out.files.push_back(read_outside_file(one));
  }
  // Kept by archives beside the file's own hash.
  const auto environment = derived_input(out.file + ".environment", [&]() -> std::optional<std::string> {
    if (!interpreters_allowed) return std::nullopt;
    const Environment& asked = environment_of(out.interpreter);
    if (asked.silent) {  // that of the controller would keep us waiting as long again
      own.settings()
          .at(own.has("interpreter") ? "interpreter" : "file")
          .fail(fmt::format("the interpreter '{}' did not tell its version within {:g} s; does "
                            "'{} -c \"import numpy\"' come back?",
                            out.interpreter, kLongestAnswer, out.interpreter));
    }
    return asked.text.empty() ? std::nullopt : std::optional(asked.text);
  });
  out.environment = environment.value_or("");
  return out;
}

}  // namespace graze
