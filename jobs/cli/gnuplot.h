#pragma once
// gnuplot, a program of its own that draws what graze plot shows. It is started without a shell and without anybody's
// settings, told what to do through a pipe, and draws into one.

#include <string>

namespace graze {

/// What gnuplot writes for a script that draws on its standard output; `what` names it in messages: "curb.svg". Throws
/// MachineError, which names Debian's package, if there is no gnuplot, and with gnuplot's own words if it fails.
std::string drawn_by_gnuplot(const std::string& script, const std::string& what);

/// Throws MachineError if there is no gnuplot here that can draw SVG (`png`: PNG): before anything long is begun.
void check_gnuplot(bool png);

}  // namespace graze
