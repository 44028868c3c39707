#pragma once
// The geometry of robot and environment for a page: the collision shapes, which are what is simulated.

#include "analysis/report_numbers.h"
#include "engine/model/model.h"
#include "jobs/campaign/trace_frames.h"

namespace graze {

/// What all particles have in common: bodies, colliders with their kind, meshes, terrain.
Json scene_json(const Model& model, NumberForm form);

/// One particle's sizes, and its bodies' poses and contacts frame by frame.
Json bodies_json(const TraceFrames& frames, NumberForm form);

}  // namespace graze
