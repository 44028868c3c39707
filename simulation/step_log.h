#pragma once
// Everything that was known at each physics step of one trace, in columns ready to be exported.

#include <cstdint>
#include <string>
#include <vector>

#include "engine/contact_record.h"

namespace graze {

struct NamedColumn {
  std::string name, unit;  // SI; "1": none
};

/// Columns that belong together, a row per frame.
struct FrameTable {
  std::string name;  // "q", "command/kp"
  std::vector<NamedColumn> columns;
  std::vector<double> values = {};  // [frame][column]
};

/// Frame k is the trace after k physics steps; what acted, acted during the step that led to it, so that in frame 0 all
/// of that is 0.
struct StepLog {
  std::vector<double> time;        // [frame], s
  std::vector<FrameTable> tables;  // state, torques, commands, witnesses
  std::vector<std::uint32_t> contact_frame;
  std::vector<Contact> contacts;  // those that touch, by frame
};

}  // namespace graze
