#pragma once
// Table 17 from a `gait:` map: keys, units, relative and absolute stances, checks against the nominal robot.

#include "engine/control/base_command.h"
#include "engine/control/gait_parameters.h"
#include "engine/control/policy.h"
#include "engine/dynamics/chain.h"

namespace graze {

/// A leg as the gait sees it.
struct Leg {
  int frame;                     // of the foot, index into Model::frames
  Chain chain;                   // base to foot
  Vec3 hip;                      // origin of the hip's pitch joint at zero, base frame, m
  double reach;                  // 0.95 of the stretched length from there to the foot, m
  std::vector<int> body_frames;  // frames on the foot's body, whose contact forces count as the foot's
};

struct GaitSetup {
  GaitParameters parameters;
  std::vector<Leg> legs;
  std::unique_ptr<Steering> steering;
};

/// What a `gait:` map may hold.
const Description& gait_description();

/// `own`: by gait_description(). Throws InputError.
GaitSetup read_gait(const ControlContext& context, const Described& own);

}  // namespace graze
