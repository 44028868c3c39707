#include "simulation/disturbances.h"

#include <algorithm>
#include <cmath>

namespace graze {
namespace {

constexpr double kRounding = 1e-9;  // of a step: times that are whole numbers of steps count as such
constexpr double kInstant = 1e-6;   // of a step: shorter pushes are impulses, whose ends no clock tells apart

}  // namespace

double push_share(const BodyDisturbance& push, double from, double step) {
  if (push.duration <= kInstant * step) {
    const double held = std::floor(push.at / step + kRounding);  // by this step
    return std::round(from / step) == held ? 1 : 0;
  }
  const double overlap = std::min(from + step, push.at + push.duration) - std::max(from, push.at);
  return overlap > kRounding * std::min(step, push.duration) ? overlap / push.duration : 0;
}

void disturb(int lane, const Particle& particle, const StepPlace& place, BlockPhysics& physics) {
  for (const BodyDisturbance& one : particle.disturbances) {
    if (one.kind == Disturbance::Kind::push) {
      const double share = push_share(one, place.done * place.step, place.step);
      if (share > 0) physics.push(lane, one.body, one.p_B, share * one.impulse_W);
    } else if (place.done == std::max<double>(std::ceil(one.at / place.step - kRounding), place.first)) {
      physics.load(lane, one.body, one.p_B, one.mass);
    }
  }
}

}  // namespace graze
