#pragma once
// Where a scenario comes from: enough to read it again on another machine.

#include <string>
#include <vector>

#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"

namespace graze {

/// What the command line may change about a scenario.
struct ScenarioOptions {
  std::vector<Override> overrides;
  bool ignore_missing_meshes = false;
};

/// What a scenario was read from: enough to read it again on another machine.
struct ScenarioSource {
  std::string file;    // as given
  std::string folder;  // that relative paths began in
  ScenarioOptions options;
  InputFiles inputs;  // every file that was read
};

}  // namespace graze
