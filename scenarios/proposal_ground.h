#pragma once
// The ground of a proposed scenario: a plane at z = 0, unless the robot is fixed to the world and stands in it.

#include <string>

#include "engine/model/model.h"

namespace graze {

/// Whether the robot may have a ground at z = 0: it is put onto it, or no part of it is 1 cm below as it begins.
bool stands_clear(const Model& model, const State& initial);

/// The lines `environment` of a scenario: with a ground, or, if the robot does not stand clear, comments in place of
/// it: how deep it is, and what would be below all that it reaches. Each joint is tried alone, the others as they
/// begin.
std::string proposed_ground(const Model& model, const State& initial);

/// The lines `ignore` of a scenario's `contact`: the robot's links that are in each other as it begins; or nothing.
std::string ignored_overlaps(const Model& model, const State& initial);

}  // namespace graze
