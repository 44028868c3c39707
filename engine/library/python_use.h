#pragma once
// What a scenario says of a controller in Python (policy `python`), and the environment that it runs in.

#include <string>

#include "engine/library/library_use.h"

namespace graze {

/// What Python code given by `-c` begins with, so that nothing is imported from the folder that the program runs in
/// (its first place is "", before the library of Python itself).
inline constexpr const char* kNotFromHere = "import sys; sys.path[:] = [place for place in sys.path if place]; ";

/// What runs controllers in Python unless the scenario names another one.
inline constexpr const char* kDefaultInterpreter = "python3";
/// The distribution's, for which it packages NumPy, wherever another one comes first on PATH.
inline constexpr const char* kSystemInterpreter = "/usr/bin/python3";

const Description& python_description();
/// Of the map under `python`. Throws InputError if there is no such file.
LibraryUse read_python_use(const Described& own);

/// The user has said that programs that a scenario names may run. For the whole process; before the scenario is read.
void allow_interpreters();
/// "Python 3.11.2, NumPy 1.24.2", asked of the interpreter itself once in the life of this process; empty if it cannot
/// be asked. NumPy is not imported for it.
std::string python_environment(const std::string& interpreter);
/// The same of an interpreter that has imported NumPy for it; empty if it cannot. Asked anew each time.
std::string working_python(const std::string& interpreter);
/// "the interpreter python3 (/opt/bin/python3) has no NumPy, …": with the nearest right answer. Asks interpreters.
std::string no_numpy_text(const std::string& interpreter);

}  // namespace graze
