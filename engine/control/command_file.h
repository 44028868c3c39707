#pragma once
// A recorded command file (§9.4.2, in place of a gamepad): what the base was told to do, row by row.
//
//   time,forward,strafe,turn
//   0,0.2,0,0
//   1.5,0.2,0,0.4
//
// s, m/s, m/s and rad/s in the base's level frame. A row holds from its time until the next one's, the last for good;
// before the first the robot stands still. `graze drive --record` writes a fifth column, `policy`.

#include <string>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {

struct CommandRow {
  double time = 0;                           // s
  double forward = 0, strafe = 0, turn = 0;  // m/s, m/s, rad/s; positive turn is to the left
  std::string policy = {};                   // under which; "": the file has no such column
  int line = 0;                              // of the file
  std::size_t policy_column = 1;             // of the line, where its policy stands
};

/// s, by which sums of control steps may miss a row's time.
inline constexpr double kCommandSlack = 1e-9;

/// Reads such a file; `name` stands for it in messages. There is a row at least, times are not negative and grow.
/// Throws InputError: "name:line:column: …".
std::vector<CommandRow> parse_commands(const std::string& text, const std::string& name);

/// The file that a setting names, relative to its scenario. Throws InputError, also if the file changes its policy: a
/// gait has one.
std::vector<CommandRow> load_commands(const Settings& file);

/// The file's text. Numbers come back as they are, bit for bit; rows have a `policy` if the first one has.
std::string commands_text(const std::vector<CommandRow>& rows);

}  // namespace graze
