#include "engine/library/python_use.h"

#include <fmt/format.h>

#include <atomic>
#include <map>
#include <mutex>

#include "engine/settings/inputs.h"
#include "engine/settings/program.h"

namespace graze {

namespace {

std::atomic<bool> interpreters_allowed{false};

std::string asked_environment(const std::string& interpreter) {
  const std::string question =
      std::string(kNotFromHere) +
      "import platform, numpy; print(f'Python {platform.python_version()}, NumPy {numpy.__version__}')";
  const ProgramRun run = run_program({interpreter, "-c", question}, {.seconds = 60, .output = 1000});
  if (!run.there || !run.problem.empty()) return "";
  return run.output.substr(0, run.output.find('\n'));
}

}  // namespace

void allow_interpreters() { interpreters_allowed = true; }

std::string python_environment(const std::string& interpreter) {
  static std::mutex mutex;
  static std::map<std::string, std::string> known;
  const std::lock_guard lock(mutex);
  const auto [place, fresh] = known.try_emplace(interpreter);
  if (fresh) place->second = asked_environment(interpreter);
  return place->second;
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
    const std::string other = python_environment(kSystemInterpreter);
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

LibraryUse read_python_use(const Described& own) {
  LibraryUse out = read_outside_use(own, ".py");
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
    std::string asked = python_environment(out.interpreter);
    return asked.empty() ? std::nullopt : std::optional(std::move(asked));
  });
  out.environment = environment.value_or("");
  return out;
}

}  // namespace graze
