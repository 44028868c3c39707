#pragma once
// Why a trace is invalid, in words that name the culprits.

#include <cstdint>
#include <string>

#include "engine/actuation/actuators.h"
#include "engine/block_physics.h"

namespace graze {

/// `fault` behind the step that it was found in, its time (s), and of that step's contacts of the lane the pairs that
/// overlap most and press most: "step 123 (0.123 s), 'thumb' in 'palm' by 12 mm, 'toe' against 'ground' with 3 N s: …".
/// They come first because tables cut long texts. To be called when a trace has become invalid: it looks at all
/// contacts.
std::string invalid_reason(const std::string& fault, std::uint32_t step, double time, const Model& model,
                           const BlockPhysics& physics, int lane);

/// "the controller asks joint KNEE for a torque that is not finite: ", which comes before `fault` as its cause, or
/// nothing: of the first joint whose torque, target or gains are no numbers, else of the largest torque if it is beyond
/// all motors.
std::string controller_failure(const Model& model, const ActuatorCommand& command, int lane);

}  // namespace graze
