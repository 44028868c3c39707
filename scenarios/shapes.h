#pragma once
// The table of shapes of objects: how each is written. object_reader.cpp has those that come with the program.

#include <functional>
#include <string>
#include <vector>

#include "engine/model/world.h"
#include "engine/settings/description.h"
#include "scenarios/registered.h"

namespace graze {

/// Given what is written for a shape, whose keys are known to be described ones.
using ShapeReader = std::function<Shape(const Described&)>;

struct ShapeForm {
  std::string name;
  Description text;
  ShapeReader read;
};

/// Those that come with the program, and behind them those that were registered.
const std::vector<ShapeForm>& shape_forms();
using ShapeRegistration = Registration<ShapeForm>;

}  // namespace graze
